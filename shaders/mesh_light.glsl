// The light of a mesh. Needs mesh.glsl and what tissue.glsl needs.

/// A place on a mesh.
struct Skin {
    vec3 normal;       // unit, toward the eye where the mesh is two-sided
    vec3 place;        // at rest [m]
    vec2 uv;           // around, from root to tip
    float thickness_cm;
    float glow;
    vec4 color;        // linear; a: opacity
    vec4 texture_color;// linear light times coverage, and coverage
};

/// Turns the hue by an angle: about the axis of greys.
vec3 turned_hue(vec3 color, float angle) {
    float c = cos(angle);
    vec3 axis = vec3(0.57735027);
    vec3 turned = color * c + cross(axis, color) * sin(angle) + axis * (dot(axis, color) * (1.0 - c));
    return max(turned, 0.0);
}

/// Whether some material of the picture mirrors light; else that is not compiled in.
layout(constant_id = 5) const uint SHINY = 1u;

/// Share of the light that neighbours in a bed leave at the point `p`.
float bed_open(uint shade, vec3 p) {
    vec2 fade_top = unpackHalf2x16(shade);
    return exp(-fade_top.x * max(fade_top.y - p.y, 0.0));
}

/// Sunlight that a surface mirrors softly toward the eye, as a share of what falls on it: Blinn and Phong,
/// with as much energy as what it reflects.
float mirrored(Material m, vec3 normal, vec3 to_eye) {
    float narrow = 1.0 / max(m.roughness * m.roughness, 0.03);
    float power = 2.0 * narrow * narrow;
    vec3 half_way = normalize(view.sun + to_eye);
    float facing = clamp(dot(normal, view.sun) * 4.0, 0.0, 1.0);
    return m.specular * (power + 8.0) * 0.125 * pow(clamp(dot(normal, half_way), 0.0, 1.0), power) * facing;
}

/// Light that leaves the point `p` in eye space toward the eye.
vec3 mesh_light(Material m, Instance instance, Skin s, vec3 p) {
    float along = clamp(s.uv.y, 0.0, 1.0);
    float tip = smoothstep(m.tip.a, 1.0, along);
    vec3 albedo = mix(m.base.rgb, m.tip.rgb, tip);
    if (m.pattern != REEF_PATTERN_NONE) {
        float angle = s.uv.x * 6.2831853;
        vec2 circle = -vec2(cos(angle), sin(angle));
        albedo = mix(albedo, m.accent.rgb, pattern_share(m, s.uv.y, circle, s.place, instance.phase, 0u));
    }
    albedo = albedo * (1.0 - s.texture_color.a) + s.texture_color.rgb;
    albedo = turned_hue(albedo * s.color.rgb, instance.hue) * (1.0 + instance.value);
    albedo = min(albedo, 1.0);

    vec3 to_eye = normalize(-p);
    float grazing = 1.0 - clamp(dot(s.normal, to_eye), 0.0, 1.0);
    float rim = grazing * grazing;
    float open = bed_open(instance.shade, p);
    vec3 light = lit_tissue(m, albedo, s.normal, s.thickness_cm, open, rim * rim, m.glow * s.glow, true, p);
    if (SHINY != 0u) {
        vec3 sun = view.sun_color * sea_light_at(depth_of(p));
        light += sun * (mirrored(m, s.normal, to_eye) * open);
    }
    return light;
}

/// The share of what is behind a veil that it hides. The way through a sheet is the longer, the more askew it
/// is seen. `facing`: the normal times the way to the eye, either side.
float veil_alpha(Material m, Skin s, float facing, vec3 p) {
    float cosine = max(abs(facing) * inversesqrt(dot(p, p)), 0.15);
    return 1.0 - pow(1.0 - clamp(m.base.a * s.color.a, 0.0, 0.999), 1.0 / cosine);
}
