#version 460
#extension GL_GOOGLE_include_directive : require
// The background, where nothing else was drawn.

#include "view.glsl"
#include "water.glsl"
#include "sky.glsl"
#include "shown.glsl"

layout(location = 0) out vec4 color;

void main() {
    vec3 light = background(normalize(pixel_ray(gl_FragCoord.xy)));
    color = written(view.beam.w > 0.5 ? view.plain.rgb : light, 1.0, gl_FragCoord.xy);
}
