#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// A mesh that is lit at its vertices.

#include "tone.glsl"
#include "mesh_share.glsl"

layout(location = 0) noperspective in vec4 shown;
layout(location = 1) flat in vec2 shares;

layout(location = 0) out vec4 color;

void main() {
    if (!has_pixel(shares, gl_FragCoord.xy)) discard;
    color = vec4(shown.rgb + (dither(gl_FragCoord.xy) - 0.5) / 255.0, shown.a);
}
