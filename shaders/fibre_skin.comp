#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// One workgroup a tube: the vertices of its rings in clip space, and the triangles between them.

#include "view.glsl"
#include "fibre.glsl"

layout(local_size_x = 32) in;

layout(set = 0, binding = 1, scalar) readonly buffer Fibres { Fibre fibres[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Choices { Choice choices[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Rings { Ring rings[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer Vertices { TubeVertex vertices[]; };
layout(set = 0, binding = 5, scalar) writeonly buffer Indices { uint indices[]; };

layout(set = 0, binding = 6, scalar) readonly buffer Tubes { uint tubes[]; };
layout(set = 0, binding = 7, scalar) readonly buffer Drawn { FibreDraws draw; };

layout(push_constant, scalar) uniform FibreSkinPush {
    uint groups_x;
} push;

void main() {
    uint tube = gl_WorkGroupID.x + gl_WorkGroupID.y * push.groups_x;
    if (tube >= draw.tube_count) return;
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
        vec3 across = cross(ring.tangent, ring.normal);
        vec3 offset;
        vec3 normal;
        vec2 circle;
        // How `fibre.frag` finds what of a pixel is covered: half the true width, and the distance from the
        // middle [px].
        float half_px = 0.5 * ring.coverage;
        float edge_px = 0.0;
        if (ribbon) {
            // Across the line of sight, as wide as the ellipse's shadow.
            vec3 side = cross(ring.tangent, -ring.center);
            float size = dot(side, side);
            side = size > 1e-16 ? side * inversesqrt(size) : ring.normal;
            float sign = j == 0u ? -1.0 : 1.0;
            float a = dot(side, ring.normal);
            float b = dot(side, across);
            // Wider than it is, for the edge that fades.
            float pixel = pixel_at(ring.center);
            float true_half = sqrt(a * a + b * b * flatness * flatness) * ring.radius * ring.coverage;
            half_px = true_half / pixel;
            edge_px = sign * (half_px + EDGE);
            offset = side * (sign * (true_half + EDGE * pixel));
            // The ellipse's normal at .8 of its half shadow: a tube is rounded off, a blade seen from its
            // face is flat.
            vec3 facing = cross(side, ring.tangent);
            float along_face = sign * 0.8 * a + 0.6 * flatness * dot(facing, ring.normal);
            float off_face = sign * 0.8 * b * flatness + 0.6 * dot(facing, across);
            normal = ring.normal * (along_face * flatness) + across * off_face;
            normal *= inversesqrt(max(dot(normal, normal), 1e-12));
            circle = vec2(a, b) * sign;
        } else {
            float angle = 6.2831853 * mix(float(j) / float(sides), float(j >> 1) / float(max(coarser, 1u)),
                                          choice.side_morph);
            circle = vec2(cos(angle), sin(angle));
            vec3 radial = ring.normal * circle.x + across * circle.y;
            offset = radial * (ring.radius * scale);
            normal = radial * ring.slope.y + ring.tangent * ring.slope.x;
        }
        vec4 clip = view.clip_from_eye * vec4(ring.center + offset, 1.0);
        uint at = choice.first_vertex + v;
        vertices[at].clip = clip;
        vertices[at].normal_xy = packSnorm2x16(normal.xy);
        vertices[at].normal_z_along = packSnorm2x16(vec2(normal.z, ring.along * 0.5));
        vertices[at].circle = packSnorm2x16(circle);
        vertices[at].radius_half = packHalf2x16(vec2(ring.radius * ring.coverage * 100.0, half_px));
        vertices[at].material_flags = fibre.material | flags << 24;
        vertices[at].variation = fibre.variation;
        vertices[at].chain_tissue = packHalf2x16(vec2(choice.chain, tissue));
        vertices[at].edge = edge_px;
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
