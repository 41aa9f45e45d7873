// Numbers that Rust and the shaders share, as host/render/src/shared.rs has them. Written by `cargo xtask
// shaders`; do not edit.

#ifndef SHARED
#define SHARED

#define REEF_PATTERN_NONE 0u
#define REEF_PATTERN_SPOTS 1u
#define REEF_PATTERN_BANDS 2u
#define REEF_PATTERN_STRIPES 3u
#define REEF_PATTERN_BLOTCHES 4u
#define WAVES 8
#define SURFACE_WAVES 12
#define LONG_REACH 1.5
#define TILE_SIDES 3.0
#define TILE_QUADS_LOW 4
#define TILE_QUADS_HIGH 8
#define MARKER_SIDES 28
#define MARKER_RINGS 14
#define NOT_DRAWN 4294967295u
#define RINGS 16
#define RING_LEVELS 3
#define RIBBON_ERRORS 6.0
#define THIN_RADIUS 0.75
#define EDGE 0.75
#define LIT_EDGE 0.5
#define FLAG_CAP 2u
#define FLAG_BLADE 4u
#define LIT_RIBBON 65536u
#define THIN 131072u
#define MESH_DUAL 1u
#define MESH_TWO_SIDED 2u
#define DRAWN_ANEW 1u
#define RIGID 2u
#define VEIL 4u
#define FAR_SIDE 8u
#define PLAIN 16u
#define SMOOTH 32u
#define LIT_VEIL 64u
#define CUT_OUT 128u
#define LEFT_OUT 256u
#define BINS 8u
#define BIN_LIT 0u
#define BIN_PIXEL 2u
#define BIN_VEIL 4u
#define BIN_LIT_VEIL 5u
#define BIN_THIN 6u
#define BIN_LIT_THIN 7u
#define THIN_HALF 1.0
#define NO_ROW 100.0
#define SMOOTH_LIT 4.0
#define BAND 1.15

#endif
