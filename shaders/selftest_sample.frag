#version 460
// Self-test: the texture's pixel at the same place of the picture.

layout(location = 0) in vec2 place;
layout(location = 0) out vec4 color;
layout(set = 0, binding = 0) uniform sampler2D picture;

void main() {
    color = texelFetch(picture, ivec2(gl_FragCoord.xy), 0);
}
