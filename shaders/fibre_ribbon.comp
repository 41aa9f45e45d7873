#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// One invocation a fibre that is a lit ribbon: a strip that faces the eye, lit at both edges and in the
// middle of each ring. Between them the light follows a parabola.

#include "view.glsl"
#include "fibre.glsl"
#include "fibre_chain.glsl"
#include "water.glsl"
#include "caustics.glsl"
#include "hash.glsl"
#include "light.glsl"
#include "tissue.glsl"
#include "shown.glsl"

layout(local_size_x = 8) in;

layout(set = 0, binding = 5, scalar) readonly buffer Choices { Choice choices[]; };
layout(set = 0, binding = 6, scalar) readonly buffer Materials { Material materials[]; };
layout(set = 0, binding = 7, scalar) writeonly buffer Vertices { StripVertex vertices[]; };

layout(push_constant, scalar) uniform RibbonPush {
    uint fibre_count;
    float alpha; // between the steps
} push;

void put(uint vertex, vec4 clip, uint edge, uint bow) {
    vertices[vertex].clip = clip;
    vertices[vertex].edge = edge;
    vertices[vertex].bow = bow;
}

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= push.fibre_count) return;
    uint levels = choices[index].levels;
    if (levels == NOT_DRAWN || (levels & LIT_RIBBON) == 0u) return;
    uint level = levels & 0xffu;
    uint rings = choices[index].rings;
    uint vertex = choices[index].first_vertex;
    float slide = choices[index].ring_morph;
    float chain = choices[index].chain;
    take(index, push.alpha);
    Material m = materials[fibre.material];
    uint flags = fibre.nodes_flags >> 16;
    // What is thin is drawn wider on both sides, where it fades.
    bool thin = (levels & THIN) != 0u;

    Window window = first_window();
    for (uint k = 0u; k < rings; k++) {
        float w = slid_position(level, k, false, slide);
        float along = min(w, 1.0) * float(count - 1u);
        uint segment = min(uint(along), count - 2u);
        while (window.segment < segment) advance(window);
        Place c = place(window, along - float(segment));
        float drawn = drawn_radius(c);

        // Across the line of sight. The end is round and the root reaches as far as a tube's, from wherever
        // they are seen.
        vec3 side = cross(c.d, -c.p);
        float size = dot(side, side);
        side = size > 1e-16 ? side * inversesqrt(size) : view.right;
        vec3 facing = cross(side, c.d);
        float bevel = inversesqrt(1.0 + c.taper * c.taper);
        vec2 slope = vec2(c.taper * bevel, bevel);
        float width = drawn;
        float rise = k == 0u ? -drawn : 0.0;
        if (w > 1.0) {
            float angle = (w - 1.0) * 1.5707963;
            slope = vec2(sin(angle), cos(angle));
            width = drawn * max(slope.y, 0.0);
            rise = drawn * slope.x;
        }
        c.p += normalize(cross(side, c.p)) * rise;
        float true_half = width * (c.r / drawn);
        if (thin) width = true_half + LIT_EDGE * pixel_at(c.p);

        Surface s;
        s.along = min(w, 1.0);
        s.disc = 0.0;
        s.circle = vec2(1.0, 0.0);
        s.radius_cm = c.r * 100.0;
        s.tissue_cm = s.radius_cm * HOLLOW;
        s.chain = chain;
        s.skin = vec4(0.0);
        vec3 light[3];
        for (int i = 0; i < 3; i++) {
            float x = float(i - 1);
            vec3 round = side * (0.8 * x) + facing * (x == 0.0 ? 1.0 : 0.6);
            s.normal = normalize(round * slope.y + c.d * slope.x);
            // So that the parabola has the mean of what a tube shows at grazing angles.
            s.grazing = x == 0.0 ? 0.0 : 0.6;
            light[i] = clamp(shown(through_water(tissue_light(m, flags, fibre.variation, s, c.p), c.p)), 0.0, 1.0);
        }
        float filled = thin ? true_half / width : 1.0;
        uint left = packUnorm4x8(vec4(light[0], filled));
        uint right = packUnorm4x8(vec4(light[2], filled));
        uint bow = packSnorm4x8(vec4(light[1] - 0.5 * (light[0] + light[2]), 0.0));

        vec4 middle = view.clip_from_eye * vec4(c.p, 1.0);
        vec4 half_width = view.clip_from_eye * vec4(side * width, 0.0);
        // The first and the last vertex of a strip stand twice: what joins it to its neighbours has no area.
        if (k == 0u) put(vertex++, middle - half_width, left, bow);
        put(vertex++, middle - half_width, left, bow);
        put(vertex++, middle + half_width, right, bow);
        if (k + 1u == rings) put(vertex++, middle + half_width, right, bow);
    }
}
