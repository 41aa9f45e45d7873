// Water between the eye and a thing: attenuation along the ray and the light that the water scatters into it.

/// Brightening of scattered light toward the sun: .92 + .08 * 4 pi * HG(g = .8).
float toward_sun(vec3 direction) {
    float x = 1.64 - 1.6 * dot(direction, view.sun.xyz);
    return 0.92 + 0.08 * 0.36 * inversesqrt(x) / x;
}

/// Water above is lit from all sides, water below from above alone: upward rays gather more light, and greener.
vec3 from_above(float up) {
    return 1.0 + clamp(up, -0.5, 0.8) * vec3(1.1, 0.95, 0.55);
}

vec2 complex_mul(vec2 a, vec2 b) {
    return vec2(a.x * b.x - a.y * b.y, a.x * b.y + a.y * b.x);
}

/// Shafts of light: they run parallel to the sun's rays, so that in the picture they spread from where it stands. A sum of
/// harmonics of the angle around the sun, drifting slowly.
float shafts(vec3 direction, float distance) {
    vec3 side = normalize(cross(view.sun.xyz, vec3(0.31, 0.05, 0.95)));
    vec2 e = vec2(dot(direction, side), dot(direction, cross(side, view.sun.xyz)));
    float away = dot(e, e);
    e *= inversesqrt(max(away, 1e-6));
    vec2 e2 = complex_mul(e, e);
    vec2 e4 = complex_mul(e2, e2);
    vec2 e8 = complex_mul(e4, e4);
    vec2 e16 = complex_mul(e8, e8);
    float a = view.ambient.w * 0.31;
    float b = view.ambient.w * -0.23 + 1.7;
    float c = view.ambient.w * 0.17 + 4.0;
    float beams = dot(complex_mul(e16, e4), vec2(cos(a), sin(a))) + dot(complex_mul(e16, complex_mul(e8, e2)), vec2(cos(b), sin(b)))
        + dot(complex_mul(e8, complex_mul(e4, e)), vec2(cos(c), sin(c)));
    float fade = clamp(distance * 0.12, 0.0, 1.0) * clamp(0.35 + direction.y * 1.2, 0.0, 1.0) * clamp(away * 2.0, 0.0, 1.0);
    return 1.0 + fade * 0.055 * beams * clamp(beams + 1.6, 0.0, 2.0);
}

/// Light scattered into `distance` metres of a view ray, single scattering with sunlight that fades with depth:
/// W0 exp(-Kd z) (c / k) (1 - exp(-k D)), k = c - Kd u.
vec3 scattered_light(vec3 direction, float distance) {
    vec3 k = max(view.beam.rgb - view.downwelling.rgb * direction.y, vec3(1e-3));
    vec3 source = view.scattered.rgb * exp(-view.downwelling.rgb * max(view.scattered.w - view.eye.y, 0.0));
    if (HIGH != 0u && distance > 1.0) source *= shafts(direction, distance);
    return source * toward_sun(direction) * from_above(direction.y) * (view.beam.rgb / k) * (1.0 - exp(-k * distance));
}

/// What reaches the eye of `light` that leaves the point `p` in eye space.
vec3 through_water(vec3 light, vec3 p) {
    if (view.beam.w > 0.5) return light;
    float distance = length(p);
    vec3 direction = p / max(distance, 1e-6);
    return light * exp(-view.beam.rgb * distance) + scattered_light(direction, distance);
}
