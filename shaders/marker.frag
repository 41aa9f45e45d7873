#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Markers have their own colours, whatever the water: half light from the sun, half from the eye, and a spot
// of gloss.

#include "view.glsl"
#include "shown.glsl"

layout(location = 0) in vec3 marker_color;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 at; // eye space
layout(location = 0) out vec4 color;

void main() {
    vec3 n = normalize(normal);
    vec3 to_eye = -normalize(at);
    vec3 light = normalize(view.sun + to_eye);
    float lit = 0.3 + 0.7 * max(dot(n, light), 0.0);
    float gloss = 0.25 * pow(max(dot(n, normalize(light + to_eye)), 0.0), 40.0);
    color = written(marker_color * lit + gloss, 1.0, gl_FragCoord.xy);
}
