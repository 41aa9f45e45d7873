#version 460
#extension GL_GOOGLE_include_directive : require
// A mesh.

#include "mesh_skin.glsl"
