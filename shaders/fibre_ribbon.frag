#version 460
#extension GL_GOOGLE_include_directive : require
// A lit ribbon: its edges' light, and between them a parabola through the light of its middle. What is thinner than a pixel
// fades over the pixel around its edge, so that it moves without a step.

#include "tone.glsl"

layout(location = 0) noperspective in vec4 edge; // what is shown; a: true over drawn width, which is one pixel more
layout(location = 1) noperspective in vec4 bow;  // middle minus mean of the edges; w: -1 at one edge, 1 at the other

// 0: a solid ribbon; of a thin one 1: what covers half of a pixel or more, and hides what is behind, 2: what covers less.
layout(constant_id = 0) const uint PART = 0u;

layout(location = 0) out vec4 color;

void main() {
    float half_px = 0.5 * edge.a / max(1.0 - edge.a, 0.004);
    float covered = clamp((half_px + 0.5) * (1.0 - abs(bow.w)), 0.0, min(2.0 * half_px, 1.0));
    if (PART == 1u && covered < 0.5) discard;
    if (PART == 2u && covered >= 0.5) discard;
    vec3 shown = edge.rgb + bow.rgb * (1.0 - bow.w * bow.w);
    color = vec4(shown + (dither(gl_FragCoord.xy) - 0.5) / 255.0, covered);
}
