#version 460
// Self-test: two triangles that cover the left half of the picture: every pixel whose centre lies at x < 0.

layout(location = 0) out vec2 place;

void main() {
    // Two triangles of the quad [-1, 0] x [-1, 1].
    vec2 corners[6] = vec2[](vec2(-1, -1), vec2(-1, 1), vec2(0, 1), vec2(-1, -1), vec2(0, 1), vec2(0, -1));
    place = corners[gl_VertexIndex];
    gl_Position = vec4(place, 0.5, 1.0);
}
