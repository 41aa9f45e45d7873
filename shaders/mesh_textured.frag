#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// A mesh, where some material has a texture.

#define TEXTURED
#include "mesh_skin.glsl"
