#version 460
#extension GL_GOOGLE_include_directive : require
// One invocation a vertex: the light of those that are not lit pixel by pixel. Low quality's alone.

#include "view.glsl"
#include "fibre.glsl"
#include "mesh.glsl"
#include "water.glsl"
#include "caustics.glsl"
#include "hash.glsl"
#include "light.glsl"
#include "tissue.glsl"
#include "shown.glsl"
#include "mesh_light.glsl"

layout(local_size_x = LIGHT_THREADS) in;

layout(set = 0, binding = 1, std430) readonly buffer Instances { Instance instances[]; };
layout(set = 0, binding = 2, std430) readonly buffer Meshes { Mesh meshes[]; };
layout(set = 0, binding = 3, std430) readonly buffer Parts { Part parts[]; };
layout(set = 0, binding = 4, std430) readonly buffer Materials { Material materials[]; };
layout(set = 0, binding = 5, std430) readonly buffer Draw { MeshDraws draw; };
layout(set = 0, binding = 6, std430) buffer Vertices { uint vertices[]; };

#define VERTEX_WORDS 12u

void main() {
    uint vertex = gl_GlobalInvocationID.x;
    uint at = vertex * VERTEX_WORDS;
    bool there = vertex < draw.counts.x;
    uint index = there ? vertices[at + 11u] : 0u;
    Part part = parts[index];
    bool veil = part.bin == BIN_LIT_VEIL;
    bool lit = there && (part.bin < BIN_PIXEL || veil);
    // A software rasteriser leaves out a loop that no invocation enters, and a branch never.
    for (uint once = lit ? 0u : 1u; once < 1u; once++) {
        Instance instance = instances[index >> 1];
        // Back from clip space.
        vec2 side = vec2(uintBitsToFloat(vertices[at]), uintBitsToFloat(vertices[at + 1u]));
        float ahead = uintBitsToFloat(vertices[at + 3u]);
        vec3 p = view.forward.xyz * ahead + view.right.xyz * (side.x * view.right.w) - view.up.xyz * (side.y * view.up.w);
        vec3 n = vec3(unpackSnorm2x16(vertices[at + 4u]), unpackSnorm2x16(vertices[at + 5u]).x);
        float facing = -dot(n, p);
        bool both = veil || (meshes[instance.mesh].flags & MESH_TWO_SIDED) != 0u;
        Skin s;
        s.normal = both && facing < 0.0 ? -n : n;
        vec2 z_u = unpackHalf2x16(vertices[at + 7u]);
        vec2 v_thickness = unpackHalf2x16(vertices[at + 8u]);
        s.place = vec3(unpackHalf2x16(vertices[at + 6u]), z_u.x);
        s.uv = vec2(z_u.y, v_thickness.x);
        s.thickness_cm = v_thickness.y;
        s.glow = unpackHalf2x16(vertices[at + 9u]).x;
        s.color = unpackUnorm4x8(vertices[at + 10u]);
        s.color.rgb *= s.color.rgb;
        s.texture_color = vec4(0.0);
        Material m = materials[instance.material];
        vec3 light = mesh_light(m, instance, s, p);
        float alpha = veil ? veil_alpha(m, s, facing, p) : 1.0;
        vertices[at + 4u] = packUnorm4x8(vec4(shown(through_water(light, p)), alpha));
        vertices[at + 5u] = part.shares;
    }
}
