#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// A boulder at low quality: water and caustics' strength at the vertices.

#include "view.glsl"
#include "water.glsl"
#include "caustics.glsl"
#include "light.glsl"
#include "ground_low.glsl"

layout(location = 0) in vec3 position;
layout(location = 1) in vec4 normal_buried; // w: height above the ground [m], scaled by 4 and clamped
layout(location = 2) in float sunlit;       // share of the sun's light that nothing keeps away

layout(location = 0) out vec4 out_normal_buried;
layout(location = 1) out vec3 out_caustics;
layout(location = 2) out vec3 out_through;
layout(location = 3) out vec3 out_added;
layout(location = 4) out vec2 out_entry;
layout(location = 5) out float out_sunlit;

layout(push_constant, scalar) uniform RockPush {
    vec3 origin; // in eye space
} push;

void main() {
    vec3 p = position + push.origin;
    Haze haze = haze_at(p);
    out_normal_buried = normal_buried;
    out_sunlit = sunlit;
    out_caustics = caustics_at(p);
    out_entry = entry_at(p);
    out_through = haze.through;
    out_added = haze.added;
    gl_Position = view.clip_from_eye * vec4(p, 1.0);
}
