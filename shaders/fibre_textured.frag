#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// A fibre's skin, where some material has a texture.

#define TEXTURED
#include "fibre_skin.glsl"
