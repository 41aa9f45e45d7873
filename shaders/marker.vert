#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// What stands for something that has no body: a ball, or an arrow along a vector. Both are surfaces of
// revolution.

#include "tone.glsl"
#include "view.glsl"

struct Marker {
    vec3 from;  // eye space: the ball's middle, the arrow's tail [m]
    float radius; // of the ball or of the arrow's shaft [m]
    vec3 along; // from the tail to the point [m]; zero: a ball
    uint color; // sRGB 0xAABBGGRR
};
layout(set = 0, binding = 1, scalar) readonly buffer Markers { Marker markers[]; };

layout(location = 0) out vec3 out_color;
layout(location = 1) out vec3 out_normal;
layout(location = 2) out vec3 out_at; // eye space

// Radius and length of an arrow's head, in radii of its shaft.
const float HEAD_RADIUS = 2.6;
const float HEAD_LENGTH = 7.0;

void main() {
    Marker m = markers[gl_InstanceIndex];
    int quad = gl_VertexIndex / 6;
    int corner = gl_VertexIndex % 6;
    int ring = quad / MARKER_SIDES;
    int over = corner == 1 || corner == 3 || corner == 4 ? 1 : 0;
    int up = corner == 2 || corner == 4 || corner == 5 ? 1 : 0;
    float turn = float(quad % MARKER_SIDES + over) * (6.28318531 / float(MARKER_SIDES));

    float size = length(m.along);
    vec3 axis = size > 0.0 ? m.along / size : vec3(0.0, 1.0, 0.0);
    vec3 side = normalize(cross(axis, abs(axis.y) < 0.9 ? vec3(0.0, 1.0, 0.0) : vec3(1.0, 0.0, 0.0)));
    vec3 outward = side * cos(turn) + cross(axis, side) * sin(turn);

    // A ball: from pole to pole.
    float latitude = float(ring + up) * (3.14159265 / float(MARKER_RINGS));
    vec2 ball = vec2(sin(latitude), -cos(latitude)) * m.radius;
    vec2 ball_normal = vec2(sin(latitude), -cos(latitude));

    // An arrow: end of the shaft, shaft, back of the head, head; the other rings have no area.
    float head = min(HEAD_LENGTH * m.radius, 0.6 * size);
    float wide = head * (HEAD_RADIUS / HEAD_LENGTH);
    float radii[5] = float[](0.0, m.radius, m.radius, wide, 0.0);
    float heights[5] = float[](0.0, 0.0, size - head, size - head, size);
    int at = min(ring + up, 4);
    vec2 arrow = vec2(radii[at], heights[at]);
    vec2 back = vec2(0.0, -1.0);
    vec2 slope = normalize(vec2(HEAD_LENGTH, HEAD_RADIUS));
    vec2 arrow_normal = ring == 1 ? vec2(1.0, 0.0) : ring < 3 ? back : slope;

    bool round = size <= 0.0;
    vec2 place = round ? ball : arrow;
    vec2 normal = round ? ball_normal : arrow_normal;
    vec3 p = m.from + outward * place.x + axis * place.y;
    gl_Position = view.clip_from_eye * vec4(p, 1.0);
    out_at = p;
    out_normal = outward * normal.x + axis * normal.y;
    out_color = srgb_decode(unpackUnorm4x8(m.color).rgb);
}
