#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// One invocation an instance: its joints between two steps against their places at rest, whether it is seen,
// and at which levels of detail.

#include "view.glsl"
#include "fibre.glsl"
#include "mesh.glsl"
#include "mesh_texels.glsl"

layout(local_size_x = 32) in;

layout(set = 0, binding = 1) uniform usamplerBuffer instances;
layout(set = 0, binding = 2) uniform usamplerBuffer objects;
layout(set = 0, binding = 3) uniform usamplerBuffer previous_joints;
layout(set = 0, binding = 4) uniform usamplerBuffer current_joints;
layout(set = 0, binding = 5) uniform usamplerBuffer meshes;
layout(set = 0, binding = 6) uniform usamplerBuffer levels;
layout(set = 0, binding = 7) uniform usamplerBuffer rests;
layout(set = 0, binding = 8, rgba32ui) writeonly uniform uimageBuffer parts;
// Three texels a joint. Linear: rows of a matrix. Dual: rotation, dual part, scale.
layout(set = 0, binding = 9, rgba32ui) writeonly uniform uimageBuffer palette;

layout(push_constant, scalar) uniform MeshPosePush {
    uint count;
    uint use_lod;
    float error;   // a coarser level is chosen where it errs by less than this [px]; negative: never
    float lit;     // what is smaller than this is lit at its vertices [px]
    uint first_instance; // texels
    uint first_object;
} push;

void put(uint at, vec4 texel) {
    imageStore(palette, int(at), floatBitsToUint(texel));
}

void put_part(uint index, Part part) {
    int at = int(4u * index);
    imageStore(parts, at, uvec4(part.level, part.bin, part.first_vertex, part.first_index));
    imageStore(parts, at + 1, uvec4(floatBitsToUint(part.base), part.shares));
    imageStore(parts, at + 2, uvec4(part.first_rest, part.first_bone, part.vertices, part.triangles));
    imageStore(parts, at + 3, uvec4(part.how, part.palette, floatBitsToUint(part.scale), part.first_drawn));
}

/// The part with what is read of its level. `own`: its vertices are no other instance's.
Part of_level(Part part, Mesh mesh, Level level, bool own) {
    part.first_rest = mesh.first_vertex + level.first_vertex;
    part.first_bone = mesh.first_bone + level.first_vertex * mesh.influences;
    part.vertices = own ? level.vertices : 0u;
    part.triangles = level.triangles;
    part.first_drawn = level.first_vertex;
    part.how |= (part.how & HOW_ANEW) != 0u ? 0u : level.influences;
    return part;
}

/// Whether a sphere is surely outside of the picture.
bool culled(vec3 center, float radius) {
    vec3 c = vec3(dot(center, view.right), dot(center, view.up), dot(center, view.forward));
    vec2 tangent = vec2(view.tangent_x, view.tangent_y);
    vec2 side = sqrt(1.0 + tangent * tangent) * radius;
    return c.z < -radius + view.near || abs(c.x) > c.z * tangent.x + side.x
        || abs(c.y) > c.z * tangent.y + side.y || c.z - radius > view.far;
}

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= push.count) return;
    Instance instance = instance_at(instances, push.first_instance, index);
    Mesh mesh = mesh_at(meshes, instance.mesh);
    Object object = object_at(objects, push.first_object, instance.object);
    vec3 base = mix(object.previous, object.current, instance.blend);
    bool anew = (instance.flags & DRAWN_ANEW) != 0u;
    bool rigid = (instance.flags & RIGID) != 0u;
    bool dual = (mesh.flags & MESH_DUAL) != 0u;

    vec3 low = vec3(1e30);
    vec3 high = vec3(-1e30);
    float stretch = anew ? 1.0 : 0.0;
    for (uint j = 0u; j < instance.joints; j++) {
        Joint b = joint_at(current_joints, instance.current + j);
        Joint a = b;
        if (instance.blend < 1.0) a = joint_at(previous_joints, instance.previous + j);
        // Along the shorter arc.
        vec4 other = dot(a.rotation, b.rotation) < 0.0 ? -b.rotation : b.rotation;
        vec4 q = mix(a.rotation, other, instance.blend);
        q *= inversesqrt(max(dot(q, q), 1e-20));
        vec3 place = mix(a.translation, b.translation, instance.blend);
        float size = mix(a.scale, b.scale, instance.blend);

        Rest rest = rest_at(rests, mesh.first_rest + (rigid ? 0u : j));
        vec4 rest_turn = rigid ? vec4(0.0, 0.0, 0.0, 1.0) : rest.rotation;
        vec3 rest_place = rigid ? vec3(0.0) : rest.translation;
        float rest_size = rigid ? 1.0 : rest.scale;
        vec4 turn = after(q, vec4(-rest_turn.xyz, rest_turn.w));
        float scale = size / rest_size * instance.scale;
        vec3 shift = place - scale * turned(turn, rest_place);
        float reach = (rigid ? mesh.radius : rest.reach) * scale;
        vec3 middle = rigid ? scale * turned(turn, mesh.center) + shift : place;
        low = min(low, middle - reach);
        high = max(high, middle + reach);
        stretch = max(stretch, scale);

        uint at = (instance.palette + j) * 3u;
        vec3 x = scale * turned(turn, vec3(1.0, 0.0, 0.0));
        vec3 y = scale * turned(turn, vec3(0.0, 1.0, 0.0));
        vec3 z = scale * turned(turn, vec3(0.0, 0.0, 1.0));
        vec4 half_dual = 0.5 * after(vec4(shift, 0.0), turn);
        put(at, dual ? turn : vec4(x.x, y.x, z.x, shift.x));
        put(at + 1u, dual ? half_dual : vec4(x.y, y.y, z.y, shift.y));
        put(at + 2u, dual ? vec4(scale, 0.0, 0.0, 0.0) : vec4(x.z, y.z, z.z, shift.z));
    }
    // A box around the joints' spheres; what is blended as dual quaternions may bulge a little.
    vec3 middle = anew ? instance.center : 0.5 * (low + high);
    float radius = anew ? instance.radius : 0.5 * length(high - low) * (dual ? 1.1 : 1.0);
    vec3 center = base + middle;

    Part part;
    part.level = NOT_DRAWN;
    part.bin = 0u;
    part.first_vertex = 0u;
    part.first_index = 0u;
    part.base = base;
    part.shares = 0u;
    part.first_rest = 0u;
    part.first_bone = 0u;
    part.vertices = 0u;
    part.triangles = 0u;
    part.how = mesh.influences << 8 | (dual ? HOW_DUAL : 0u) | (rigid ? HOW_RIGID : 0u) | (anew ? HOW_ANEW : 0u);
    part.palette = instance.palette;
    part.scale = instance.scale;
    part.first_drawn = 0u;
    Part other = part;
    bool outside = culled(center, radius);
    bool seen = instance.fade < 1.0 && (uint(outside) & push.use_lod) == 0u;

    float nearest = max(dot(center, view.forward) - radius, view.near);
    float pixels = view.pixels_per_metre / nearest;
    uint chosen = 0u;
    for (uint l = 1u; l < mesh.level_count; l++) {
        bool fits = level_at(levels, mesh.first_level + l).error * stretch * pixels <= push.error;
        chosen = fits ? l : chosen;
    }
    uint next = min(chosen + 1u, mesh.level_count - 1u);
    Level fine = level_at(levels, mesh.first_level + chosen);
    Level coarse = level_at(levels, mesh.first_level + next);
    float error = coarse.error * stretch * pixels;
    bool own = instance.vertices_of == index;
    float coarser = clamp((BAND * push.error - error) / ((BAND - 1.0) * push.error), 0.0, 1.0) * float(push.use_lod);
    coarser = next != chosen ? coarser : 0.0;
    float there = 1.0 - instance.fade;

    bool veil = (instance.flags & VEIL) != 0u;
    float most = (instance.flags & SMOOTH) != 0u ? SMOOTH_LIT * push.lit : push.lit;
    bool lit = 2.0 * radius * pixels < most && (instance.flags & PLAIN) != 0u;
    uint bin = lit ? BIN_LIT : BIN_PIXEL;
    bin += (mesh.flags & MESH_TWO_SIDED) != 0u ? 1u : 0u;
    uint veil_bin = (instance.flags & LIT_VEIL) != 0u ? BIN_LIT_VEIL : BIN_VEIL;
    part.bin = veil ? veil_bin : bin;
    other.bin = part.bin;
    // Blades that are thinner than some pixels.
    bool leaf = !veil && !anew && (mesh.flags & MESH_TWO_SIDED) != 0u;
    vec2 slim = vec2(fine.slim, coarse.slim);
    bvec2 thin = lessThan(slim * (stretch * pixels), vec2(THIN_HALF));
    uint thin_bin = lit ? BIN_LIT_THIN : BIN_THIN;
    part.bin = leaf && thin.x ? thin_bin : part.bin;
    other.bin = leaf && thin.y ? thin_bin : other.bin;
    part.level = seen ? mesh.first_level + chosen : NOT_DRAWN;
    other.level = seen && coarser > 0.0 ? mesh.first_level + next : NOT_DRAWN;
    part.shares = packUnorm2x16(vec2(coarser, 1.0) * there);
    other.shares = packUnorm2x16(vec2(0.0, coarser) * there);
    put_part(2u * index, of_level(part, mesh, fine, own));
    put_part(2u * index + 1u, of_level(other, mesh, coarse, own));
}
