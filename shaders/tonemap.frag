#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Scene light to display values, with dither before the rounding to 8 bits.

#include "tone.glsl"

layout(set = 0, binding = 0) uniform sampler2D hdr;
layout(location = 0) out vec4 color;

layout(constant_id = 2) const uint ENCODE = 1u; // 1: the target stores what it is given; 0: it encodes sRGB by itself
layout(constant_id = 3) const int SAMPLES = 1;  // along each side of a pixel
layout(constant_id = 4) const uint CURVE = 1u;  // 0: a diagram, whose colours are shown as they are; 2: what is shown already

layout(push_constant, scalar) uniform TonePush { float exposure; } push;

void main() {
    // The curve comes before the mean: an edge between dark and dazzling stays smooth.
    vec3 shown = vec3(0.0);
    ivec2 corner = ivec2(gl_FragCoord.xy) * SAMPLES;
    for (int y = 0; y < SAMPLES; y++)
        for (int x = 0; x < SAMPLES; x++) {
            vec3 light = texelFetch(hdr, corner + ivec2(x, y), 0).rgb;
            if (CURVE != 2u) light *= push.exposure;
            shown += CURVE == 1u ? neutral_tone(light) : clamp(light, 0.0, 1.0);
        }
    shown /= float(SAMPLES * SAMPLES);
    if (CURVE != 2u) shown = srgb_encode(shown) + (dither(gl_FragCoord.xy) - 0.5) / 255.0;
    if (ENCODE == 0u) {
        shown = clamp(shown, 0.0, 1.0);
        shown = srgb_decode(shown);
    }
    color = vec4(shown, 1.0);
}
