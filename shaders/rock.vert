#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// A boulder: vertices relative to its own origin.

#include "view.glsl"

layout(location = 0) in vec3 position;
layout(location = 1) in vec4 normal_buried; // w: height above the ground [m], scaled by 4 and clamped
layout(location = 2) in float sunlit;       // share of the sun's light that nothing keeps away

layout(location = 0) out vec4 out_normal_buried;
layout(location = 1) out float out_sunlit;

layout(push_constant, scalar) uniform RockPush {
    vec3 origin; // in eye space
} push;

void main() {
    gl_Position = view.clip_from_eye * vec4(position + push.origin, 1.0);
    out_normal_buried = normal_buried;
    out_sunlit = sunlit;
}
