// Water between the eye and a thing: attenuation along the ray and the light that the water scatters into it.

/// Brightening of scattered light toward the sun: .92 + .08 * 4 pi * HG(g = .8).
float toward_sun(vec3 direction) {
    float x = 1.64 - 1.6 * dot(direction, view.sun);
    return 0.92 + 0.08 * 0.36 * inversesqrt(x) / x;
}

/// Water above is lit from all sides, water below from above alone: rays that go up, and toward the sun,
/// gather more light, and greener; those that go down end in navy.
vec3 from_above(vec3 direction) {
    float up = clamp(0.5 * (direction.y + dot(direction, view.sun)), -0.4, 0.75);
    return 1.0 + up * (vec3(4.2, 2.5, 1.4) + up * vec3(6.0, 3.0, 0.6));
}

/// Light scattered into `distance` metres of a view ray, single scattering with sunlight that fades with
/// depth: W0 exp(-Kd z) (c / k) (1 - exp(-k D)), k = c - Kd u.
vec3 scattered_light(vec3 direction, float distance) {
    vec3 k = max(view.beam - view.downwelling * direction.y, vec3(1e-3));
    vec3 source = view.scattered * exp(-view.downwelling * max(view.surface_height - view.eye.y, 0.0));
    return source * toward_sun(direction) * from_above(direction) * (view.beam / k) * (1.0 - exp(-k * distance));
}

/// What reaches the eye of `light` that leaves the point `p` in eye space.
vec3 through_water(vec3 light, vec3 p) {
    float distance = length(p);
    vec3 direction = p / max(distance, 1e-6);
    vec3 seen = light * exp(-view.beam * distance) + scattered_light(direction, distance);
    return mix(seen, light, in_diagram());
}
