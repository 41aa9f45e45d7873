#version 460
// The compute passes did the work: clip positions come ready.

layout(location = 0) in vec4 position;
layout(location = 1) in vec4 normal_along;
layout(location = 2) in vec2 circle;
layout(location = 3) in vec2 radius_coverage;
layout(location = 4) in uvec3 look;

layout(location = 0) out vec4 out_normal_along;
layout(location = 1) out vec4 out_circle_radius_coverage;
layout(location = 2) flat out uvec3 out_look;

void main() {
    gl_Position = position;
    out_normal_along = normal_along;
    out_circle_radius_coverage = vec4(circle, radius_coverage);
    out_look = look;
}
