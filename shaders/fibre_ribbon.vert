#version 460
// A lit ribbon: `fibre_ribbon.comp` did the work. Vertices on its two edges take turns.

layout(location = 0) in vec4 position;
layout(location = 1) in vec4 edge;
layout(location = 2) in vec4 bow;

layout(location = 0) noperspective out vec4 out_edge;
layout(location = 1) noperspective out vec4 out_bow;

void main() {
    gl_Position = position;
    out_edge = edge;
    out_bow = vec4(bow.rgb, (gl_VertexIndex & 1) == 0 ? 1.0 : -1.0);
}
