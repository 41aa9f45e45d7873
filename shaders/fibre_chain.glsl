// A fibre's node chain between two steps, and the smooth curve through it. Needs view.glsl and fibre.glsl;
// bindings 1 to 4.

layout(set = 0, binding = 1, scalar) readonly buffer Fibres { Fibre fibres[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Objects { Object objects[]; };
layout(set = 0, binding = 3, scalar) readonly buffer PreviousNodes { Node previous_nodes[]; };
layout(set = 0, binding = 4, scalar) readonly buffer CurrentNodes { Node current_nodes[]; };

Fibre fibre;
vec3 base;
float blend; // 0: the step before, 1: this step
uint count;

/// Takes a fibre up, in a picture that is between the steps by `alpha`.
void take(uint index, float alpha) {
    fibre = fibres[index];
    Object object = objects[fibre.object];
    blend = max(alpha, fibre.stands);
    base = mix(object.previous, object.current, blend);
    count = fibre.nodes_flags & 0xffffu;
}

/// Node in eye space, blended between the steps; w: radius.
vec4 node(uint i) {
    Node b = current_nodes[fibre.current_node + i];
    Node a = b;
    if (blend < 1.0) a = previous_nodes[fibre.previous_node + i];
    return vec4(mix(a.position, b.position, blend) + base, mix(a.radius, b.radius, blend));
}

/// Unit vector from `a` to `b`.
vec3 direction(vec3 a, vec3 b) {
    vec3 d = b - a;
    return d * inversesqrt(max(dot(d, d), 1e-20));
}

/// The nodes around a segment of the chain, read once each while the segment moves along: the one before, its
/// ends, the one after. At the chain's ends a node stands for the missing one.
struct Window {
    vec4 before;
    vec4 a;
    vec4 b;
    vec4 after;
    uint segment;
};

Window first_window() {
    Window w;
    w.a = node(0u);
    w.before = w.a;
    w.b = node(1u);
    w.after = node(min(2u, count - 1u));
    w.segment = 0u;
    return w;
}

void advance(inout Window w) {
    w.segment++;
    w.before = w.a;
    w.a = w.b;
    w.b = w.after;
    w.after = node(min(w.segment + 2u, count - 1u));
}

/// A place on the curve.
struct Place {
    vec3 p;
    vec3 d;      // unit, along the curve
    float r;     // radius [m]
    float taper; // loss of radius over length
};

/// Place at `t` of the window's segment: a cubic Hermite curve with the nodes' tangents, so that it passes
/// through the nodes. A node's tangent lies across its neighbours, along the segment at the chain's ends.
Place place(Window w, float t) {
    float span = distance(w.a.xyz, w.b.xyz);
    vec3 ta = direction(w.before.xyz, w.b.xyz) * span;
    vec3 tb = direction(w.a.xyz, w.after.xyz) * span;
    float t2 = t * t;
    float t3 = t2 * t;
    Place c;
    c.p = w.a.xyz * (2.0 * t3 - 3.0 * t2 + 1.0) + ta * (t3 - 2.0 * t2 + t) + w.b.xyz * (3.0 * t2 - 2.0 * t3) + tb * (t3 - t2);
    c.d = (w.a.xyz - w.b.xyz) * (6.0 * t2 - 6.0 * t) + ta * (3.0 * t2 - 4.0 * t + 1.0) + tb * (3.0 * t2 - 2.0 * t);
    c.d *= inversesqrt(max(dot(c.d, c.d), 1e-20));
    c.r = mix(w.a.w, w.b.w, t);
    c.taper = (w.a.w - w.b.w) / max(span, 1e-9);
    return c;
}

/// Radius that is drawn [m]: no thinner than a pixel in all; what is too much is taken back as coverage.
float drawn_radius(Place c) {
    return max(c.r, 0.5 * pixel_at(c.p));
}

/// Where ring `k` lies (0 root, 1 last node, 2 end of the cap), slid toward the next coarser level by
/// `slide`.
float slid_position(uint level, uint k, bool cap, float slide) {
    float w = ring_position(level, k, cap);
    return level + 1u < uint(RING_LEVELS) ? mix(w, ring_position(level + 1u, k >> 1, cap), slide) : w;
}
