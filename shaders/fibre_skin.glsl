// A fibre's skin, lit pixel by pixel. With TEXTURED its material's texture lies over it: once around, once
// from root to tip.

#include "view.glsl"
#include "fibre.glsl"
#include "water.glsl"
#include "caustics.glsl"
#include "hash.glsl"
#include "light.glsl"
#include "tissue.glsl"
#include "shown.glsl"

layout(location = 0) in vec4 normal_along;
layout(location = 1) in vec4 circle_radius_half; // w: half the true width [px]
layout(location = 2) flat in uvec3 look;
layout(location = 3) in float edge; // distance from the middle of a ribbon [px]; 0: a tube

layout(location = 0) out vec4 color;

#ifdef TEXTURED
#define TEXTURES 2
#include "textures.glsl"
#endif

layout(constant_id = 2) const uint FRINGE = 0u; // 1: only what hides nothing

layout(set = 0, binding = 1, scalar) readonly buffer Materials { Material materials[]; };

void main() {
    // A ribbon's edge fades: it moves without a step, and does not crawl.
    float half_px = circle_radius_half.w;
    float covered = edge == 0.0 ? min(2.0 * half_px, 1.0) : covered_share(half_px, abs(edge), EDGE);
    if (edge != 0.0 && (covered < HIDES) != (FRINGE != 0u)) discard;

    Material m = materials[look.x & 0xffffffu];
    float w = normal_along.w * 2.0;
    Surface s;
    s.normal = normalize(normal_along.xyz);
    s.along = min(w, 1.0);
    s.disc = max(w - 1.0, 0.0);
    s.circle = circle_radius_half.xy;
    s.radius_cm = circle_radius_half.z;
    vec2 chain_tissue = unpackHalf2x16(look.z);
    s.chain = chain_tissue.x;
    s.tissue_cm = s.radius_cm * chain_tissue.y;

    vec3 p = pixel_ray(gl_FragCoord.xy) * (1.0 / gl_FragCoord.w);
    // A ribbon's normals stop at .8 of its half width, so that light follows them evenly; a tube's edge is
    // seen at grazing angles.
    float out_of = min(abs(edge) / (half_px + EDGE), 1.0);
    float cosine = clamp(dot(s.normal, normalize(-p)), 0.0, 1.0);
    bool round = edge != 0.0 && (look.x >> 24 & FLAG_BLADE) == 0u;
    s.grazing = 1.0 - (round ? sqrt(1.0 - out_of * out_of) : cosine);
    s.skin = vec4(0.0);
#ifdef TEXTURED
    // How much of it a pixel is comes from the fibre's size: differences between pixels are wrong where the
    // texture begins anew around the fibre.
    float side = min(6.2831853 * s.radius_cm * 0.01, s.chain);
    float around = atan(s.circle.y, s.circle.x) * 0.15915494 + 0.5;
    vec4 found = texel_of(m.texture, vec2(around, 1.0 - s.along), log2(pixel_at(p) / max(side, 1e-6)));
    s.skin = m.texture == 0u ? s.skin : found;
#endif
    vec3 light = tissue_light(m, look.x >> 24, look.y, s, p);
    float alpha = clamp(m.base.a * covered, 0.0, 1.0);
    color = written(through_water(light, p), alpha, gl_FragCoord.xy);
}
