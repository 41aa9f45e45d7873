#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Forces and moments, drawn over the sea in their own colours.

#include "view.glsl"
#include "shown.glsl"

layout(location = 0) in vec4 line_color;
layout(location = 1) in float edge;
layout(location = 0) out vec4 color;

layout(push_constant, scalar) uniform LinePush {
    float width; // [px]
} push;

void main() {
    float cover = clamp(push.width * 0.5 + 0.5 - abs(edge), 0.0, 1.0);
    color = written(line_color.rgb, line_color.a * cover, gl_FragCoord.xy);
}
