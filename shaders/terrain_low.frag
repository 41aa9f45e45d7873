#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// The sea bed at low quality.

#include "view.glsl"
#include "water.glsl"
#include "caustics.glsl"
#include "light.glsl"
#include "ground_low.glsl"
#include "shown.glsl"

layout(set = 0, binding = 3) uniform sampler2D sand;    // as host/render/src/sand.rs makes it
layout(set = 0, binding = 4) uniform sampler2D contact;

layout(location = 0) in vec2 slope;
layout(location = 1) in vec3 caustics;
layout(location = 2) in vec3 through;
layout(location = 3) in vec3 added;
layout(location = 4) in vec2 entry;

layout(location = 0) out vec4 color;

void main() {
    vec3 p = pixel_ray(gl_FragCoord.xy) * (1.0 / gl_FragCoord.w);
    vec4 texel = texture(sand, (p.xz + view.eye.xz) * 0.125);
    vec2 gradient = slope + (texel.gb - 0.5) * 2.56;
    vec3 normal = vec3(-gradient.x, 1.0, -gradient.y) * inversesqrt(1.0 + dot(gradient, gradient));
    vec3 albedo = mix(SAND_DARK, SAND_LIGHT, texel.r) * (texel.a * 1.15);
    vec2 open = texture(contact, (p.xz - view.contact_origin) * view.contact_scale).rg;
    color = written(seen_ground(albedo, normal, open, caustics, entry, Haze(through, added)), 1.0, gl_FragCoord.xy);
}
