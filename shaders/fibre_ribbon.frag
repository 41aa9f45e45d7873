#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// A lit ribbon: its edges' light, and between them a parabola through the light of its middle. What is thin
// fades around its edge, so that it moves without a step.

#include "fibre.glsl"
#include "tone.glsl"

layout(location = 0) noperspective in vec4 edge; // what is shown; a: true over drawn width, which is 2 LIT_EDGE more
layout(location = 1) noperspective in vec4 bow;  // middle minus mean of the edges; w: -1 at one edge, 1 at the other

// 0: a solid ribbon; of a thin one 1: what hides what is behind, 2: what hides nothing.
layout(constant_id = 0) const uint PART = 0u;

layout(location = 0) out vec4 color;

void main() {
    float half_px = LIT_EDGE * edge.a / max(1.0 - edge.a, 0.004);
    float covered = covered_share(half_px, (half_px + LIT_EDGE) * abs(bow.w), LIT_EDGE);
    if (PART == 1u && covered < HIDES) discard;
    if (PART == 2u && covered >= HIDES) discard;
    vec3 shown = edge.rgb + bow.rgb * (1.0 - bow.w * bow.w);
    color = vec4(shown + (dither(gl_FragCoord.xy) - 0.5) / 255.0, covered);
}
