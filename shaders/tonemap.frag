#version 460
#extension GL_GOOGLE_include_directive : require
// Scene light to display values, with dither before the rounding to 8 bits.

#include "tone.glsl"

layout(set = 0, binding = 0) uniform sampler2D hdr;
layout(location = 0) out vec4 color;

layout(push_constant) uniform Push {
    float exposure;
    uint encode; // 1: the target stores what it is given; 0: it encodes sRGB by itself
    int samples; // along each side of a pixel
    uint curve;  // 0: a diagram, whose colours are shown as they are
} push;

void main() {
    // The curve comes before the mean: an edge between dark and dazzling stays smooth.
    vec3 shown = vec3(0.0);
    ivec2 corner = ivec2(gl_FragCoord.xy) * push.samples;
    for (int y = 0; y < push.samples; y++)
        for (int x = 0; x < push.samples; x++) {
            vec3 light = texelFetch(hdr, corner + ivec2(x, y), 0).rgb * push.exposure;
            shown += push.curve == 0u ? clamp(light, 0.0, 1.0) : neutral_tone(light);
        }
    shown = srgb_encode(shown / float(push.samples * push.samples));
    shown += (dither(gl_FragCoord.xy) - 0.5) / 255.0;
    if (push.encode == 0u) {
        shown = clamp(shown, 0.0, 1.0);
        shown = mix(shown / 12.92, pow((shown + 0.055) / 1.055, vec3(2.4)), step(vec3(0.04045), shown));
    }
    color = vec4(shown, 1.0);
}
