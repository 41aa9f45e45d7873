// Focusing of sunlight by waves: refraction straight down to the depth d, gain = 1 / (|det(I + d/4 H)| + .15),
// H the Hessian of the waves' height. Mean 1 at any depth.

/// How much of the caustics is left at a depth [m] and a size of a pixel [m], beyond which the pattern cannot be resolved.
/// Scattering on the way down softens it: half of its contrast is gone by 12 m.
float caustic_strength(float depth, float footprint) {
    return 0.8 * view.sun.w * (1.0 - smoothstep(0.015, 0.16, footprint)) * exp(-depth * 0.058);
}

/// Mean of the unclamped gain at a depth [m].
float caustic_mean(float depth) {
    float octave = clamp(log2(depth), 0.0, 3.0);
    vec4 m = view.caustic_mean;
    float mean = octave < 1.0 ? mix(m.x, m.y, octave) : octave < 2.0 ? mix(m.y, m.z, octave - 1.0)
                                                                     : mix(m.z, m.w, octave - 2.0);
    return max(mean, 1e-3);
}

/// How far train `i`, whose sine is `s`, bends the next one: each of the breeze's a little, so that the pattern does not repeat.
float bend_after(int i, float s, float bend) {
    return mix(0.0, 0.9 * s + 0.35 * bend, float(i) >= view.sun_color.w);
}

/// The gain over its mean at the point `p` in eye space, `depth` metres below the surface.
float caustic_pattern(vec3 p, float depth) {
    // Where the ray that hits p entered the water.
    vec2 x = p.xz + view.sun.xz * (depth / max(view.sun.y, 0.2));
    const int count = HIGH != 0u ? WAVES : WAVES / 2;
    vec3 h = vec3(0.0); // xx, zz, xz
    float bend = 0.0;
    for (int i = 0; i < count; i++) {
        vec4 w = view.wave[i];
        // A wave focuses near 4 / (A k^2); beyond twice that it only blurs.
        float fade = clamp(2.0 - depth * w.z * 0.25, 0.0, 1.0);
        float s = sin(dot(w.xy, x) + w.w + bend);
        bend = bend_after(i, s, bend);
        h -= view.focus[i].xyz * (fade * s);
    }
    h *= 0.25 * depth;
    float det = (1.0 + h.x) * (1.0 + h.y) - h.z * h.z;
    float gain = clamp(1.0 / (abs(det) + 0.15), 0.3, 4.0);
    return gain / caustic_mean(depth);
}

/// Factor on direct sunlight at the point `p` in eye space, `depth` metres below the surface; `footprint`: size of a
/// pixel there [m].
float caustic_gain(vec3 p, float depth, float footprint) {
    float strength = caustic_strength(depth, footprint);
    if (strength <= 0.0 || depth <= 0.05) return 1.0;
    return mix(1.0, caustic_pattern(p, depth), strength);
}
