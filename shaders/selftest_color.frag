#version 460
#extension GL_EXT_scalar_block_layout : require
// Self-test: one colour.

layout(location = 0) in vec2 place;
layout(location = 0) out vec4 color;
layout(push_constant, scalar) uniform ColorPush { vec4 wanted; };

void main() {
    color = wanted;
}
