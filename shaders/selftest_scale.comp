#version 460
#extension GL_EXT_scalar_block_layout : require
// Self-test: target[i] = source[i] * factor + offset, for the first `count` elements.

layout(local_size_x = 64) in;

layout(set = 0, binding = 0, scalar) readonly buffer Source { uint source[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer Target { uint target[]; };
layout(push_constant, scalar) uniform ScalePush { uint count; uint factor; uint offset; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < count) {
        target[i] = source[i] * factor + offset;
    }
}
