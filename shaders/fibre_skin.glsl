// A fibre's skin, lit pixel by pixel. With TEXTURED its material's texture lies over it: once around, once from root to tip.

#include "view.glsl"
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
layout(set = 0, binding = 2) uniform sampler2DArray layers;
#endif

layout(constant_id = 2) const uint FRINGE = 0u; // 1: only what covers less than half of a pixel

layout(set = 0, binding = 1, std430) readonly buffer Materials { Material materials[]; };

void main() {
    // A ribbon's edge falls from inside to outside of a pixel that it cuts: it moves without a step, and does not crawl.
    // What covers half of a pixel or more comes first and hides what is behind; what covers less comes last and hides nothing.
    float half_px = circle_radius_half.w;
    float covered = clamp(half_px + 0.5 - abs(edge), 0.0, min(2.0 * half_px, 1.0));
    if (edge != 0.0 && (covered < 0.5) != (FRINGE != 0u)) discard;

    Material m = materials[look.x & 0xffffffu];
    float w = normal_along.w * 2.0;
    Surface s;
    s.normal = normalize(normal_along.xyz);
    s.along = min(w, 1.0);
    s.disc = max(w - 1.0, 0.0);
    s.circle = circle_radius_half.xy;
    s.radius_cm = circle_radius_half.z;
    s.chain = uintBitsToFloat(look.z);

    vec3 p = pixel_ray(gl_FragCoord.xy) * (1.0 / gl_FragCoord.w);
    s.skin = vec4(0.0);
#ifdef TEXTURED
    // The level by the size of a texel: differences between pixels are wrong where the texture begins anew around the fibre.
    float texel = min(6.2831853 * s.radius_cm * 0.01, s.chain) / float(textureSize(layers, 0).x);
    float level = log2(max(pixel_at(p) / max(texel, 1e-6), 1.0));
    float around = atan(s.circle.y, s.circle.x) * 0.15915494 + 0.5;
    vec4 found = textureLod(layers, vec3(around, 1.0 - s.along, float(m.layer)), level);
    s.skin = m.layer == 0u ? s.skin : found;
#endif
    vec3 light = tissue_light(m, look.x >> 24, look.y, s, p);
    float alpha = clamp(m.base.a * covered, 0.0, 1.0);
    color = written(through_water(light, p), alpha, gl_FragCoord.xy);
}
