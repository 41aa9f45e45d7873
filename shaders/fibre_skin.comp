#version 460
#extension GL_GOOGLE_include_directive : require
// One workgroup a tube: the vertices of its rings in clip space, and the triangles between them.

#include "view.glsl"
#include "fibre.glsl"

layout(local_size_x = 32) in;

layout(set = 0, binding = 1, std430) readonly buffer Fibres { Fibre fibres[]; };
layout(set = 0, binding = 2, std430) readonly buffer Choices { Choice choices[]; };
layout(set = 0, binding = 3, std430) readonly buffer Rings { Ring rings[]; };
layout(set = 0, binding = 4, std430) writeonly buffer Vertices { uint vertices[]; };
layout(set = 0, binding = 5, std430) writeonly buffer Indices { uint indices[]; };

layout(set = 0, binding = 6, std430) readonly buffer Tubes { uint tubes[]; };
layout(set = 0, binding = 7, std430) readonly buffer Draw { Draws draw; };

layout(push_constant) uniform Push {
    uint groups_x;
} push;

#define VERTEX_WORDS 12u

void main() {
    uint tube = gl_WorkGroupID.x + gl_WorkGroupID.y * push.groups_x;
    if (tube >= draw.groups.w) return;
    uint index = tubes[tube];
    Choice choice = choices[index];
    Fibre fibre = fibres[index];
    uint flags = fibre.nodes_flags >> 16;
    uint sides = choice.sides;
    bool ribbon = sides == 2u;
    bool blade = (flags & FLAG_BLADE) != 0u;
    float flatness = blade ? fibre.flatness : 1.0;
    float tissue = blade ? 2.0 * flatness : HOLLOW;
    uint side_level = choice.levels >> 8;
    uint coarser = side_count(fibre.sides, side_level + 1u);
    float scale = mix(polygon_scale(sides), polygon_scale(coarser), choice.side_morph);

    for (uint v = gl_LocalInvocationID.x; v < choice.rings * sides; v += 32u) {
        uint k = v / sides;
        uint j = v - k * sides;
        Ring ring = rings[index * uint(RINGS) + k];
        vec3 across = cross(ring.tangent.xyz, ring.normal.xyz);
        vec3 offset;
        vec3 normal;
        vec2 circle;
        // How `fibre.frag` finds what of a pixel is covered: half the true width, and the distance from the
        // middle [px].
        float half_px = 0.5 * ring.normal.w;
        float edge_px = 0.0;
        if (ribbon) {
            // Across the line of sight, as wide as the ellipse's shadow.
            vec3 side = cross(ring.tangent.xyz, -ring.center.xyz);
            float size = dot(side, side);
            side = size > 1e-16 ? side * inversesqrt(size) : ring.normal.xyz;
            float sign = j == 0u ? -1.0 : 1.0;
            float a = dot(side, ring.normal.xyz);
            float b = dot(side, across);
            // Wider than it is, for the edge that fades.
            float pixel = pixel_at(ring.center.xyz);
            float true_half = sqrt(a * a + b * b * flatness * flatness) * ring.center.w * ring.normal.w;
            half_px = true_half / pixel;
            edge_px = sign * (half_px + EDGE);
            offset = side * (sign * (true_half + EDGE * pixel));
            // The ellipse's normal at .8 of its half shadow: a tube is rounded off, a blade seen from its
            // face is flat.
            vec3 facing = cross(side, ring.tangent.xyz);
            float along_face = sign * 0.8 * a + 0.6 * flatness * dot(facing, ring.normal.xyz);
            float off_face = sign * 0.8 * b * flatness + 0.6 * dot(facing, across);
            normal = ring.normal.xyz * (along_face * flatness) + across * off_face;
            normal *= inversesqrt(max(dot(normal, normal), 1e-12));
            circle = vec2(a, b) * sign;
        } else {
            float angle = 6.2831853 * mix(float(j) / float(sides), float(j >> 1) / float(max(coarser, 1u)),
                                          choice.side_morph);
            circle = vec2(cos(angle), sin(angle));
            vec3 radial = ring.normal.xyz * circle.x + across * circle.y;
            offset = radial * (ring.center.w * scale);
            normal = radial * ring.slope.y + ring.tangent.xyz * ring.slope.x;
        }
        vec4 clip = view.clip_from_eye * vec4(ring.center.xyz + offset, 1.0);
        uint at = (choice.first_vertex + v) * VERTEX_WORDS;
        vertices[at] = floatBitsToUint(clip.x);
        vertices[at + 1u] = floatBitsToUint(clip.y);
        vertices[at + 2u] = floatBitsToUint(clip.z);
        vertices[at + 3u] = floatBitsToUint(clip.w);
        vertices[at + 4u] = packSnorm2x16(normal.xy);
        vertices[at + 5u] = packSnorm2x16(vec2(normal.z, ring.tangent.w * 0.5));
        vertices[at + 6u] = packSnorm2x16(circle);
        vertices[at + 7u] = packHalf2x16(vec2(ring.center.w * ring.normal.w * 100.0, half_px));
        vertices[at + 8u] = fibre.material | flags << 24;
        vertices[at + 9u] = fibre.variation;
        vertices[at + 10u] = packHalf2x16(vec2(choice.chain, tissue));
        vertices[at + 11u] = floatBitsToUint(edge_px);
    }

    uint quads = ribbon ? 1u : sides;
    uint total = (choice.rings - 1u) * quads;
    for (uint q = gl_LocalInvocationID.x; q < total; q += 32u) {
        uint k = q / quads;
        uint j = q - k * quads;
        uint j1 = j + 1u == sides ? 0u : j + 1u;
        uint a = choice.first_vertex + k * sides;
        uint b = a + sides;
        uint at = choice.first_index + q * 6u;
        // Counter-clockwise from outside.
        indices[at] = a + j;
        indices[at + 1u] = a + j1;
        indices[at + 2u] = b + j1;
        indices[at + 3u] = a + j;
        indices[at + 4u] = b + j1;
        indices[at + 5u] = b + j;
    }
}
