#version 460
#extension GL_GOOGLE_include_directive : require
// A fibre's skin, lit pixel by pixel.

#include "view.glsl"
#include "water.glsl"
#include "caustics.glsl"
#include "hash.glsl"
#include "light.glsl"
#include "tissue.glsl"
#include "shown.glsl"

layout(location = 0) in vec4 normal_along;
layout(location = 1) in vec4 circle_radius_half; // w: half the true width [px]
layout(location = 2) flat in uvec3 look;
layout(location = 3) in float edge; // distance from the middle of a ribbon [px]; 0: a tube

layout(location = 0) out vec4 color;

layout(constant_id = 2) const uint FRINGE = 0u; // 1: only what covers less than half of a pixel

layout(set = 0, binding = 1, std430) readonly buffer Materials { Material materials[]; };

void main() {
    // A ribbon's edge falls from inside to outside of a pixel that it cuts: it moves without a step, and does not crawl.
    // What covers half of a pixel or more comes first and hides what is behind; what covers less comes last and hides nothing.
    float half_px = circle_radius_half.w;
    float covered = clamp(half_px + 0.5 - abs(edge), 0.0, min(2.0 * half_px, 1.0));
    if (edge != 0.0 && (covered < 0.5) != (FRINGE != 0u)) discard;

    Material m = materials[look.x & 0xffffffu];
    float w = normal_along.w * 2.0;
    Surface s;
    s.normal = normalize(normal_along.xyz);
    s.along = min(w, 1.0);
    s.disc = max(w - 1.0, 0.0);
    s.circle = circle_radius_half.xy;
    s.radius_cm = circle_radius_half.z;
    s.chain = uintBitsToFloat(look.z);

    vec3 p = pixel_ray(gl_FragCoord.xy) * (1.0 / gl_FragCoord.w);
    vec3 light = tissue_light(m, look.x >> 24, look.y, s, p);
    float alpha = clamp(m.base.a * covered, 0.0, 1.0);
    color = written(through_water(light, p), alpha, gl_FragCoord.xy);
}
