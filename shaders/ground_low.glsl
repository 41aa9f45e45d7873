// The ground at low quality: what changes slowly is worked out at the vertices, the sand comes out of a tile that was made
// when the scene began. Needs view.glsl, water.glsl, light.glsl.

/// What reaches the eye of the light on a surface, and what the water adds on the way.
struct Haze {
    vec3 through; // share of light at the water's surface that comes down and then to the eye
    vec3 added;
};

Haze haze_at(vec3 p) {
    float sea = 1.0 - view.beam.w; // a diagram has no sea
    float distance = length(p);
    Haze haze;
    haze.through = sea_light_at(depth_of(p)) * exp(-view.beam.rgb * (distance * sea));
    haze.added = scattered_light(p / max(distance, 1e-6), distance) * sea;
    return haze;
}

/// For the caustics at `p`: depth over four, contrast over mean, and what is left of the light's own evenness.
vec3 caustics_at(vec3 p) {
    float depth = max(depth_of(p), 0.05);
    float distance = length(p);
    // Size of a pixel on level ground.
    float footprint = distance / view.viewport.z * (1.0 + distance / max(abs(p.y), 0.05));
    float strength = caustic_strength(depth, footprint);
    return vec3(0.25 * depth, strength / caustic_mean(depth), 1.0 - strength);
}

/// Sine, wrong by a thousandth.
float quick_sine(float a) {
    a *= 0.15915494;
    a -= floor(a + 0.5);
    float y = a * (8.0 - 16.0 * abs(a));
    return y * (0.775 + 0.225 * abs(y));
}

/// Factor on direct sunlight, as in caustics.glsl; `c` as from caustics_at.
float quick_caustics(vec3 p, vec3 c) {
    float depth = 4.0 * c.x;
    vec2 x = p.xz + view.sun.xz * (depth / max(view.sun.y, 0.2));
    vec3 h = vec3(0.0);
    float bend = 0.0;
    for (int i = 0; i < WAVES / 2; i++) {
        vec4 w = view.wave[i];
        vec4 f = view.focus[i];
        float s = quick_sine(dot(w.xy, x) + w.w + bend);
        bend = bend_after(i, s, bend);
        h -= f.xyz * (clamp(2.0 - c.x * w.z, 0.0, 1.0) * s);
    }
    h *= c.x;
    float det = (1.0 + h.x) * (1.0 + h.y) - h.z * h.z;
    return c.z + c.y * clamp(1.0 / (abs(det) + 0.15), 0.3, 4.0);
}

/// Light from the ground to the eye. `open`: r to the water around, g to the sun.
vec3 seen_ground(vec3 albedo, vec3 normal, vec3 p, vec2 open, vec3 caustics, vec3 through, vec3 added) {
    float facing = clamp(dot(normal, view.sun.xyz), 0.0, 1.0);
    vec3 light = view.sun_color.rgb * (facing * quick_caustics(p, caustics) * open.g) + ambient_light(normal, vec3(1.0), SAND_DARK) * open.r;
    return albedo * light * through + added;
}
