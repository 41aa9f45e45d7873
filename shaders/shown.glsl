// What a material writes. At high quality that is scene light, for the tone pass to show; at low quality it
// is what the display shows of it, so that no pass over the whole picture has to follow. Needs view.glsl.

#include "tone.glsl"

/// sRGB of 0 to 1 by roots instead of powers: wrong by a tenth of a step of 8 bits at most.
vec3 srgb_by_roots(vec3 c) {
    vec3 a = sqrt(c);
    vec3 b = sqrt(a);
    vec3 d = sqrt(b);
    return max(0.66874592 * a + 0.68352460 * b - 0.32554373 * d - 0.02699924 * c, min(12.92 * c, 0.04045));
}

/// What the display shows of scene light.
vec3 shown(vec3 light) {
    light = max(light * view.exposure, 0.0);
    vec3 toned = neutral_tone(light);
    return srgb_by_roots(mix(toned, min(light, 1.0), in_diagram()));
}

/// What a thing that covers a share `c.a` of a pixel writes: `c.rgb` is its light, times that share.
vec4 veil(vec4 c) {
    if (HIGH != 0u) return c;
    return vec4(shown(c.rgb / max(c.a, 1e-4)) * c.a, c.a);
}

/// The value that a material writes at a pixel.
vec4 written(vec3 light, float alpha, vec2 pixel) {
    if (HIGH != 0u) return vec4(light, alpha);
    return vec4(shown(light) + (dither(pixel) - 0.5) / 255.0, alpha);
}
