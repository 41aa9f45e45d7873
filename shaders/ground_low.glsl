// The ground at low quality: what changes slowly is worked out at the vertices, the sand comes out of a tile
// that was made when the scene began. Needs view.glsl, water.glsl, light.glsl.

/// What reaches the eye of the light on a surface, and what the water adds on the way.
struct Haze {
    vec3 through; // share of light at the water's surface that comes down and then to the eye
    vec3 added;
};

Haze haze_at(vec3 p) {
    float sea = 1.0 - view.diagram; // a diagram has no sea
    float distance = length(p);
    Haze haze;
    haze.through = sea_light_at(depth_of(p)) * exp(-view.beam * (distance * sea));
    haze.added = scattered_light(p / max(distance, 1e-6), distance) * sea;
    return haze;
}

/// For the caustics at `p`: a quarter of the depth, contrast over mean, and what is left of the light's own
/// evenness.
vec3 caustics_at(vec3 p) {
    float depth = max(depth_of(p), 0.05);
    float distance = length(p);
    // Size of a pixel on level ground.
    float footprint = distance / view.pixels_per_metre * (1.0 + distance / max(abs(p.y), 0.05));
    float strength = caustic_strength(depth, footprint);
    return vec3(0.25 * depth, strength / caustic_mean(depth), 1.0 - strength);
}

/// Where the light that arrives at `p` entered the water, for the long trains, the first half: they change so
/// little from vertex to vertex that nobody sees them blended. Far away, where vertices are far apart, they
/// fade.
vec2 entry_at(vec3 p) {
    float depth = max(depth_of(p), 0.05);
    vec2 x = caustic_entry(p, depth);
    float apart = 0.08 * length(p);
    for (int i = 0; i < WAVES / 2; i++) {
        CausticTrain w = view.caustic[i];
        float seen = exp(-0.5 * dot(w.vector, w.vector) * apart * apart);
        x -= w.vector * (LONG_REACH * w.amplitude * seen * cos(dot(w.vector, x) + w.phase));
    }
    return x;
}

/// Cosine, wrong by a twentieth.
float rough_cosine(float a) {
    a = a * 0.15915494 + 0.25;
    a -= floor(a + 0.5);
    return a * (8.0 - 16.0 * abs(a));
}

/// Sine, wrong by a thousandth.
float quick_sine(float a) {
    a *= 0.15915494;
    a -= floor(a + 0.5);
    float y = a * (8.0 - 16.0 * abs(a));
    return y * (0.775 + 0.225 * abs(y));
}

/// Factor on direct sunlight, as in caustics.glsl; `c` as from caustics_at, `x` as from entry_at.
float quick_caustics(vec2 x, vec3 c) {
    vec3 h = vec3(0.0);
    for (int i = WAVES / 2; i < WAVES; i++) {
        CausticTrain w = view.caustic[i];
        float bend = caustic_bend(i, c.x);
        float a = dot(w.vector, x) + w.phase;
        float cosine = rough_cosine(a);
        h -= w.hessian * (bend * quick_sine(a - bend * w.power * cosine));
        x -= w.vector * (bend * w.amplitude * cosine);
    }
    return c.z + c.y * caustic_focus(h, c.x);
}

/// Light from the ground to the eye. `open`: r to the water around, g to the sun; the others as from
/// caustics_at, entry_at and haze_at.
vec3 seen_ground(vec3 albedo, vec3 normal, vec2 open, vec3 caustics, vec2 entry, Haze haze) {
    float facing = clamp(dot(normal, view.sun), 0.0, 1.0);
    vec3 light = view.sun_color * (facing * quick_caustics(entry, caustics) * open.g)
        + ambient_light(normal, vec3(1.0), SAND_DARK) * open.r;
    return albedo * light * haze.through + haze.added;
}
