#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// A sprite's texture (linear light times coverage), lit, behind its fog, soft where something stands close
// behind it.

#include "view.glsl"
#include "shown.glsl"

#define TEXTURES 3
#include "textures.glsl"

layout(set = 0, binding = 2) uniform sampler2D depths;

layout(location = 0) in vec2 uv;
layout(location = 1) flat in vec3 light;
layout(location = 2) flat in vec4 fog;
layout(location = 3) flat in vec2 handle_soft;

layout(location = 0) out vec4 color;

void main() {
    uint handle = uint(handle_soft.x);
    vec2 across = dFdx(uv);
    vec2 down = dFdy(uv);
    float spread = 0.5 * log2(max(max(dot(across, across), dot(down, down)), 1e-16));
    // Most are small: for these the sampler finds the level by itself.
    vec4 small = texture(textures_64, vec3(uv, float(handle & 0xffffu)));
    vec4 texel = larger_texel(handle, uv, spread, small);
    // Reversed depth: the near plane's distance over the distance.
    float behind = view.near / max(texelFetch(depths, ivec2(gl_FragCoord.xy), 0).r, 1e-7);
    float soft = clamp((behind - 1.0 / gl_FragCoord.w) * handle_soft.y, 0.0, 1.0);
    color = veil(vec4(light * texel.rgb + fog.rgb * texel.a, fog.a * texel.a)) * soft;
}
