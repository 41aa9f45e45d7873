// What lies behind everything: the water's own light, and the surface seen from below.
//
// Where the view ray meets the surface, the waves' slope there says what is seen: within the window (48.6
// degrees from the surface's normal) the sky, refracted, as much of it as Fresnel's law lets through; beyond
// it the water below, mirrored.

#define INDEX 1.33

/// Height and slope (x, z) of the surface at `x` (x, z in eye space), without the waves that are smaller than
/// `footprint` [m]; w: mean square of the slopes that were left out.
vec4 surface_at(vec2 x, float footprint) {
    const int count = HIGH != 0u ? SURFACE_WAVES : 4;
    vec4 sum = vec4(0.0);
    for (int i = 0; i < count; i++) {
        SurfaceTrain w = view.surface[i];
        float k2 = dot(w.vector, w.vector);
        float seen = exp(-0.35 * k2 * footprint * footprint);
        float phase = dot(w.vector, x) + w.phase;
        sum.x += w.amplitude * seen * sin(phase);
        sum.yz += w.vector * (w.amplitude * seen * cos(phase));
        sum.w += 0.5 * k2 * w.amplitude * w.amplitude * (1.0 - seen * seen);
    }
    return sum;
}

/// The sky over the sea.
vec3 sky_light(vec3 direction, float rough) {
    float up = clamp(direction.y, 0.0, 1.0);
    // Pale at the horizon, deeper overhead.
    vec3 sky = view.ambient * mix(vec3(2.30, 2.32, 2.10), vec3(1.30, 1.60, 1.68), sqrt(up));
    // The sun above the water, from where it stands below; rough water spreads its disc and keeps its light.
    vec3 sun = normalize(vec3(view.sun.x * INDEX, sqrt(max(1.0 - INDEX * INDEX * (1.0 - view.sun.y * view.sun.y), 0.0)), view.sun.z * INDEX));
    float away = max(1.0 - dot(direction, sun), 0.0);
    float width = 0.0009 + 0.35 * rough;
    float disc = exp(-away / width) * min(0.012 / width, 9.0);
    float halo = 0.5 * exp(-away * 26.0);
    return sky + view.sun_color * (disc + halo);
}

/// Light that comes back down from the surface in a direction: that of the water below it, down to the bed.
vec3 mirrored_light(vec3 direction) {
    float down = max(-direction.y, 0.02);
    float distance = view.bed_depth / down;
    vec3 k = view.beam + view.downwelling * down;
    vec3 water = view.scattered * toward_sun(direction) * from_above(direction) * (view.beam / k);
    vec3 sand = vec3(0.62, 0.54, 0.40) * (view.sun_color * view.sun.y + view.ambient) * sea_light_at(view.bed_depth);
    return water * (1.0 - exp(-k * distance)) + sand * exp(-view.beam * distance);
}

/// Light from an endless view ray.
vec3 background(vec3 direction) {
    float depth = view.surface_height - view.eye.y;
    if (direction.y <= 0.02 || depth <= 0.0) return scattered_light(direction, 1e4);
    float distance = min(depth / direction.y, 400.0);
    // A pixel's length on the surface, along the ray.
    float footprint = distance / (view.pixels_per_metre * direction.y);
    if (HIGH != 0u && all(lessThan(vec2(depth, distance), vec2(2.0, 400.0)))) {
        // Near the surface the waves' height moves the place where the ray meets it.
        float height = surface_at(direction.xz * distance, footprint).x;
        distance = clamp((depth + height) / direction.y, 0.0, 400.0);
    }
    vec4 surface = surface_at(direction.xz * distance, footprint);
    vec3 n = normalize(vec3(-surface.y, 1.0, -surface.z));
    float c = clamp(dot(direction, n), 0.01, 1.0);
    float sine = INDEX * sqrt(max(1.0 - c * c, 0.0));
    float cosine = sqrt(max(1.0 - sine * sine, 0.0));
    float s = (INDEX * c - cosine) / (INDEX * c + cosine);
    float p = (c - INDEX * cosine) / (c + INDEX * cosine);
    // Waves that a pixel does not tell apart blur the rim.
    float blur = 0.015 + 1.5 * sqrt(surface.w);
    float through = (1.0 - 0.5 * (s * s + p * p)) * (1.0 - smoothstep(1.0 - blur, 1.0 + 0.3 * blur, sine));
    vec3 refracted = normalize(direction * INDEX + n * (cosine - INDEX * c));
    vec3 above = sky_light(refracted, surface.w);
    vec3 below = mirrored_light(direction - 2.0 * n * c);
    return mix(below, above, through) * exp(-view.beam * distance) + scattered_light(direction, distance);
}
