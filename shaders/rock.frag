#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Rock with coralline crusts where it is shaded, turf on top, sand where it meets the ground.

#include "view.glsl"
#include "water.glsl"
#include "caustics.glsl"
#include "light.glsl"
#include "shown.glsl"

layout(set = 0, binding = 3) uniform sampler2D noise;
layout(set = 0, binding = 4) uniform sampler2D contact;

#include "ground.glsl"
#include "rock.glsl"

layout(location = 0) in vec4 normal_buried;
layout(location = 1) in float sunlit;
layout(location = 0) out vec4 color;

void main() {
    vec3 p = pixel_ray(gl_FragCoord.xy) * (1.0 / gl_FragCoord.w);
    vec3 x = p + view.eye;
    vec3 n = normalize(normal_buried.xyz);
    float distance = length(p);

    // Triplanar noise: value and slope from the three planes, weighted by the normal.
    vec3 weight = n * n;
    weight *= weight;
    weight /= weight.x + weight.y + weight.z;
    vec4 a = texture(noise, x.yz * 1.3);
    vec4 b = texture(noise, x.xz * 1.3 + 0.3);
    vec4 c = texture(noise, x.xy * 1.3 + 0.6);
    vec4 t = a * weight.x + b * weight.y + c * weight.z;
    vec3 bump = vec3(0.0, a.gb - 0.5) * weight.x + vec3(b.g - 0.5, 0.0, b.b - 0.5) * weight.y
        + vec3(c.gb - 0.5, 0.0) * weight.z;
    float detail = 0.5;
    if (distance < 8.0) {
        vec4 fine = texture(noise, (x.xz + x.y * vec2(0.7, -0.6)) * 6.3);
        float near = clamp(1.0 - distance * 0.125, 0.0, 1.0);
        bump += vec3(fine.g - 0.5, (fine.g - fine.b) * 0.5, fine.b - 0.5) * near * 0.9;
        detail = mix(0.5, fine.a, near);
    }
    vec3 bent = normalize(n - bump * 1.5);

    float open;
    vec3 albedo = boulder(n, t, detail, normal_buried.w * 0.25, open);
    color = written(through_water(lit_ground(albedo, bent, p, vec2(open, sunlit)), p), 1.0, gl_FragCoord.xy);
}
