#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// One invocation a fibre: blends the last two steps, culls, chooses the level of detail, and lays the rings
// along a smooth curve through the nodes with frames that do not twist.

#include "view.glsl"
#include "fibre.glsl"
#include "fibre_chain.glsl"

layout(local_size_x = 64) in;

layout(set = 0, binding = 5, scalar) writeonly buffer Choices { Choice choices[]; };
layout(set = 0, binding = 6, scalar) writeonly buffer Rings { Ring rings[]; };

layout(push_constant, scalar) uniform RingsPush {
    uint fibre_count;
    float alpha;       // between the steps
    uint use_lod;      // 0: everything at full detail, nothing culled
    float ring_step;   // a coarser ring level of n segments is chosen below n^2 times this length [px]
    float side_error;  // a coarser side level is chosen when its silhouette errs by less than this [px]
    float lit_ribbon;  // a fibre of one colour that is thinner than this [px] is a ribbon that is lit at its rings
} push;

/// Length below which a ring level is fine enough [px].
float ring_limit(uint level, bool cap) {
    float segments = float(body_rings(level, cap) - 1u);
    return push.ring_step * segments * segments;
}

/// How far a level is from the switch to the next: 0 far away, 1 at the switch.
float morph(float value, float limit) {
    return clamp((limit * 1.5 - value) / (limit * 0.5), 0.0, 1.0);
}

/// Height of the oral disc over its rim, in radii; q: 0 at the rim, 1 in the mouth. A rounded lip, a shallow
/// bowl, the mouth's small mound and slit.
float disc_profile(float q) {
    return 0.16 * sin(min(q * 5.0, 1.5707963)) - 0.20 * smoothstep(0.1, 0.7, q) + 0.16 * smoothstep(0.62, 0.82, q)
        - 0.22 * smoothstep(0.86, 1.0, q);
}

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= push.fibre_count) return;
    take(index, push.alpha);
    uint flags = fibre.nodes_flags >> 16;
    bool cap = (flags & FLAG_CAP) != 0u;

    // Bounding sphere, length, greatest radius.
    vec4 first = node(0u);
    vec3 low = first.xyz;
    vec3 high = first.xyz;
    vec3 last = first.xyz;
    float radius = first.w;
    float thinnest = first.w;
    float chain = 0.0;
    for (uint i = 1u; i < count; i++) {
        vec4 n = node(i);
        low = min(low, n.xyz);
        high = max(high, n.xyz);
        radius = max(radius, n.w);
        thinnest = min(thinnest, n.w);
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

    // For every fibre or for none; written so that no branch hangs on a uniform alone (see HIGH in
    // view.glsl).
    if (index < push.fibre_count * min(push.use_lod, 1u)) {
        vec3 c = vec3(dot(center, view.right), dot(center, view.up), dot(center, view.forward));
        float side_x = sqrt(1.0 + view.tangent_x * view.tangent_x) * reach;
        float side_y = sqrt(1.0 + view.tangent_y * view.tangent_y) * reach;
        bool outside = c.z < -reach + view.near || abs(c.x) > c.z * view.tangent_x + side_x
            || abs(c.y) > c.z * view.tangent_y + side_y || c.z - reach > view.far;
        if (outside) {
            choice.levels = NOT_DRAWN;
            choice.rings = 0u;
            choice.sides = 0u;
            choices[index] = choice;
            return;
        }
        float nearest = max(length(center) - reach, view.near);
        float pixels = view.pixels_per_metre / nearest;
        float length_px = chain * pixels;
        float radius_px = radius * pixels;

        uint ring_level = 0u;
        while (ring_level + 1u < uint(RING_LEVELS) && length_px < ring_limit(ring_level + 1u, cap)) ring_level++;
        if (ring_level + 1u < uint(RING_LEVELS)) choice.ring_morph = morph(length_px, ring_limit(ring_level + 1u, cap));

        if (fibre.plain != 0u && radius_px < push.lit_ribbon) {
            // Where it is thin its edges fade, and what is behind it shines through.
            bool thin = thinnest < THIN_RADIUS * (length(center) + reach) / view.pixels_per_metre;
            choice.levels = ring_level | LIT_RIBBON | (thin ? THIN : 0u);
            choice.rings = ring_count(ring_level);
            choice.sides = 2u;
            choices[index] = choice;
            return;
        }

        uint side_level = 0u;
        uint sides = fibre.sides;
        // The silhouette of a polygon with n sides errs by half of r (1 - cos(pi / n)).
        while (sides > 2u) {
            uint fewer = sides <= 4u ? 2u : (sides + 1u) >> 1;
            float limit = fewer == 2u ? push.side_error * RIBBON_ERRORS
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

    // Rings from root to tip; the frame is carried along with the nodes.
    Window window = first_window();
    vec3 tangent = direction(window.before.xyz, window.b.xyz);
    vec3 normal = mix(fibre.previous_normal, fibre.normal, blend);
    normal -= tangent * dot(normal, tangent);
    if (dot(normal, normal) < 1e-8) normal = cross(tangent, abs(tangent.x) < 0.7 ? vec3(1, 0, 0) : vec3(0, 1, 0));
    normal = normalize(normal);
    float top_radius = node(count - 1u).w;
    for (uint k = 0u; k < choice.rings; k++) {
        float w = slid_position(ring_level, k, cap, choice.ring_morph);
        float along = min(w, 1.0) * float(count - 1u);
        uint segment = min(uint(along), count - 2u);
        while (window.segment < segment) {
            advance(window);
            vec3 next = direction(window.before.xyz, window.b.xyz);
            normal = transport(normal, tangent, next);
            tangent = next;
        }
        Place c = place(window, along - float(segment));
        float drawn = drawn_radius(c);

        Ring ring;
        ring.normal = transport(normal, tangent, c.d);
        ring.coverage = c.r / drawn;
        ring.tangent = c.d;
        ring.along = w;
        float bevel = inversesqrt(1.0 + c.taper * c.taper);
        ring.slope = vec2(c.taper * bevel, bevel);
        float factor = 1.0;
        if (w > 1.0) {
            float q = w - 1.0;
            float rise;
            if (cap) {
                factor = 1.0 - q;
                rise = top_radius * disc_profile(q);
                float e = 0.02;
                float ahead = top_radius * disc_profile(q + e);
                vec2 n = normalize(vec2(1.0, (ahead - rise) / (e * top_radius)));
                ring.slope = n;
            } else {
                float angle = q * 1.5707963;
                factor = cos(angle);
                rise = drawn * sin(angle);
                ring.slope = vec2(sin(angle), cos(angle));
            }
            c.p += c.d * rise;
        }
        ring.center = c.p;
        ring.radius = drawn * max(factor, 0.0);
        rings[index * uint(RINGS) + k] = ring;
    }
}
