#version 460
#extension GL_GOOGLE_include_directive : require
// One invocation a fibre: blends the last two steps, culls, chooses the level of detail, and lays the rings along a
// smooth curve through the nodes with frames that do not twist.

#include "view.glsl"
#include "fibre.glsl"

layout(local_size_x = 64) in;

layout(set = 0, binding = 1, std430) readonly buffer Fibres { Fibre fibres[]; };
layout(set = 0, binding = 2, std430) readonly buffer Objects { Object objects[]; };
layout(set = 0, binding = 3, std430) readonly buffer PreviousNodes { vec4 previous_nodes[]; };
layout(set = 0, binding = 4, std430) readonly buffer CurrentNodes { vec4 current_nodes[]; };
layout(set = 0, binding = 5, std430) writeonly buffer Choices { Choice choices[]; };
layout(set = 0, binding = 6, std430) writeonly buffer Rings { Ring rings[]; };

layout(push_constant) uniform Push {
    uint fibre_count;
    uint use_lod;      // 0: everything at full detail, nothing culled
    float ring_step;   // a coarser ring level of n segments is chosen below n^2 times this length [px]
    float side_error;  // a coarser side level is chosen when its silhouette errs by less than this [px]
} push;

Fibre fibre;
vec3 base;
uint count;

/// Node in eye space, blended between the steps; w: radius.
vec4 node(uint i) {
    vec4 a = previous_nodes[fibre.previous_node + i];
    vec4 b = current_nodes[fibre.current_node + i];
    vec4 n = mix(a, b, fibre.blend);
    return vec4(n.xyz + base, n.w);
}

/// Unit direction of the curve at a node: across its neighbours, along the segment at the ends.
vec3 node_tangent(uint i) {
    vec3 a = node(i == 0u ? 0u : i - 1u).xyz;
    vec3 b = node(min(i + 1u, count - 1u)).xyz;
    vec3 d = b - a;
    return d * inversesqrt(max(dot(d, d), 1e-20));
}

/// Length below which a ring level is fine enough [px].
float ring_limit(uint level, bool cap) {
    float segments = float(body_rings(level, cap) - 1u);
    return push.ring_step * segments * segments;
}

/// How far a level is from the switch to the next: 0 far away, 1 at the switch.
float morph(float value, float limit) {
    return clamp((limit * 1.5 - value) / (limit * 0.5), 0.0, 1.0);
}

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= push.fibre_count) return;
    fibre = fibres[index];
    Object object = objects[fibre.object];
    base = mix(object.previous.xyz, object.current.xyz, fibre.blend);
    count = fibre.nodes_flags & 0xffffu;
    uint flags = fibre.nodes_flags >> 16;
    bool cap = (flags & FLAG_CAP) != 0u;

    // Bounding sphere, length, greatest radius.
    vec4 first = node(0u);
    vec3 low = first.xyz;
    vec3 high = first.xyz;
    vec3 last = first.xyz;
    float radius = first.w;
    float chain = 0.0;
    for (uint i = 1u; i < count; i++) {
        vec4 n = node(i);
        low = min(low, n.xyz);
        high = max(high, n.xyz);
        radius = max(radius, n.w);
        chain += distance(n.xyz, last);
        last = n.xyz;
    }
    vec3 center = (low + high) * 0.5;
    float reach = distance(low, high) * 0.5 + radius * 1.5;

    Choice choice;
    choice.first_vertex = 0u;
    choice.first_index = 0u;
    choice.chain = chain;
    choice.levels = 0u;
    choice.ring_morph = 0.0;
    choice.side_morph = 0.0;

    if (push.use_lod != 0u) {
        vec3 c = vec3(dot(center, view.right.xyz), dot(center, view.up.xyz), dot(center, view.forward.xyz));
        float side_x = sqrt(1.0 + view.right.w * view.right.w) * reach;
        float side_y = sqrt(1.0 + view.up.w * view.up.w) * reach;
        bool outside = c.z < -reach + view.forward.w || abs(c.x) > c.z * view.right.w + side_x
            || abs(c.y) > c.z * view.up.w + side_y || c.z - reach > view.viewport.w;
        if (outside) {
            choice.levels = NOT_DRAWN;
            choice.rings = 0u;
            choice.sides = 0u;
            choices[index] = choice;
            return;
        }
        float nearest = max(length(center) - reach, view.forward.w);
        float pixels = view.viewport.z / nearest;
        float length_px = chain * pixels;
        float radius_px = radius * pixels;

        uint ring_level = 0u;
        while (ring_level + 1u < uint(RING_LEVELS) && length_px < ring_limit(ring_level + 1u, cap)) ring_level++;
        if (ring_level + 1u < uint(RING_LEVELS)) choice.ring_morph = morph(length_px, ring_limit(ring_level + 1u, cap));

        uint side_level = 0u;
        uint sides = fibre.sides;
        // The silhouette of a polygon with n sides errs by half of r (1 - cos(pi / n)).
        while (sides > 2u) {
            uint fewer = sides <= 4u ? 2u : (sides + 1u) >> 1;
            float limit = fewer == 2u ? push.side_error * 3.0
                                      : 2.0 * push.side_error / (1.0 - cos(3.14159265 / float(fewer)));
            if (radius_px >= limit) {
                if (fewer > 2u) choice.side_morph = morph(radius_px, limit);
                break;
            }
            sides = fewer;
            side_level++;
        }
        choice.levels = ring_level | side_level << 8;
    }
    uint ring_level = choice.levels & 0xffu;
    choice.rings = ring_count(ring_level);
    choice.sides = side_count(fibre.sides, choice.levels >> 8);
    choices[index] = choice;

    // Rings from root to tip; `at` walks along the nodes and the frame is carried with it.
    vec3 tangent = node_tangent(0u);
    vec3 normal = mix(fibre.previous_normal, fibre.normal, fibre.blend);
    normal -= tangent * dot(normal, tangent);
    if (dot(normal, normal) < 1e-8) normal = cross(tangent, abs(tangent.x) < 0.7 ? vec3(1, 0, 0) : vec3(0, 1, 0));
    normal = normalize(normal);
    uint at = 0u;
    float top_radius = node(count - 1u).w;
    for (uint k = 0u; k < choice.rings; k++) {
        float w = ring_position(ring_level, k, cap);
        if (ring_level + 1u < uint(RING_LEVELS))
            w = mix(w, ring_position(ring_level + 1u, k >> 1, cap), choice.ring_morph);

        float along = min(w, 1.0) * float(count - 1u);
        uint segment = min(uint(along), count - 2u);
        float t = along - float(segment);
        while (at < segment) {
            at++;
            vec3 next = node_tangent(at);
            normal = transport(normal, tangent, next);
            tangent = next;
        }
        // Cubic Hermite curve with the nodes' tangents, so that it passes through the nodes.
        vec4 a = node(segment);
        vec4 b = node(segment + 1u);
        float span = distance(a.xyz, b.xyz);
        vec3 ta = tangent * span;
        vec3 tb = node_tangent(segment + 1u) * span;
        float t2 = t * t;
        float t3 = t2 * t;
        vec3 p = a.xyz * (2.0 * t3 - 3.0 * t2 + 1.0) + ta * (t3 - 2.0 * t2 + t) + b.xyz * (3.0 * t2 - 2.0 * t3)
            + tb * (t3 - t2);
        vec3 d = (a.xyz - b.xyz) * (6.0 * t2 - 6.0 * t) + ta * (3.0 * t2 - 4.0 * t + 1.0) + tb * (3.0 * t2 - 2.0 * t);
        d *= inversesqrt(max(dot(d, d), 1e-20));
        float r = mix(a.w, b.w, t);

        // No thinner than a pixel in all; what is too much is taken back as coverage.
        float pixel = max(dot(p, view.forward.xyz), view.forward.w) / view.viewport.z;
        float drawn = max(r, 0.5 * pixel);

        Ring ring;
        ring.normal = vec4(transport(normal, tangent, d), r / drawn);
        ring.tangent = vec4(d, w);
        float taper = (a.w - b.w) / max(span, 1e-9);
        float bevel = inversesqrt(1.0 + taper * taper);
        ring.slope = vec4(taper * bevel, bevel, 0.0, 0.0);
        float factor = 1.0;
        if (w > 1.0) {
            float q = w - 1.0;
            float rise;
            if (cap) {
                // The oral disc: a rounded lip, a shallow bowl, the mouth's small mound and slit.
                factor = 1.0 - q;
                rise = top_radius * (0.16 * sin(min(q * 5.0, 1.5707963)) - 0.20 * smoothstep(0.1, 0.7, q)
                    + 0.16 * smoothstep(0.62, 0.82, q) - 0.22 * smoothstep(0.86, 1.0, q));
                float e = 0.02;
                float ahead = top_radius * (0.16 * sin(min((q + e) * 5.0, 1.5707963)) - 0.20 * smoothstep(0.1, 0.7, q + e)
                    + 0.16 * smoothstep(0.62, 0.82, q + e) - 0.22 * smoothstep(0.86, 1.0, q + e));
                vec2 n = normalize(vec2(1.0, (ahead - rise) / (e * top_radius)));
                ring.slope = vec4(n.x, n.y, 0.0, 0.0);
            } else {
                float angle = q * 1.5707963;
                factor = cos(angle);
                rise = drawn * sin(angle);
                ring.slope = vec4(sin(angle), cos(angle), 0.0, 0.0);
            }
            p += d * rise;
        }
        ring.center = vec4(p, drawn * max(factor, 0.0));
        rings[index * uint(RINGS) + k] = ring;
    }
}
