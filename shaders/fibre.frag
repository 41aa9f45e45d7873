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
layout(location = 1) in vec4 circle_radius_coverage;
layout(location = 2) flat in uvec3 look;

layout(location = 0) out vec4 color;

layout(set = 0, binding = 1, std430) readonly buffer Materials { Material materials[]; };

void main() {
    Material m = materials[look.x & 0xffffffu];
    float w = normal_along.w * 2.0;
    Surface s;
    s.normal = normalize(normal_along.xyz);
    s.along = min(w, 1.0);
    s.disc = max(w - 1.0, 0.0);
    s.circle = circle_radius_coverage.xy;
    s.radius_cm = circle_radius_coverage.z;
    s.chain = uintBitsToFloat(look.z);

    vec3 p = pixel_ray(gl_FragCoord.xy) * (1.0 / gl_FragCoord.w);
    vec3 light = tissue_light(m, look.x >> 24, look.y, s, p);
    float alpha = clamp(m.base.a * circle_radius_coverage.w, 0.0, 1.0);
    color = written(through_water(light, p), alpha, gl_FragCoord.xy);
}
