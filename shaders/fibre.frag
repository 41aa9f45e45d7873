#version 460
#extension GL_GOOGLE_include_directive : require
// A fibre's skin.

#include "fibre_skin.glsl"
