#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// One workgroup: where each part's vertices and indices begin (an exclusive prefix sum in the parts' order,
// so that every run packs them the same way), and a draw for each bin.

#include "fibre.glsl"
#include "mesh.glsl"

#define THREADS 256

layout(local_size_x = THREADS) in;

layout(set = 0, binding = 2, scalar) buffer Parts { Part parts[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer Drawn { MeshDraws draw; };
layout(set = 0, binding = 4, scalar) writeonly buffer Order { uint order[]; }; // parts that are drawn

layout(push_constant, scalar) uniform MeshScanPush {
    uint part_count;
    uint vertex_limit;
    uint index_limit;
    uint groups_x;     // workgroups along x at most
} push;

/// What some parts need.
struct Needs {
    uint lit;          // vertices of what is lit at its vertices: these come first
    uint others;
    uint parts;
    uint left_out;
    uint indices[BINS];
};

shared Needs needs[THREADS];
shared Needs totals;

// A sum that stays at the greatest number, which fits nowhere.
uint plus(uint a, uint b) {
    uint sum = a + b;
    return sum < a ? 0xffffffffu : sum;
}

Needs nothing() {
    Needs n;
    n.lit = 0u;
    n.others = 0u;
    n.parts = 0u;
    n.left_out = 0u;
    for (uint b = 0u; b < BINS; b++) n.indices[b] = 0u;
    return n;
}

void main() {
    uint thread = gl_LocalInvocationID.x;
    uint chunk = (push.part_count + uint(THREADS) - 1u) / uint(THREADS);
    uint from = min(thread * chunk, push.part_count);
    uint to = min(from + chunk, push.part_count);
    Needs own = nothing();
    for (uint i = from; i < to; i++) {
        if (parts[i].level == NOT_DRAWN) continue;
        own.parts++;
        uint bin = parts[i].bin;
        own.lit = plus(own.lit, is_lit(bin) ? parts[i].vertices : 0u);
        own.others = plus(own.others, is_lit(bin) ? 0u : parts[i].vertices);
        own.indices[bin] = plus(own.indices[bin], parts[i].triangles * 3u);
    }
    needs[thread] = own;
    barrier();
    // What comes before each thread's own: one thread adds it up, which is less than all adding up their own.
    if (thread == 0u) {
        Needs before = nothing();
        for (uint t = 0u; t < uint(THREADS); t++) {
            Needs of = needs[t];
            needs[t] = before;
            before.lit = plus(before.lit, of.lit);
            before.others = plus(before.others, of.others);
            before.parts += of.parts;
            for (uint b = 0u; b < BINS; b++) before.indices[b] = plus(before.indices[b], of.indices[b]);
        }
        totals = before;
    }
    barrier();
    Needs at = needs[thread];
    // One bin after the other.
    uint first[BINS];
    uint sum = 0u;
    for (uint b = 0u; b < BINS; b++) {
        first[b] = sum;
        at.indices[b] = plus(at.indices[b], sum);
        sum = plus(sum, totals.indices[b]);
    }
    // A part that does not fit keeps its place, in which nothing shows.
    uint left_out = 0u;
    uint fit_vertices = 0u;
    uint fit_lit = 0u;
    at.others = plus(at.others, totals.lit);
    for (uint i = from; i < to; i++) {
        if (parts[i].level == NOT_DRAWN) continue;
        uint bin = parts[i].bin;
        bool lit = is_lit(bin);
        uint vertices = parts[i].vertices;
        uint first_vertex = lit ? at.lit : at.others;
        uint end = plus(first_vertex, vertices);
        uint indices = parts[i].triangles * 3u;
        // What is thin is drawn from far to near: the other way round than all parts.
        uint behind = 2u * first[bin] + totals.indices[bin] - at.indices[bin] - indices;
        uint first_index = bin >= BIN_THIN ? behind : at.indices[bin];
        bool fits = end <= push.vertex_limit
            && plus(first_index, indices) <= push.index_limit;
        parts[i].first_vertex = first_vertex;
        parts[i].first_index = first_index;
        parts[i].bin = fits ? bin : bin | LEFT_OUT;
        order[at.parts] = i;
        left_out += fits ? 0u : 1u;
        fit_vertices = fits ? max(fit_vertices, end) : fit_vertices;
        fit_lit = fits && lit ? max(fit_lit, end) : fit_lit;
        at.parts++;
        at.lit = lit ? end : at.lit;
        at.others = lit ? at.others : end;
        at.indices[bin] = plus(at.indices[bin], indices);
    }
    barrier();
    own.left_out = left_out;
    own.others = fit_vertices;
    own.lit = fit_lit;
    needs[thread] = own;
    barrier();
    if (thread == 0u) {
        uint drawn = 0u;
        uint vertices = 0u;
        uint lit = 0u;
        uint left = 0u;
        for (uint t = 0u; t < uint(THREADS); t++) {
            drawn += needs[t].parts;
            left += needs[t].left_out;
            vertices = max(vertices, needs[t].others);
            lit = max(lit, needs[t].lit);
        }
        for (uint b = 0u; b < BINS; b++) {
            uint end = min(plus(first[b], totals.indices[b]), push.index_limit);
            draw.commands[b] = IndexedDraw(end - min(first[b], end), 1u, first[b], 0, 0u);
        }
        uint groups = (drawn + GROUP_PARTS - 1u) / GROUP_PARTS;
        draw.groups = Groups(min(groups, push.groups_x), (groups + push.groups_x - 1u) / push.groups_x, 1u);
        draw.light_groups = Groups((lit + LIGHT_THREADS - 1u) / LIGHT_THREADS, 1u, 1u);
        draw.parts = drawn;
        draw.vertices = vertices;
        draw.lit = lit;
        draw.triangles = sum / 3u;
        draw.drawn = drawn - left;
        draw.left_out = left;
    }
}
