#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// A debug line as a quad that is a given number of pixels wide, with a soft edge of half a pixel.

#include "tone.glsl"
#include "view.glsl"

struct Line {
    vec3 from; // eye space
    uint color; // sRGB 0xAABBGGRR
    vec3 to;   // eye space
};
layout(set = 0, binding = 1, scalar) readonly buffer Lines { Line lines[]; };

layout(push_constant, scalar) uniform LinePush {
    float width; // [px]
} push;

layout(location = 0) out vec4 out_color;
layout(location = 1) out float out_edge;

void main() {
    Line line = lines[gl_VertexIndex / 6];
    int corner = gl_VertexIndex % 6;
    bool end = corner == 1 || corner == 2 || corner == 4;
    float side = corner == 0 || corner == 1 || corner == 3 ? -1.0 : 1.0;
    // Cut at the near plane.
    vec3 a = line.from;
    vec3 b = line.to;
    float da = dot(a, view.forward) - view.near;
    float db = dot(b, view.forward) - view.near;
    if (da < 0.0 && db > 0.0) a = mix(a, b, -da / (db - da) * 1.001);
    if (db < 0.0 && da > 0.0) b = mix(b, a, -db / (da - db) * 1.001);
    vec4 ca = view.clip_from_eye * vec4(a, 1.0);
    vec4 cb = view.clip_from_eye * vec4(b, 1.0);
    vec2 half_size = view.size * 0.5;
    vec2 d = (cb.xy / cb.w - ca.xy / ca.w) * half_size;
    float size = length(d);
    d = size > 1e-6 ? d / size : vec2(1.0, 0.0);
    float half_width = push.width * 0.5 + 0.5;
    vec4 c = end ? cb : ca;
    c.xy += vec2(-d.y, d.x) * (side * half_width) / half_size * c.w;
    // A hair in front of what it is drawn on.
    c.z *= 1.002;
    gl_Position = c;
    vec4 srgb = unpackUnorm4x8(line.color);
    out_color = vec4(srgb_decode(srgb.rgb), srgb.a);
    out_edge = side * half_width;
}
