// What lies behind everything: the water's own light, and the surface seen from below.

/// Light from an endless view ray.
vec3 background(vec3 direction) {
    float depth = view.scattered.w - view.eye.y;
    if (direction.y <= 0.02 || depth <= 0.0) return scattered_light(direction, 1e4);
    float distance = min(depth / direction.y, 400.0);
    // The surface's slope where the ray meets it.
    vec2 x = direction.xz * distance;
    vec2 slope = vec2(0.0);
    float bend = 0.0;
    for (int i = 0; i < 4; i++) {
        vec4 w = view.wave[i];
        float s = dot(w.xy, x) + w.w + bend;
        bend = 0.8 * sin(s);
        float k2 = max(dot(w.xy, w.xy), 1e-8);
        slope += w.xy * (w.z / k2 * cos(s));
    }
    vec3 n = normalize(vec3(-slope.x, 1.0, -slope.y) * vec3(1.6, 1.0, 1.6));
    float c = clamp(dot(direction, n), 0.0, 1.0);
    // Total reflection beyond 48.6 degrees from the normal: the window's rim is as ragged as the waves.
    float sine = 1.33 * sqrt(max(1.0 - c * c, 0.0));
    float inside = 1.0 - smoothstep(0.93, 1.03, sine);
    vec3 below = scattered_light(vec3(direction.x, -direction.y, direction.z), 1e4);
    vec3 sky = view.ambient.rgb * vec3(1.05, 1.28, 1.30);
    vec3 refracted = normalize(direction - n * (c - sqrt(max(1.0 - sine * sine, 0.0))) * 0.35);
    float disc = smoothstep(0.990, 0.9985, dot(refracted, view.sun.xyz));
    vec3 surface = mix(below * 1.15, sky + view.sun_color.rgb * (6.0 * disc), inside);
    // Facets that lean toward the light sparkle even outside of the window.
    float glint = clamp(dot(slope, -view.sun.xz) * 2.2 + 0.1, 0.0, 1.0);
    surface += view.sun_color.rgb * (0.10 * glint * glint);
    return surface * exp(-view.beam.rgb * distance) + scattered_light(direction, distance);
}
