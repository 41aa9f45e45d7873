#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Light that the water scatters out of a shaft toward the eye: brightest toward the sun, soft at its sides
// and where something stands in it. At most .06 of white.

#include "view.glsl"
#include "water.glsl"

layout(set = 0, binding = 2) uniform sampler2D depths;

layout(location = 0) in vec2 uv;
layout(location = 1) in vec3 place;
layout(location = 2) flat in float bright;

layout(location = 0) out vec4 color;

void main() {
    float distance = length(place);
    vec3 direction = place / max(distance, 1e-6);
    float across = 1.0 - uv.x * uv.x;
    float along = (1.0 - uv.y * uv.y) * clamp(uv.y * 8.0, 0.0, 1.0);
    float behind = view.near / max(texelFetch(depths, ivec2(gl_FragCoord.xy), 0).r, 1e-7);
    float soft = clamp((behind - 1.0 / gl_FragCoord.w) * 1.5, 0.0, 1.0);
    // Henyey and Greenstein, g = .7, of which a third is even.
    float x = 1.49 - 1.4 * dot(direction, view.sun);
    float toward = 0.3 + 0.7 * min(0.51 * inversesqrt(x) / x, 2.5);
    vec3 tint = view.scattered / max(view.scattered.b, max(view.scattered.g, view.scattered.r));
    vec3 light = mix(tint, vec3(1.0), 0.5) * sea_light_at(depth_of(place)) * exp(-view.beam * distance * 0.3);
    float strength = 0.06 * min(1.8 * toward, 1.0) * bright * across * across * along * soft * clamp(distance - 0.5, 0.0, 1.0);
    color = vec4(light * strength, 0.0);
}
