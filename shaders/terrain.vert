#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// The sea bed.

#include "view.glsl"
#define QUADS TILE_QUADS_HIGH
#include "tile.glsl"

layout(location = 0) out vec2 out_slope;

void main() {
    gl_Position = view.clip_from_eye * vec4(tile_vertex(out_slope), 1.0);
}
