// Sand: two ripple trains that fork where they disagree, grain, and colours between dune and trough. Needs
// `noise` (tiling; r, a: two noises, g, b: slope of r) and `contact` (r: open to the water, g: open to the
// sun).

struct Sand {
    vec3 albedo;
    vec3 normal;
};

/// `x`: world position on the ground, `slope`: of the terrain, `distance` from the eye [m].
Sand sand_at(vec2 x, vec2 slope, float distance) {
    vec4 slow = texture(noise, x * 0.137);
    vec4 mid = texture(noise, x.yx * 0.61 + 0.37);
    vec2 surge = view.surge;
    vec2 other = vec2(surge.x * 0.966 - surge.y * 0.259, surge.x * 0.259 + surge.y * 0.966);
    float k1 = view.ripple_number;
    float k2 = k1 * 0.87;
    float warp = (slow.r - 0.5) * 16.0 + (mid.r - 0.5) * 1.6;
    float a1 = dot(surge, x) * k1 + warp;
    float a2 = dot(other, x) * k2 - warp * 0.8 + 1.7;
    float weight = smoothstep(0.42, 0.60, slow.a);
    float resolved = 1.0 - smoothstep(0.7, 2.6, fwidth(a1));
    float patches = smoothstep(0.25, 0.50, mix(slow.a, mid.a, 0.25)) * 0.7 + 0.3;
    float height = view.ripple_height * patches * resolved;
    // Crests sharper than troughs.
    float s1 = sin(a1);
    float s2 = sin(a2);
    float crest = mix(s1, s2, weight);
    vec2 gradient = mix(surge * (cos(a1) * (1.0 + 0.45 * s1) * k1), other * (cos(a2) * (1.0 + 0.45 * s2) * k2), weight) * (height * 1.5);

    vec3 tone = mix(SAND_DARK, SAND_LIGHT, clamp(0.15 + 0.55 * slow.r + 0.5 * (mid.a - 0.3), 0.0, 1.0));
    float trough = (0.5 - 0.5 * crest) * patches * resolved;
    tone *= 1.0 - 0.42 * trough * trough;
    float near = clamp(1.0 - distance * 0.25, 0.0, 1.0);
    if (near > 0.0) {
        vec4 grain = texture(noise, x * 9.7);
        gradient += (grain.gb - 0.5) * (0.5 * near);
        // Crumbs of shell and rock, a few millimetres wide, here more and there less.
        vec4 crumbs = texture(noise, x * 31.0 + 0.21);
        float dark = smoothstep(0.72, 0.80, crumbs.a * 0.75 + mid.r * 0.25);
        float pale = smoothstep(0.74, 0.82, crumbs.r * 0.8 + mid.a * 0.2);
        tone *= 1.0 + near * (0.30 * (grain.r - 0.5) - 0.40 * dark + 0.22 * pale);
    }
    gradient += (mid.gb - 0.5) * 0.16;
    Sand sand;
    sand.albedo = tone;
    sand.normal = normalize(vec3(-slope.x - gradient.x, 1.0, -slope.y - gradient.y));
    return sand;
}

/// Light on sand or rock. `open`: r to the water around, g to the sun.
vec3 lit_ground(vec3 albedo, vec3 normal, vec3 p, vec2 open) {
    float footprint = length(fwidth(p));
    float depth = depth_of(p);
    vec3 sea = sea_light_at(depth);
    float facing = clamp(dot(normal, view.sun), 0.0, 1.0);
    float gain = facing * open.g > 0.0 ? caustic_gain(p, depth, footprint) : 1.0;
    vec3 sun = view.sun_color * sea * (facing * gain * open.g);
    return albedo * (sun + ambient_light(normal, sea, SAND_DARK) * open.r);
}
