#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Some invocations a part: its vertices in clip space, moved by joints or made anew.

#include "view.glsl"
#include "fibre.glsl"
#include "mesh.glsl"
#include "mesh_texels.glsl"

layout(local_size_x = PART_THREADS * GROUP_PARTS) in;

/// A vertex that is made anew: reef_draw_vertex.
struct DrawVertex {
    vec3 position; // [m]
    uint normal;
    float thickness; // [m]
};

layout(set = 0, binding = 1) uniform usamplerBuffer instances;
layout(set = 0, binding = 4) uniform usamplerBuffer rest_vertices;
layout(set = 0, binding = 5) uniform usamplerBuffer bones;
layout(set = 0, binding = 6) uniform usamplerBuffer palette;
layout(set = 0, binding = 7, scalar) readonly buffer Previous { DrawVertex previous_vertices[]; };
layout(set = 0, binding = 8, scalar) readonly buffer Current { DrawVertex current_vertices[]; };
layout(set = 0, binding = 9) uniform usamplerBuffer parts;
layout(set = 0, binding = 10, scalar) readonly buffer Order { uint order[]; };
layout(set = 0, binding = 11, scalar) readonly buffer Drawn { MeshDraws draw; };
layout(set = 0, binding = 12, rgba32ui) writeonly uniform uimageBuffer vertices; // three texels each
layout(set = 0, binding = 13) uniform usamplerBuffer rest_rows;

layout(push_constant, scalar) uniform MeshSkinPush {
    uint groups_x;
    uint first_instance; // texels
} push;

/// Where a vertex is, and what its surface does there.
struct Moved {
    vec3 p;
    vec3 n; // not of unit length
    float thickness;
    // How it was turned: by a unit quaternion, the first, or by a matrix of these rows.
    vec4 rows[3];
    bool dual;
    float scale;
};

Moved skinned(Part part, uint number, RestVertex rest) {
    vec3 v = rest.position;
    vec3 n = unpacked_normal(rest.normal);
    bool dual = (part.how & HOW_DUAL) != 0u;
    bool rigid = (part.how & HOW_RIGID) != 0u;
    uint influences = part.how & 0xffu;
    uint first = part.first_bone + number * (part.how >> 8 & 0xffu);
    vec4 rows[3];
    rows[0] = vec4(0.0);
    rows[1] = vec4(0.0);
    rows[2] = vec4(0.0);
    float sum = 0.0;
    vec4 side = vec4(0.0);
    uint end = first + (rigid ? 1u : influences);
    // Four bones are a texel, which is fetched once.
    for (uint texel = end == first ? end : first >> 2; 4u * texel < end; texel++) {
        uvec4 four = rigid ? uvec4(0xffff0000u) : texel_at(bones, texel);
        uint last = min(end, 4u * texel + 4u);
        for (uint i = max(first, 4u * texel); i < last; i++) {
            uint bone = four[i & 3u];
            float weight = float(bone >> 16) / 65535.0;
            uint at = (part.palette + (bone & 0xffffu)) * 3u;
            vec4 a = floats_at(palette, at);
            // A rotation and its negative are the same: all are summed on the side of the first.
            side = i == first ? a : side;
            float flip = dual && dot(side, a) < 0.0 ? -weight : weight;
            rows[0] += a * flip;
            rows[1] += floats_at(palette, at + 1u) * flip;
            rows[2] += floats_at(palette, at + 2u) * weight;
            sum += weight;
        }
    }
    Moved m;
    m.thickness = rest.thickness * part.scale;
    if (dual) {
        float unit = inversesqrt(max(dot(rows[0], rows[0]), 1e-20));
        vec4 q = rows[0] * unit;
        vec4 d = rows[1] * unit;
        vec3 shift = 2.0 * (q.w * d.xyz - d.w * q.xyz + cross(q.xyz, d.xyz));
        m.p = turned(q, v * (rows[2].x / sum)) + shift;
        m.n = turned(q, n);
        m.scale = rows[2].x / sum;
        rows[0] = q;
    } else {
        vec4 whole = vec4(v, 1.0);
        m.p = vec3(dot(rows[0], whole), dot(rows[1], whole), dot(rows[2], whole)) / sum;
        m.n = vec3(dot(rows[0].xyz, n), dot(rows[1].xyz, n), dot(rows[2].xyz, n));
        m.scale = 1.0 / sum;
    }
    m.rows = rows;
    m.dual = dual;
    return m;
}

vec3 turned_by(Moved m, vec3 way) {
    vec3 by_rows = vec3(dot(m.rows[0].xyz, way), dot(m.rows[1].xyz, way), dot(m.rows[2].xyz, way));
    return m.dual ? turned(m.rows[0], way) : by_rows;
}

/// Moves a vertex at `p` in eye space so far from its row's middle that there is room for an edge that fades
/// over twice `edge` [px]. Returns where it is then, as a share of the way to the edge, and half the true
/// width [px].
vec2 widened(inout vec3 p, Moved m, RestRow row, float edge) {
    vec3 axis = normalize(turned_by(m, row.axis));
    vec3 wide = turned_by(m, row.wide);
    // A matrix may stretch, too.
    float size_of_wide = length(wide);
    wide *= 1.0 / size_of_wide;
    float scale = m.scale * size_of_wide;
    vec3 side = cross(axis, -p);
    float size = dot(side, side);
    // Along the line of sight no way is across; without a row nothing is moved.
    bool has = size > 1e-16 && row.extent.x > 0.0;
    side *= inversesqrt(max(size, 1e-16));
    vec3 deep = cross(axis, wide);
    deep *= inversesqrt(max(dot(deep, deep), 1e-16));
    vec2 ways = vec2(dot(wide, side), dot(deep, side));
    vec2 ahead = row.extent * ways;
    float half_width = max(length(ahead), 1e-5) * scale;
    float off = dot(row.place, ways) * row.extent.x * scale;
    float share = clamp(off / half_width, -1.0, 1.0);
    float pixel = pixel_at(p);
    p += has ? side * (share * (half_width + edge * pixel) - off) : vec3(0.0);
    float half_px = min(half_width / pixel, NO_ROW);
    return has ? vec2(share, row.extent.y < 0.0 ? -half_px : half_px) : vec2(0.0, NO_ROW);
}

Moved made_anew(Instance instance, uint vertex) {
    DrawVertex b = current_vertices[instance.current + vertex];
    DrawVertex a = b;
    if (instance.blend < 1.0) a = previous_vertices[instance.previous + vertex];
    Moved m;
    m.p = mix(a.position, b.position, instance.blend);
    m.n = mix(unpacked_normal(a.normal), unpacked_normal(b.normal), instance.blend);
    m.thickness = mix(a.thickness, b.thickness, instance.blend);
    m.rows = vec4[3](vec4(0.0), vec4(0.0), vec4(0.0));
    m.dual = false;
    m.scale = 1.0;
    return m;
}

void main() {
    uint group = gl_WorkGroupID.x + gl_WorkGroupID.y * push.groups_x;
    uint number = group * GROUP_PARTS + gl_LocalInvocationID.x / PART_THREADS;
    if (number >= draw.parts) return;
    uint index = order[number];
    Part part = part_at(parts, index);
    if ((part.bin & LEFT_OUT) != 0u) return;
    bool anew = (part.how & HOW_ANEW) != 0u;
    for (uint i = gl_LocalInvocationID.x % PART_THREADS; i < part.vertices; i += PART_THREADS) {
        RestVertex rest = rest_vertex_at(rest_vertices, part.first_rest + i);
        Moved m = skinned(part, i, rest);
        // A software rasteriser leaves out a loop that no invocation enters, and a branch never.
        for (uint once = anew ? 0u : 1u; once < 1u; once++) {
            m = made_anew(instance_at(instances, push.first_instance, index >> 1), part.first_drawn + i);
        }
        vec3 p = part.base + m.p;
        vec3 n = m.n * inversesqrt(max(dot(m.n, m.n), 1e-20));
        vec2 across = vec2(0.0, NO_ROW);
        for (uint once = part.bin < BIN_THIN ? 1u : 0u; once < 1u; once++) {
            RestRow row = rest_row_at(rest_rows, part.first_rest + i);
            across = widened(p, m, row, part.bin == BIN_LIT_THIN ? LIT_EDGE : EDGE);
        }
        vec4 clip = view.clip_from_eye * vec4(p, 1.0);
        vec2 uv = unpackHalf2x16(rest.uv);
        int at = int((part.first_vertex + i) * 3u);
        uvec4 shape = uvec4(packSnorm2x16(n.xy), packSnorm2x16(vec2(n.z, across.x)),
            packHalf2x16(rest.position.xy), packHalf2x16(vec2(rest.position.z, uv.x)));
        uvec2 tissue = uvec2(packHalf2x16(vec2(uv.y, min(m.thickness * 100.0, 1000.0))), packHalf2x16(vec2(rest.glow, across.y)));
        imageStore(vertices, at, floatBitsToUint(clip));
        imageStore(vertices, at + 1, shape);
        imageStore(vertices, at + 2, uvec4(tissue, rest.color, index));
    }
}
