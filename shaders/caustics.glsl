// Focusing of sunlight by waves: gain = 1 / (|det(I + q H)| + .15), q a quarter of the depth, H the Hessian
// of the waves' height where the light that arrives at a place entered the water. Mean 1 at any depth. Needs
// view.glsl.
//
// That place is found train by train, the longest first: each shifts it by q times its slope, as light bends
// away from a slope, so that the crests of the others gather light where this one does. It is what draws the
// lines together to a net.

/// How much of the caustics is left at a depth [m] and a size of a pixel [m], beyond which the pattern cannot
/// be resolved. Scattering on the way down softens it: half of its contrast is gone by 12 m.
float caustic_strength(float depth, float footprint) {
    return 0.8 * view.caustics * (1.0 - smoothstep(0.012, 0.13, footprint)) * exp(-depth * 0.058);
}

/// Mean of the unclamped gain at a depth [m].
float caustic_mean(float depth) {
    float octave = clamp(log2(depth), 0.0, 3.0);
    vec4 m = view.caustic_mean;
    float mean = octave < 1.0 ? mix(m.x, m.y, octave) : octave < 2.0 ? mix(m.y, m.z, octave - 1.0)
                                                                     : mix(m.z, m.w, octave - 2.0);
    return max(mean, 1e-3);
}

/// Where the straight ray that arrives at `p`, in eye space, entered the water (x, z).
vec2 caustic_entry(vec3 p, float depth) {
    return p.xz + view.sun.xz * (depth / max(view.sun.y, 0.2));
}

/// How far light goes on converging, `quarter`: a quarter of the depth [m]. Below 4 m lines grow wide rather
/// than many.
float caustic_reach(float quarter) {
    return min(quarter, 1.0) + 0.25 * max(quarter - 1.0, 0.0);
}

/// How strongly train `i` bends light. It focuses near 4 / (A k^2); beyond twice that it only blurs.
float caustic_bend(int i, float quarter) {
    return clamp(2.0 - quarter * view.caustic[i].power, 0.0, 1.0) * caustic_reach(quarter);
}

/// The gain of a Hessian (xx, zz, xz) that is multiplied by the reach; lines are wider farther down.
float caustic_focus(vec3 h, float quarter) {
    float det = (1.0 + h.x) * (1.0 + h.y) - h.z * h.z;
    return clamp(1.0 / (abs(det) + 0.15 + 0.16 * max(quarter - 1.0, 0.0)), 0.3, 4.0);
}

/// The gain over its mean at the point `p` in eye space, `depth` metres below the surface.
float caustic_pattern(vec3 p, float depth) {
    float quarter = 0.25 * depth;
    vec2 x = caustic_entry(p, depth);
    vec3 h = vec3(0.0);
    for (int i = 0; i < WAVES; i++) {
        CausticTrain w = view.caustic[i];
        float bend = caustic_bend(i, quarter);
        float a = dot(w.vector, x) + w.phase;
        float c = cos(a);
        // Light that arrives here has crossed this train where its phase is so much less.
        h -= w.hessian * (bend * sin(a - bend * w.power * c));
        x -= w.vector * ((i < WAVES / 2 ? LONG_REACH : bend) * w.amplitude * c);
    }
    return caustic_focus(h, quarter) / caustic_mean(depth);
}

/// Factor on direct sunlight at the point `p` in eye space, `depth` metres below the surface; `footprint`:
/// size of a pixel there [m].
float caustic_gain(vec3 p, float depth, float footprint) {
    float strength = caustic_strength(depth, footprint);
    if (strength <= 0.0 || depth <= 0.05) return 1.0;
    return mix(1.0, caustic_pattern(p, depth), strength);
}
