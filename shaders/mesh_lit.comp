#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// One invocation a vertex: the light of those that are not lit pixel by pixel. Low quality's alone.

#include "view.glsl"
#include "fibre.glsl"
#include "mesh.glsl"
#include "mesh_texels.glsl"
#include "water.glsl"
#include "caustics.glsl"
#include "hash.glsl"
#include "light.glsl"
#include "tissue.glsl"
#include "shown.glsl"
#include "mesh_light.glsl"

layout(local_size_x = LIGHT_THREADS) in;

layout(set = 0, binding = 1) uniform usamplerBuffer instances;
layout(set = 0, binding = 2) uniform usamplerBuffer parts;
layout(set = 0, binding = 3) uniform usamplerBuffer materials;
layout(set = 0, binding = 4, scalar) readonly buffer Drawn { MeshDraws draw; };
layout(set = 0, binding = 5, rgba32ui) uniform uimageBuffer vertices; // three texels each

layout(push_constant, scalar) uniform MeshLightPush {
    uint first_instance; // texels
} push;

Material material_at(uint index) {
    uint at = 8u * index;
    uvec4 d = texel_at(materials, at + 3u);
    uvec4 e = texel_at(materials, at + 4u);
    vec2 scale_soft = uintBitsToFloat(d.zw);
    vec4 light = uintBitsToFloat(e);
    vec4 mirror = floats_at(materials, at + 5u);
    return Material(floats_at(materials, at), floats_at(materials, at + 1u), floats_at(materials, at + 2u), d.x, d.y,
        scale_soft.x, scale_soft.y, light.x, light.y, light.z, light.w, mirror.x, mirror.y, float[10](0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0));
}

void main() {
    uint vertex = gl_GlobalInvocationID.x;
    int at = int(vertex * 3u);
    bool there = vertex < draw.lit;
    uvec4 tissue = there ? imageLoad(vertices, at + 2) : uvec4(0u);
    uint index = tissue.w;
    Part part = part_at(parts, index);
    bool veil = part.bin == BIN_LIT_VEIL;
    bool thin = part.bin == BIN_LIT_THIN;
    bool lit = there && is_lit(part.bin);
    // A software rasteriser leaves out a loop that no invocation enters, and a branch never.
    for (uint once = lit ? 0u : 1u; once < 1u; once++) {
        Instance instance = instance_at(instances, push.first_instance, index >> 1);
        // Back from clip space.
        vec4 clip = uintBitsToFloat(imageLoad(vertices, at));
        uvec4 shape = imageLoad(vertices, at + 1);
        vec2 side = clip.xy;
        float ahead = clip.w;
        vec3 p = view.forward * ahead + view.right * (side.x * view.tangent_x) - view.up * (side.y * view.tangent_y);
        vec3 n = vec3(unpackSnorm2x16(shape.x), unpackSnorm2x16(shape.y).x);
        float facing = -dot(n, p);
        bool both = veil || thin || part.bin == BIN_LIT + 1u;
        Skin s;
        s.normal = both && facing < 0.0 ? -n : n;
        vec2 z_u = unpackHalf2x16(shape.w);
        vec2 v_thickness = unpackHalf2x16(tissue.x);
        s.place = vec3(unpackHalf2x16(shape.z), z_u.x);
        s.uv = vec2(z_u.y, v_thickness.x);
        s.thickness_cm = v_thickness.y;
        s.glow = unpackHalf2x16(tissue.y).x;
        s.color = unpackUnorm4x8(tissue.z);
        s.color.rgb *= s.color.rgb;
        s.texture_color = vec4(0.0);
        Material m = material_at(instance.material);
        vec3 light = mesh_light(m, instance, s, p);
        float alpha = veil ? veil_alpha(m, s, facing, p) : 1.0;
        uint color = packUnorm4x8(vec4(shown(through_water(light, p)), alpha));
        float share = unpackSnorm2x16(shape.y).y;
        float half_px = unpackHalf2x16(tissue.y).y;
        uint across = packHalf2x16(vec2(share * (abs(half_px) + LIT_EDGE), half_px));
        imageStore(vertices, at + 1, uvec4(color, part.shares, across, 0u));
    }
}
