// A mesh, lit pixel by pixel. With TEXTURED its material's texture lies over it, by uv.

#include "view.glsl"
#include "fibre.glsl"
#include "mesh.glsl"
#include "water.glsl"
#include "caustics.glsl"
#include "hash.glsl"
#include "light.glsl"
#include "tissue.glsl"
#include "shown.glsl"
#include "mesh_light.glsl"
#include "mesh_share.glsl"

layout(location = 0) in vec3 normal;
layout(location = 1) in vec4 place_u;
layout(location = 2) in vec3 v_thickness_glow;
layout(location = 3) in vec4 root_color;
layout(location = 4) flat in uint part;
layout(location = 5) noperspective in vec2 in_row; // of what is thin: from its row's middle, half its width [px]

layout(location = 0) out vec4 color;

layout(set = 0, binding = 1, scalar) readonly buffer Materials { Material materials[]; };
layout(set = 0, binding = 2, scalar) readonly buffer Instances { Instance instances[]; };
layout(set = 0, binding = 3, scalar) readonly buffer Parts { Part parts[]; };
#ifdef TEXTURED
#define TEXTURES 4
#include "textures.glsl"
#endif

layout(constant_id = 2) const uint TWO_SIDED = 0u;
layout(constant_id = 3) const uint LET_THROUGH = 0u; // a veil
layout(constant_id = 6) const uint FADES = 0u;

void main() {
#ifdef TEXTURED
    // Before pixels are left out: differences need whole quads.
    vec2 across = dFdx(vec2(place_u.w, v_thickness_glow.x));
    vec2 down = dFdy(vec2(place_u.w, v_thickness_glow.x));
    float spread = 0.5 * log2(max(max(dot(across, across), dot(down, down)), 1e-16));
#endif
    if (!has_pixel(unpackUnorm2x16(parts[part].shares), gl_FragCoord.xy)) discard;
    Instance instance = instances[part >> 1];
    Material m = materials[instance.material];
    vec3 p = pixel_ray(gl_FragCoord.xy) * (1.0 / gl_FragCoord.w);
    Skin s;
    s.normal = normalize(normal);
    float facing = dot(s.normal, -p);
    s.normal = TWO_SIDED != 0u && facing < 0.0 ? -s.normal : s.normal;
    s.place = place_u.xyz;
    s.uv = vec2(place_u.w, v_thickness_glow.x);
    s.thickness_cm = v_thickness_glow.y;
    s.glow = v_thickness_glow.z;
    s.color = vec4(root_color.rgb * root_color.rgb, root_color.a);
    s.texture_color = vec4(0.0);
#ifdef TEXTURED
    vec4 found = texel_of(m.texture, vec2(s.uv.x, 1.0 - s.uv.y), spread);
    // Without a texture there is nothing to cut: the dot lies at handle 0.
    bool cut = m.texture != 0u && (instance.flags & CUT_OUT) != 0u;
    if (cut && FADES == 0u && found.a < 0.5) discard;
    float there = cut ? found.a : 1.0;
    found = cut ? vec4(found.rgb / max(found.a, 1e-3), 1.0) : found;
    s.texture_color = m.texture == 0u ? s.texture_color : found;
#endif
    vec3 light = mesh_light(m, instance, s, p);
    float alpha = LET_THROUGH != 0u ? veil_alpha(m, s, facing, p) : 1.0;
#ifdef TEXTURED
    float faded = thin_share(in_row, EDGE) * there;
#else
    float faded = thin_share(in_row, EDGE);
#endif
    alpha = FADES != 0u ? faded : alpha;
    color = written(through_water(light, p), alpha, gl_FragCoord.xy);
}
