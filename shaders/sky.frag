#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// The background, where nothing else was drawn.

#include "view.glsl"
#include "water.glsl"
#include "sky.glsl"
#include "shown.glsl"

layout(location = 0) out vec4 color;

void main() {
    vec3 light = background(normalize(pixel_ray(gl_FragCoord.xy)));
    color = written(mix(light, view.plain, in_diagram()), 1.0, gl_FragCoord.xy);
}
