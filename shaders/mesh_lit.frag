#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// A mesh that is lit at its vertices.

#include "fibre.glsl"
#include "mesh.glsl"
#include "tone.glsl"
#include "mesh_share.glsl"

layout(location = 0) noperspective in vec4 shown;
layout(location = 1) flat in vec2 shares;
layout(location = 2) noperspective in vec2 across; // of what is thin: from its row's middle, half its width [px]

layout(constant_id = 6) const uint FADES = 0u;

layout(location = 0) out vec4 color;

void main() {
    if (!has_pixel(shares, gl_FragCoord.xy)) discard;
    float alpha = FADES != 0u ? thin_share(across, LIT_EDGE) : shown.a;
    color = vec4(shown.rgb + (dither(gl_FragCoord.xy) - 0.5) / 255.0, alpha);
}
