#version 460
#extension GL_GOOGLE_include_directive : require
// The background, where nothing else was drawn.

#include "view.glsl"
#include "water.glsl"
#include "sky.glsl"

layout(location = 0) out vec4 color;

void main() {
    if (view.beam.w > 0.5) {
        color = vec4(view.plain.rgb, 1.0);
        return;
    }
    color = vec4(background(normalize(pixel_ray(gl_FragCoord.xy))), 1.0);
}
