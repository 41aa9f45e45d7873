// Focusing of sunlight by waves: refraction straight down to the depth d, gain = 1 / (|det(I + d/4 H)| + .15),
// H the Hessian of the waves' height. Mean 1 at any depth.

/// Factor on direct sunlight at the point `p` in eye space, `depth` metres below the surface; `footprint`: size of a
/// pixel there [m], beyond which the pattern cannot be resolved.
float caustic_gain(vec3 p, float depth, float footprint) {
    float strength = view.sun.w * (1.0 - smoothstep(0.015, 0.16, footprint));
    if (strength <= 0.0 || depth <= 0.05) return 1.0;
    // Where the ray that hits p entered the water.
    vec2 x = p.xz + view.sun.xz * (depth / max(view.sun.y, 0.2));
    const int count = HIGH != 0u ? WAVES : WAVES / 2;
    vec3 h = vec3(0.0); // xx, zz, xz
    float bend = 0.0;
    for (int i = 0; i < count; i++) {
        vec4 w = view.wave[i];
        // A wave focuses near 4 / (A k^2); beyond twice that it only blurs.
        float fade = clamp(2.0 - depth * w.z * 0.25, 0.0, 1.0);
        // Each of the breeze's trains is bent a little by the one before, so that the pattern does not repeat.
        float s = sin(dot(w.xy, x) + w.w + bend);
        bend = float(i) >= view.sun_color.w ? 0.9 * s + 0.35 * bend : 0.0;
        vec2 n = w.xy * inversesqrt(max(dot(w.xy, w.xy), 1e-8));
        float a = -w.z * fade * s;
        h += a * vec3(n.x * n.x, n.y * n.y, n.x * n.y);
    }
    h *= 0.25 * depth;
    float det = (1.0 + h.x) * (1.0 + h.y) - h.z * h.z;
    float gain = clamp(1.0 / (abs(det) + 0.15), 0.3, 4.0);
    float octave = clamp(log2(depth), 0.0, 3.0);
    vec4 m = view.caustic_mean;
    float mean = octave < 1.0 ? mix(m.x, m.y, octave) : octave < 2.0 ? mix(m.y, m.z, octave - 1.0)
                                                                     : mix(m.z, m.w, octave - 2.0);
    // Scattering on the way down softens the pattern: half of its contrast is gone by 12 m.
    float contrast = 0.8 * strength * exp(-depth * 0.058);
    return mix(1.0, gain / max(mean, 1e-3), contrast);
}
