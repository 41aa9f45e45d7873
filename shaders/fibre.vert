#version 460
// The compute passes did the work: clip positions come ready.

layout(location = 0) in vec4 position;
layout(location = 1) in vec4 normal_along;
layout(location = 2) in vec2 circle;
layout(location = 3) in vec2 radius_half;
layout(location = 4) in uvec3 look;
layout(location = 5) in float edge;

layout(location = 0) out vec4 out_normal_along;
layout(location = 1) out vec4 out_circle_radius_half;
layout(location = 2) flat out uvec3 out_look;
layout(location = 3) out float out_edge;

void main() {
    gl_Position = position;
    out_normal_along = normal_along;
    out_circle_radius_half = vec4(circle, radius_half);
    out_look = look;
    out_edge = edge;
}
