#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// The sea bed.

#include "view.glsl"
#include "water.glsl"
#include "caustics.glsl"
#include "light.glsl"
#include "shown.glsl"

layout(set = 0, binding = 3) uniform sampler2D noise;
layout(set = 0, binding = 4) uniform sampler2D contact;

#include "ground.glsl"

layout(location = 0) in vec2 slope;
layout(location = 0) out vec4 color;

void main() {
    vec3 p = pixel_ray(gl_FragCoord.xy) * (1.0 / gl_FragCoord.w);
    Sand sand = sand_at(p.xz + view.eye.xz, slope, length(p));
    vec2 open = texture(contact, (p.xz - view.contact_origin) * view.contact_scale).rg;
    color = written(through_water(lit_ground(sand.albedo, sand.normal, p, open), p), 1.0, gl_FragCoord.xy);
}
