#version 460
#extension GL_GOOGLE_include_directive : require
// The sea bed.

#include "view.glsl"
#define QUADS 8
#include "tile.glsl"

layout(location = 0) out vec2 out_slope;

void main() {
    gl_Position = view.clip_from_eye * vec4(tile_vertex(out_slope), 1.0);
}
