#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// The sea bed at low quality: water and caustics' strength at the vertices.

#include "view.glsl"
#define QUADS TILE_QUADS_LOW
#include "tile.glsl"
#include "water.glsl"
#include "caustics.glsl"
#include "light.glsl"
#include "ground_low.glsl"

layout(location = 0) out vec2 out_slope;
layout(location = 1) out vec3 out_caustics;
layout(location = 2) out vec3 out_through;
layout(location = 3) out vec3 out_added;
layout(location = 4) out vec2 out_entry;

void main() {
    vec3 p = tile_vertex(out_slope);
    Haze haze = haze_at(p);
    out_caustics = caustics_at(p);
    out_entry = entry_at(p);
    out_through = haze.through;
    out_added = haze.added;
    gl_Position = view.clip_from_eye * vec4(p, 1.0);
}
