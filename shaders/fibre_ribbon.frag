#version 460
#extension GL_GOOGLE_include_directive : require
// A lit ribbon: its edges' light, and between them a parabola through the light of its middle.

#include "tone.glsl"

layout(location = 0) noperspective in vec4 edge; // what is shown; a: coverage
layout(location = 1) noperspective in vec4 bow;  // middle minus mean of the edges; w: -1 at one edge, 1 at the other

layout(location = 0) out vec4 color;

void main() {
    vec3 shown = edge.rgb + bow.rgb * (1.0 - bow.w * bow.w);
    color = vec4(shown + (dither(gl_FragCoord.xy) - 0.5) / 255.0, edge.a);
}
