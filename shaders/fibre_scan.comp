#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// One workgroup: where each drawn fibre's vertices and indices begin (an exclusive prefix sum in the fibres'
// order, so that every run packs them the same way), and the draws that cover them all.

#include "fibre.glsl"

#define THREADS 128

layout(local_size_x = THREADS) in;

layout(set = 0, binding = 0, scalar) buffer Choices { Choice choices[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer Drawn { FibreDraws draw; };
layout(set = 0, binding = 2, scalar) writeonly buffer Tubes { uint tubes[]; }; // fibres that are tubes

layout(push_constant, scalar) uniform FibreScanPush {
    uint fibre_count;
    uint vertex_limit;
    uint index_limit;
    uint groups_x;       // workgroups along x at most
} push;

/// What some fibres need.
struct Needs {
    uint vertices;
    uint indices;
    uint flat_indices; // of ribbons
    uint tubes;
    uint solid;
    uint thin;
    uint ribbons;
};

shared Needs needs[THREADS];
shared uint left_out[THREADS];

void main() {
    uint thread = gl_LocalInvocationID.x;
    uint chunk = (push.fibre_count + uint(THREADS) - 1u) / uint(THREADS);
    uint from = min(thread * chunk, push.fibre_count);
    uint to = min(from + chunk, push.fibre_count);
    Needs own = Needs(0u, 0u, 0u, 0u, 0u, 0u, 0u);
    for (uint i = from; i < to; i++) {
        uint levels = choices[i].levels;
        if (levels == NOT_DRAWN) continue;
        uint rings = choices[i].rings;
        if ((levels & LIT_RIBBON) != 0u) {
            if ((levels & THIN) != 0u) own.thin += strip_count(rings);
            else own.solid += strip_count(rings);
            own.ribbons++;
        } else {
            uint sides = choices[i].sides;
            own.vertices += vertex_count(rings, sides);
            if (sides == 2u) own.flat_indices += index_count(rings, sides);
            else own.indices += index_count(rings, sides);
            own.tubes++;
        }
    }
    needs[thread] = own;
    barrier();
    // Thin strips come after all solid ones, and indices of ribbons after all others.
    uint flat_first = 0u;
    Needs at = Needs(0u, 0u, 0u, 0u, 0u, 0u, 0u);
    for (uint i = 0u; i < uint(THREADS); i++) {
        at.thin += needs[i].solid;
        flat_first += needs[i].indices;
        if (i >= thread) continue;
        at.vertices += needs[i].vertices;
        at.indices += needs[i].indices;
        at.flat_indices += needs[i].flat_indices;
        at.tubes += needs[i].tubes;
        at.solid += needs[i].solid;
        at.thin += needs[i].thin;
    }
    // There is room for all ribbons. Tubes that do not fit are left out, and so are all that come after them.
    own.vertices = 0u;
    own.indices = 0u;
    own.flat_indices = 0u;
    at.flat_indices += flat_first;
    uint left = own.tubes;
    own.tubes = 0u;
    for (uint i = from; i < to; i++) {
        uint levels = choices[i].levels;
        if (levels == NOT_DRAWN) continue;
        uint rings = choices[i].rings;
        if ((levels & LIT_RIBBON) != 0u) {
            bool thin = (levels & THIN) != 0u;
            uint strip = strip_count(rings);
            choices[i].first_vertex = thin ? at.thin : at.solid;
            if (thin) at.thin += strip;
            else at.solid += strip;
            continue;
        }
        uint sides = choices[i].sides;
        uint v = vertex_count(rings, sides);
        uint n = index_count(rings, sides);
        bool ribbon = sides == 2u;
        uint first = ribbon ? at.flat_indices : at.indices;
        if (at.vertices + v > push.vertex_limit || first + n > push.index_limit) {
            choices[i].levels = NOT_DRAWN;
        } else {
            choices[i].first_vertex = at.vertices;
            choices[i].first_index = first;
            tubes[at.tubes + own.tubes] = i;
            own.vertices += v;
            if (ribbon) own.flat_indices += n;
            else own.indices += n;
            own.tubes++;
            left--;
        }
        at.vertices += v;
        if (ribbon) at.flat_indices += n;
        else at.indices += n;
    }
    barrier();
    needs[thread] = own;
    left_out[thread] = left;
    barrier();
    if (thread == 0u) {
        Needs all = Needs(0u, 0u, 0u, 0u, 0u, 0u, 0u);
        uint all_left = 0u;
        for (uint i = 0u; i < uint(THREADS); i++) {
            all.vertices += needs[i].vertices;
            all.indices += needs[i].indices;
            all.flat_indices += needs[i].flat_indices;
            all.tubes += needs[i].tubes;
            all.solid += needs[i].solid;
            all.thin += needs[i].thin;
            all.ribbons += needs[i].ribbons;
            all_left += left_out[i];
        }
        draw.tubes = IndexedDraw(all.indices, 1u, 0u, 0, 0u);
        draw.flat_tubes = IndexedDraw(all.flat_indices, 1u, flat_first, 0, 0u);
        draw.solid = Draw(all.solid, 1u, 0u, 0u);
        draw.thin = Draw(all.thin, 1u, all.solid, 0u);
        draw.groups = Groups(min(all.tubes, push.groups_x), (all.tubes + push.groups_x - 1u) / push.groups_x, 1u);
        draw.tube_count = all.tubes;
        draw.vertices = all.vertices;
        draw.drawn = all.tubes + all.ribbons;
        draw.left_out = all_left;
    }
}
