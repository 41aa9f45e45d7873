#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// A shaft of light: a strip from the surface down along the sun's rays, turned to the eye about its axis.

#include "view.glsl"

struct Shaft {
    vec2 place;     // x, z where it enters the water, in eye space [m]
    float width;    // [m]
    float strength; // 0..1
};
layout(set = 0, binding = 1, scalar) readonly buffer Shafts { Shaft shafts[]; };

layout(location = 0) out vec2 out_uv; // -1..1 across; 0 at the surface, 1 at the lower end
layout(location = 1) out vec3 out_place;
layout(location = 2) flat out float out_strength;

void main() {
    Shaft shaft = shafts[gl_VertexIndex / 6];
    int corner = int[](0, 1, 2, 2, 1, 3)[gl_VertexIndex % 6];
    float depth = view.surface_height - view.eye.y;
    vec3 top = vec3(shaft.place.x, depth, shaft.place.y);
    vec3 down = -view.sun;
    // They fade with depth; the bed, softly, ends them.
    float reach = min(view.bed_depth * 1.7, 16.0) / view.sun.y;
    vec2 uv = vec2(float(corner & 1) * 2.0 - 1.0, float(corner >> 1));
    vec3 middle = top + down * (reach * uv.y);
    // Across: at right angles to the shaft and to the line of sight to its nearest point.
    vec3 nearest = top + down * clamp(dot(-top, down), 0.0, reach);
    vec3 side = cross(down, nearest);
    side *= inversesqrt(max(dot(side, side), 1e-6));
    // Rays spread a little on their way.
    vec3 p = middle + side * (uv.x * shaft.width * (0.5 + 0.25 * uv.y));
    gl_Position = view.clip_from_eye * vec4(p, 1.0);
    out_uv = uv;
    out_place = p;
    out_strength = shaft.strength;
}
