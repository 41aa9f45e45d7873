#version 460
#extension GL_GOOGLE_include_directive : require
// One workgroup a part: its triangles. Those of a veil are drawn twice, first what faces away, then what
// faces the eye; the others of each time are points.

#include "fibre.glsl"
#include "mesh.glsl"

layout(local_size_x = SKIN_THREADS) in;

layout(set = 0, binding = 1, std430) readonly buffer Instances { Instance instances[]; };
layout(set = 0, binding = 2, std430) readonly buffer Levels { Level levels[]; };
layout(set = 0, binding = 3, std430) readonly buffer MeshIndices { uint mesh_indices[]; };
layout(set = 0, binding = 4, std430) readonly buffer Vertices { uint vertices[]; };
layout(set = 0, binding = 5, std430) readonly buffer Parts { Part parts[]; };
layout(set = 0, binding = 6, std430) readonly buffer Order { uint order[]; };
layout(set = 0, binding = 7, std430) readonly buffer Draw { MeshDraws draw; };
layout(set = 0, binding = 8, std430) writeonly buffer Indices { uint indices[]; };

layout(push_constant) uniform Push {
    uint groups_x;
    uint index_limit;
} push;

#define VERTEX_WORDS 12u

vec3 corner(uint vertex) {
    uint at = vertex * VERTEX_WORDS;
    return vec3(uintBitsToFloat(vertices[at]), uintBitsToFloat(vertices[at + 1u]), uintBitsToFloat(vertices[at + 3u]));
}

void main() {
    uint number = gl_WorkGroupID.x + gl_WorkGroupID.y * push.groups_x;
    if (number >= draw.groups.w) return;
    uint index = order[number];
    Part part = parts[index];
    Instance instance = instances[index >> 1];
    // A veil is seen twice, and has its vertices once: where these did not fit, neither did it.
    Part owner = parts[2u * instance.vertices_of + (index & 1u)];
    bool gone = ((part.bin | owner.bin) & LEFT_OUT) != 0u;
    Level level = levels[part.level];
    uint base = owner.first_vertex - level.first_vertex;
    bool veil = part.bin == BIN_VEIL || part.bin == BIN_LIT_VEIL;
    bool far_side = (instance.flags & FAR_SIDE) != 0u;
    for (uint t = gl_LocalInvocationID.x; t < level.triangles; t += uint(SKIN_THREADS)) {
        uint from = level.first_index + t * 3u;
        uint a = base + mesh_indices[from];
        uint b = base + mesh_indices[from + 1u];
        uint c = base + mesh_indices[from + 2u];
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
