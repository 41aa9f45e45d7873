#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Some invocations a part: its triangles. Those of a veil are drawn twice, first what faces away, then what
// faces the eye; the others of each time are points.

#include "fibre.glsl"
#include "mesh.glsl"
#include "mesh_texels.glsl"

layout(local_size_x = PART_THREADS * GROUP_PARTS) in;

layout(set = 0, binding = 1) uniform usamplerBuffer instances;
layout(set = 0, binding = 2) uniform usamplerBuffer levels;
layout(set = 0, binding = 3) uniform usamplerBuffer mesh_indices;
layout(set = 0, binding = 4) uniform usamplerBuffer vertices; // three texels each
layout(set = 0, binding = 5) uniform usamplerBuffer parts;
layout(set = 0, binding = 6, scalar) readonly buffer Order { uint order[]; };
layout(set = 0, binding = 7, scalar) readonly buffer Drawn { MeshDraws draw; };
layout(set = 0, binding = 8, scalar) writeonly buffer Indices { uint indices[]; };

layout(push_constant, scalar) uniform MeshIndexPush {
    uint groups_x;
    uint index_limit;
    uint first_instance; // texels
} push;

vec3 corner(uint vertex) {
    return floats_at(vertices, vertex * 3u).xyw;
}

void main() {
    uint group = gl_WorkGroupID.x + gl_WorkGroupID.y * push.groups_x;
    uint number = group * GROUP_PARTS + gl_LocalInvocationID.x / PART_THREADS;
    if (number >= draw.parts) return;
    uint index = order[number];
    Part part = part_at(parts, index);
    Instance instance = instance_at(instances, push.first_instance, index >> 1);
    // A veil is seen twice, and has its vertices once: where these did not fit, neither did it.
    Part owner = part_at(parts, 2u * instance.vertices_of + (index & 1u));
    bool gone = ((part.bin | owner.bin) & LEFT_OUT) != 0u;
    uint first_index = level_at(levels, part.level).first_index;
    uint base = owner.first_vertex - part.first_drawn;
    bool veil = part.bin == BIN_VEIL || part.bin == BIN_LIT_VEIL;
    bool far_side = (instance.flags & FAR_SIDE) != 0u;
    for (uint t = gl_LocalInvocationID.x % PART_THREADS; t < part.triangles; t += PART_THREADS) {
        uint from = first_index + t * 3u;
        uint a = base + word_at(mesh_indices, from);
        uint b = base + word_at(mesh_indices, from + 1u);
        uint c = base + word_at(mesh_indices, from + 2u);
        if (veil && !gone) {
            // The sign of the area in the picture, whose y goes down: negative where the triangle is
            // counter-clockwise.
            bool away = determinant(mat3(corner(a), corner(b), corner(c))) > 0.0;
            if (away != far_side) {
                b = a;
                c = a;
            }
        }
        uint at = part.first_index + t * 3u;
        if (gone) {
            a = 0u;
            b = 0u;
            c = 0u;
            if (at + 2u >= push.index_limit) break;
        }
        indices[at] = a;
        indices[at + 1u] = b;
        indices[at + 2u] = c;
    }
}
