#version 460
#extension GL_GOOGLE_include_directive : require
// A sprite's texture (linear light times coverage), lit, behind its fog, soft where something stands close
// behind it.

#include "view.glsl"
#include "shown.glsl"

layout(set = 0, binding = 2) uniform sampler2DArray layers;
layout(set = 0, binding = 3) uniform sampler2D depths;

layout(location = 0) in vec2 uv;
layout(location = 1) flat in vec3 light;
layout(location = 2) flat in vec4 fog;
layout(location = 3) flat in vec2 layer;

layout(location = 0) out vec4 color;

void main() {
    vec4 texel = texture(layers, vec3(uv, layer.x));
    // Reversed depth: the near plane's distance over the distance.
    float behind = view.forward.w / max(texelFetch(depths, ivec2(gl_FragCoord.xy), 0).r, 1e-7);
    float soft = clamp((behind - 1.0 / gl_FragCoord.w) * layer.y, 0.0, 1.0);
    color = veil(vec4(light * texel.rgb + fog.rgb * texel.a, fog.a * texel.a)) * soft;
}
