#version 460
// The share of each pixel that a square as wide as the speck covers: its light is the same wherever it stands
// between the pixels, so that it does not twinkle when it moves.

layout(location = 0) flat in vec4 speck;
layout(location = 1) flat in vec3 middle; // [px]; z: half its width and half a pixel

layout(location = 0) out vec4 color;

void main() {
    vec2 covered = clamp(middle.z - abs(gl_FragCoord.xy - middle.xy), 0.0, 1.0);
    color = speck * (covered.x * covered.y);
}
