#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// A corner of a sprite: four vertices each, joined by indices.

#include "view.glsl"
#include "water.glsl"
#include "caustics.glsl"
#include "sprite.glsl"

layout(location = 0) out vec2 out_uv;
layout(location = 1) flat out vec3 out_light;
layout(location = 2) flat out vec4 out_fog;   // a: opacity
layout(location = 3) flat out vec2 out_handle_soft; // texture's handle; 1 / range over which it fades before what is behind it [1/m]

void main() {
    Sprite sprite = sprites[gl_VertexIndex >> 2];
    vec2 corner = vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1 & 1) * 2.0 - 1.0;
    vec3 p = sprite.place;
    bool facing = dot(sprite.axis, sprite.axis) < 0.5;
    vec3 normal = facing ? normalize(-p) : sprite.axis;
    // The picture's up where the sprite faces the eye; any fixed direction across the axis where it lies.
    vec3 up = facing ? view.up : abs(normal.y) < 0.9 ? vec3(0.0, 1.0, 0.0) : vec3(1.0, 0.0, 0.0);
    vec3 right = normalize(cross(up, normal));
    up = cross(normal, right);
    float c = cos(sprite.roll);
    float s = sin(sprite.roll);
    float pixel = dot(p, view.forward) / view.pixels_per_metre;
    float size = max(sprite.size, push.least * pixel);
    float share = sprite.size / size;
    vec2 at = vec2(corner.x * c - corner.y * s, corner.x * s + corner.y * c) * (0.5 * size);
    gl_Position = view.clip_from_eye * vec4(p + right * at.x + up * at.y, 1.0);
    vec4 tint = tint_of(sprite) * (share * share);
    out_uv = vec2(corner.x, -corner.y) * 0.5 + 0.5;
    out_light = sprite_light(p) * tint.rgb;
    out_fog = vec4(sprite_fog(p) * tint.a, tint.a);
    out_handle_soft = vec2(float(sprite.layer), 1.0 / clamp(0.5 * sprite.size, 0.01, 1.0));
}
