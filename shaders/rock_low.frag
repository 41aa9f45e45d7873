#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// A boulder at low quality: two noises, each laid over it at a slant, so that no face of it has only streaks.

#include "view.glsl"
#include "water.glsl"
#include "caustics.glsl"
#include "light.glsl"
#include "ground_low.glsl"
#include "rock.glsl"
#include "shown.glsl"

layout(set = 0, binding = 3) uniform sampler2D noise;

layout(location = 0) in vec4 normal_buried;
layout(location = 1) in vec3 caustics;
layout(location = 2) in vec3 through;
layout(location = 3) in vec3 added;
layout(location = 4) in vec2 entry;
layout(location = 5) in float sunlit;

layout(location = 0) out vec4 color;

void main() {
    vec3 p = pixel_ray(gl_FragCoord.xy) * (1.0 / gl_FragCoord.w);
    vec3 x = p + view.eye;
    vec3 n = normalize(normal_buried.xyz);
    vec4 t = texture(noise, (x.xz + x.y * vec2(-0.6, 0.7)) * 1.3);
    vec4 fine = texture(noise, (x.xz + x.y * vec2(0.7, -0.6)) * 4.7);
    vec3 bump = vec3(t.g - 0.5, (t.b - t.g) * 0.5, t.b - 0.5) + vec3(fine.g - 0.5, (fine.g - fine.b) * 0.5, fine.b - 0.5) * 0.7;
    vec3 bent = normalize(n - bump * 1.3);
    float open;
    vec3 albedo = boulder(n, t, fine.a, normal_buried.w * 0.25, open);
    color = written(seen_ground(albedo, bent, vec2(open, sunlit), caustics, entry, Haze(through, added)), 1.0, gl_FragCoord.xy);
}
