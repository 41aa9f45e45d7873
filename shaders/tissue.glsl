// Soft tissue: a gradient from base to tip, a pattern, light that wraps round and shines through, a rim.
// Needs view.glsl, water.glsl, caustics.glsl, hash.glsl and light.glsl.

// reef_material, 32 words.
struct Material {
    vec4 base;
    vec4 tip;
    vec4 accent;
    uint pattern;
    uint texture;       // its handle; 0: none
    float pattern_scale;
    float pattern_softness;
    float translucency;
    float wrap;
    float rim;
    float glow;
    float roughness;
    float specular;     // reflectance at normal incidence
    float spare[10];
};

/// A place on a fibre's surface.
struct Surface {
    vec3 normal;     // unit
    float along;     // 0 root, 1 last node
    float disc;      // 0 before the cap, 1 at its end
    vec2 circle;     // cosine and sine of the angle around the fibre
    float radius_cm;
    float tissue_cm; // that light crosses
    float grazing;   // 1 - cosine of the angle between the normal and the line of sight
    float chain;     // length of the fibre [m]
    vec4 skin;       // a texture's linear light times coverage, and coverage
};

/// Bits of the patterns that the picture's materials use; the others are not compiled in.
layout(constant_id = 1) const uint PATTERNS = 30u;

/// Share of the accent colour, 0..1. `place`: on the skin, unrolled to metres.
float pattern_share(Material m, float along, vec2 circle, vec3 place, float phase, uint seed) {
    float soft = max(m.pattern_softness, 0.04);
    float share = m.accent.a;
    if ((PATTERNS & 1u << REEF_PATTERN_SPOTS) != 0u && m.pattern == REEF_PATTERN_SPOTS) {
        // Round spots: one per cell, jittered.
        vec3 p = place * m.pattern_scale + phase;
        vec3 cell = floor(p);
        float nearest = 8.0;
        for (int i = 0; i < 8; i++) {
            vec3 c = cell + vec3(i & 1, i >> 1 & 1, i >> 2) - step(fract(p), vec3(0.5));
            ivec3 k = ivec3(c);
            vec3 center = c + 0.5 + 0.5 * (vec3(hash_cell(k, seed), hash_cell(k, seed ^ 0x51u), hash_cell(k, seed ^ 0xa3u)) - 0.5);
            nearest = min(nearest, distance(center, p));
        }
        float size = 0.62 * sqrt(share);
        return 1.0 - smoothstep(size * (1.0 - soft), size * (1.0 + soft), nearest);
    }
    if ((PATTERNS & 1u << REEF_PATTERN_BANDS) != 0u && m.pattern == REEF_PATTERN_BANDS) {
        float x = fract(along * m.pattern_scale + 0.35 * float(seed & 255u) / 255.0 * 0.3 + phase);
        float d = abs(x - 0.5) * 2.0;
        return smoothstep(1.0 - share - soft * 0.5, 1.0 - share + soft * 0.5, d);
    }
    if ((PATTERNS & 1u << REEF_PATTERN_STRIPES) != 0u && m.pattern == REEF_PATTERN_STRIPES) {
        float x = fract(atan(circle.y, circle.x) * 0.15915494 * m.pattern_scale + 0.5 + phase);
        float d = abs(x - 0.5) * 2.0;
        return 1.0 - smoothstep(share - soft * 0.5, share + soft * 0.5, d);
    }
    if ((PATTERNS & 1u << REEF_PATTERN_BLOTCHES) != 0u && m.pattern == REEF_PATTERN_BLOTCHES) {
        vec3 p = place * m.pattern_scale + phase;
        float n = 0.65 * value_noise(p, seed) + 0.35 * value_noise(p * 2.3, seed ^ 0x77u);
        float at = mix(0.72, 0.28, share);
        return smoothstep(at - soft * 0.2, at + soft * 0.2, n);
    }
    return 0.0;
}

/// Light that leaves a place on tissue of the colour `albedo` toward the eye. `tissue_cm`: what light
/// crosses; `open`: share of the light that neighbours leave; `rim`: how much it is seen at a grazing angle;
/// `glow`: emitted; `sheet`, the same wherever a shader calls it: the other side is near and lit, too.
vec3 lit_tissue(Material m, vec3 albedo, vec3 normal, float tissue_cm, float open, float rim, float glow, bool sheet, vec3 p) {
    vec3 to_eye = normalize(-p);
    float depth = depth_of(p);
    vec3 sea = sea_light_at(depth);
    vec3 light = view.sun;
    float wrap = m.wrap;
    float facing = dot(normal, light);
    float lambert = clamp((facing + wrap) / (1.0 + wrap), 0.0, 1.0);
    float caustic = 1.0;
    if (HIGH != 0u && facing > 0.0) caustic = mix(1.0, caustic_gain(p, depth, length(p) / view.pixels_per_metre), clamp(facing * 2.0, 0.0, 1.0));
    vec3 sun = view.sun_color * sea;
    vec3 ground = vec3(0.62, 0.52, 0.38);

    // What shines through is not thrown back.
    float thin = m.translucency * exp(-2.0 * tissue_cm);
    vec3 result = albedo * sun * (lambert * caustic * mix(open, 1.0, 0.25) * (1.0 - 0.4 * thin));
    result += albedo * ambient_light(normal, sea, ground) * open;

    // Light through the tissue: of the sun, the more of it the nearer the line of sight comes to it, and of
    // the bright window above. What comes through has crossed the tissue and has more of its colour.
    vec3 sight = -to_eye;
    float upward = 0.5 + 0.5 * sight.y;
    float peak = max(max(albedo.r, albedo.g), max(albedo.b, 1e-3));
    vec3 tint = albedo * sqrt(albedo / peak);
    // A wide lobe: the sun stands high, and whoever looks at a tentacle or a leaf looks past it.
    float toward = 0.5 + 0.5 * dot(sight, normalize(light + normal * 0.3));
    toward *= toward * toward;
    float share = 10.0 * toward / (1.0 + 2.0 * toward) + 0.1;
    // What falls on the back of a sheet is spread on its way.
    if (sheet) share = 0.5 * share + clamp((wrap - facing) / (1.0 + wrap), 0.0, 1.0);
    vec3 through = sun * share + view.ambient * sea * (3.0 * upward * upward);
    result += tint * through * (thin * open);

    // A rim of the water that is behind it.
    vec3 water = view.scattered * sea * from_above(sight) * toward_sun(sight);
    result += water * (rim * (1.0 - view.diagram) * m.rim * open);
    result += albedo * glow;
    return result;
}

/// Light that leaves the point `p` in eye space toward the eye. `flags`: FLAG_CAP, FLAG_BLADE.
vec3 tissue_light(Material m, uint flags, uint variation, Surface s, vec3 p) {
    bool foot = (flags & FLAG_CAP) != 0u;
    // Colour.
    float tip = smoothstep(m.tip.a, 1.0, s.along);
    vec3 albedo = mix(m.base.rgb, m.tip.rgb, tip);
    if (m.pattern != REEF_PATTERN_NONE) {
        vec3 place = vec3(s.circle * (s.radius_cm * 0.01), s.along * s.chain);
        float share = pattern_share(m, s.along, s.circle, place, 0.0, variation);
        if (foot) share *= 1.0 - smoothstep(0.0, 0.1, s.disc);
        albedo = mix(albedo, m.accent.rgb, share);
    }
    albedo = albedo * (1.0 - s.skin.a) + s.skin.rgb;
    float v1 = float(variation & 255u) / 255.0 - 0.5;
    float v2 = float(variation >> 8 & 255u) / 255.0 - 0.5;
    albedo *= 1.0 + 0.22 * v1;
    albedo = max(mix(vec3(dot(albedo, vec3(0.30, 0.55, 0.15))), albedo, 1.0 + 0.3 * v2), 0.0);

    // Light that neighbours take away: deep between the tentacles, at the foot's base, in the mouth.
    float open = foot ? mix(0.55, 1.0, smoothstep(0.0, 0.25, s.along)) * mix(1.0, 0.62, smoothstep(0.7, 1.0, s.along))
                      : mix(0.38, 1.0, smoothstep(0.0, 0.65, s.along));
    if (foot && s.disc > 0.0) {
        float rays = 0.5 + 0.5 * cos(atan(s.circle.y, s.circle.x) * 24.0);
        albedo *= 1.0 - 0.16 * rays * smoothstep(0.1, 0.4, s.disc) * (1.0 - smoothstep(0.8, 0.9, s.disc));
        open *= 1.0 - 0.75 * smoothstep(0.86, 0.97, s.disc);
    }

    // A diagram has no sea: it is lit evenly, so that every part can be read.
    open = mix(open, 1.0, 0.7 * view.diagram);
    float rim = s.grazing * s.grazing;
    rim *= foot ? rim : 1.3;
    return lit_tissue(m, albedo, s.normal, s.tissue_cm, open, rim, m.glow * tip, false, p);
}
