#version 460
#extension GL_GOOGLE_include_directive : require
// The compute passes did the work: clip positions come ready.

#include "fibre.glsl"

layout(location = 0) in vec4 position;
layout(location = 1) in vec4 normal;
layout(location = 2) in vec4 place_u;
layout(location = 3) in vec4 v_thickness_glow;
layout(location = 4) in vec4 color;
layout(location = 5) in uint part;

layout(location = 0) out vec3 out_normal;
layout(location = 1) out vec4 out_place_u;
layout(location = 2) out vec3 out_v_thickness_glow;
layout(location = 3) out vec4 out_color;
layout(location = 4) flat out uint out_part;
layout(location = 5) noperspective out vec2 out_across;

void main() {
    gl_Position = position;
    out_normal = normal.xyz;
    out_place_u = place_u;
    out_v_thickness_glow = v_thickness_glow.xyz;
    out_color = color;
    out_part = part;
    float half_px = v_thickness_glow.w;
    out_across = vec2(normal.w * (abs(half_px) + EDGE), half_px);
}
