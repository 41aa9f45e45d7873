// The colours of a boulder: coralline crusts where it is shaded, turf on top, sand where it meets the ground.
// Needs view.glsl and light.glsl.

const vec3 ROCK = vec3(0.147, 0.122, 0.098);
const vec3 CORALLINE = vec3(0.434, 0.092, 0.195);
const vec3 TURF = vec3(0.156, 0.195, 0.042);

/// Colour of a boulder with the unit normal `n`. `t`: coarse noise, `detail`: fine noise, `above`: height
/// above the ground [m]. `open`: share of the water around that it sees.
vec3 boulder(vec3 n, vec4 t, float detail, float above, out float open) {
    float up = n.y * 0.5 + 0.5;
    vec3 albedo = ROCK * (0.75 + 0.9 * t.r) * (0.8 + 0.4 * detail);
    float shaded = 1.0 - clamp(dot(n, view.sun) * 1.3 + 0.35, 0.0, 1.0);
    float crust = smoothstep(0.52, 0.60, t.a * 0.7 + detail * 0.22 + shaded * 0.40 - 0.12);
    albedo = mix(albedo, CORALLINE * (0.55 + 0.7 * t.r) * (0.75 + 0.5 * detail), crust * 0.85);
    float turf = smoothstep(0.66, 0.92, up) * smoothstep(0.40, 0.60, t.r * 0.55 + detail * 0.5);
    albedo = mix(albedo, TURF * (0.35 + 1.1 * detail), turf * 0.75);

    float sandy = 1.0 - smoothstep(0.0, 0.03 + 0.05 * max(n.y, 0.0), above + (t.a - 0.5) * 0.05);
    albedo = mix(albedo, mix(SAND_DARK, SAND_LIGHT, t.r), sandy * 0.9);

    open = mix(0.42, 1.0, smoothstep(0.0, 0.30, above)) * mix(0.55, 1.0, smoothstep(0.1, 0.6, up));
    open *= 0.75 + 0.5 * (t.r - 0.25);
    return albedo;
}
