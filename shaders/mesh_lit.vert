#version 460
// A mesh that is lit at its vertices: the compute passes did the work, `mesh_lit.comp` the last of it.

layout(location = 0) in vec4 position;
layout(location = 1) in vec4 shown;
layout(location = 2) in vec2 shares;
layout(location = 3) in vec2 across;

layout(location = 0) noperspective out vec4 out_shown;
layout(location = 1) flat out vec2 out_shares;
layout(location = 2) noperspective out vec2 out_across;

void main() {
    gl_Position = position;
    out_shown = shown;
    out_shares = shares;
    out_across = across;
}
