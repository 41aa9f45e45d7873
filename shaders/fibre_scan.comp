#version 460
#extension GL_GOOGLE_include_directive : require
// One workgroup: where each drawn fibre's vertices and indices begin (an exclusive prefix sum in the fibres' order, so
// that every run packs them the same way), and the draw that covers them all.

#include "fibre.glsl"

#define THREADS 128

layout(local_size_x = THREADS) in;

layout(set = 0, binding = 0, std430) buffer Choices { Choice choices[]; };
layout(set = 0, binding = 1, std430) writeonly buffer Draw {
    uint index_total;
    uint instances;
    uint first_index;
    int vertex_offset;
    uint first_instance;
    uint vertices;
    uint drawn;       // fibres that are drawn
    uint left_out;    // fibres that did not fit
} draw;

layout(push_constant) uniform Push {
    uint fibre_count;
    uint vertex_limit;
    uint index_limit;
} push;

shared uint vertex_sum[THREADS];
shared uint index_sum[THREADS];
shared uint drawn_sum[THREADS];
shared uint left_sum[THREADS];
shared uint fitted_sum[THREADS];

void main() {
    uint thread = gl_LocalInvocationID.x;
    uint chunk = (push.fibre_count + uint(THREADS) - 1u) / uint(THREADS);
    uint from = min(thread * chunk, push.fibre_count);
    uint to = min(from + chunk, push.fibre_count);
    uint v = 0u;
    uint n = 0u;
    for (uint i = from; i < to; i++) {
        if (choices[i].levels == NOT_DRAWN) continue;
        v += vertex_count(choices[i].rings, choices[i].sides);
        n += index_count(choices[i].rings, choices[i].sides);
    }
    vertex_sum[thread] = v;
    index_sum[thread] = n;
    barrier();
    v = 0u;
    n = 0u;
    for (uint i = 0u; i < thread; i++) {
        v += vertex_sum[i];
        n += index_sum[i];
    }
    uint drawn = 0u;
    uint left = 0u;
    uint fitted = 0u;
    for (uint i = from; i < to; i++) {
        if (choices[i].levels == NOT_DRAWN) continue;
        uint dv = vertex_count(choices[i].rings, choices[i].sides);
        uint dn = index_count(choices[i].rings, choices[i].sides);
        if (v + dv > push.vertex_limit || n + dn > push.index_limit) {
            choices[i].levels = NOT_DRAWN;
            left++;
        } else {
            choices[i].first_vertex = v;
            choices[i].first_index = n;
            drawn++;
            fitted += dn;
        }
        v += dv;
        n += dn;
    }
    drawn_sum[thread] = drawn;
    left_sum[thread] = left;
    fitted_sum[thread] = fitted;
    barrier();
    if (thread == uint(THREADS) - 1u) {
        draw.instances = 1u;
        draw.first_index = 0u;
        draw.vertex_offset = 0;
        draw.first_instance = 0u;
        draw.vertices = min(v, push.vertex_limit);
        uint d = 0u;
        uint l = 0u;
        uint total = 0u;
        for (uint i = 0u; i < uint(THREADS); i++) {
            d += drawn_sum[i];
            l += left_sum[i];
            total += fitted_sum[i];
        }
        draw.index_total = total;
        draw.drawn = d;
        draw.left_out = l;
    }
}
