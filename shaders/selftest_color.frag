#version 460
// Self-test: one colour.

layout(location = 0) in vec2 place;
layout(location = 0) out vec4 color;
layout(push_constant, std430) uniform Constants { vec4 wanted; };

void main() {
    color = wanted;
}
