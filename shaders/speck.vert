#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// A small sprite as a point.

#include "view.glsl"
#include "water.glsl"
#include "caustics.glsl"
#include "sprite.glsl"
#include "shown.glsl"

layout(location = 0) flat out vec4 out_color;
layout(location = 1) flat out vec3 out_middle;

void main() {
    Sprite sprite = sprites[gl_VertexIndex];
    vec3 p = sprite.place;
    gl_Position = view.clip_from_eye * vec4(p, 1.0);
    float true_width = sprite.size * view.pixels_per_metre / gl_Position.w;
    float width = max(true_width, push.least);
    float share = true_width / width;
    vec4 tint = tint_of(sprite) * (share * share);
    out_color = veil(vec4(sprite_light(p) * tint.rgb + sprite_fog(p) * tint.a, tint.a));
    out_middle = vec3((gl_Position.xy / gl_Position.w * 0.5 + 0.5) * view.size, width * 0.5 + 0.5);
    // Every pixel that the square touches.
    gl_PointSize = width + 1.0;
}
