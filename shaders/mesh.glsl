// Records of the mesh passes. Mirrors host/render/src/meshes/records.rs; the functions mirror meshes/twin.rs.

#include "shared.glsl"

/// A mesh that stays on the device.
struct Mesh {
    uint first_vertex;
    uint first_bone;
    uint first_level;
    uint level_count;
    uint first_rest;
    uint joints;
    uint influences;       // words a vertex in the bones
    uint flags;
    vec3 center;           // of what is at rest [m]
    float radius;          // [m]
};

struct Level {
    uint first_index;      // in all indices
    uint triangles;
    uint first_vertex;     // in the mesh
    uint vertices;
    float error;           // [m]
    uint influences;
    float slim;            // half the width of most of its surface [m]
    uint end;              // 0: records are whole texels
};

/// A joint at rest.
struct Rest {
    vec4 rotation;
    vec3 translation;      // [m]
    float scale;
    float reach;           // farthest that a vertex is from it [m]
    uvec3 end;             // 0: records are whole texels
};

/// Where a vertex is in its row: see host/render/src/meshes/rows.rs.
struct RestRow {
    vec3 axis;             // along, unit
    vec3 wide;             // the way of W, unit
    vec2 extent;           // |W|, |M| [m]; both 0: it has no row; M is negative in a ring
    vec2 place;            // along W and along M, in |W|
};

/// A vertex at rest: `MeshVertex` of reef_sim.h in 8 words.
struct RestVertex {
    vec3 position;         // [m]
    uint normal;           // octahedron
    uint uv;               // halves
    float thickness;       // [m]
    float glow;
    uint color;            // roots of linear light, opacity: 8 bits each
};

struct Instance {
    uint object;
    uint mesh;
    uint material;
    uint flags;
    uint previous;         // its first joint or vertex in the step before
    uint current;
    uint joints;           // that move it
    uint palette;          // its first moved joint
    float blend;           // 0: the step before, 1: this step
    float scale;
    float phase;
    float hue;             // [rad]
    float value;
    float fade;
    uint vertices_of;      // the instance whose vertices it draws, itself where it has its own
    uint shade;            // of neighbours, two halves: how fast light fades downward [1/m], from which height on [m]
    vec3 center;           // of what is drawn anew, relative to the object's origin [m]
    float radius;          // [m]
};

/// An instance at one level of detail; each has two, the finer first.
struct Part {
    uint level;            // NOT_DRAWN: none
    uint bin;
    uint first_vertex;     // filled by the scan
    uint first_index;
    vec3 base;             // the object's origin in eye space
    uint shares;           // of the pixels: from, to, 16 bits each
    uint first_rest;       // its level's first vertex, in all vertices at rest
    uint first_bone;       // that vertex's first influence, in all bones
    uint vertices;         // 0: another instance has them
    uint triangles;
    uint how;              // influences that are read, words a vertex in the bones << 8, HOW_...
    uint palette;          // its first moved joint
    float scale;
    uint first_drawn;      // its level's first vertex, in its mesh and so in what is drawn anew
};

#define HOW_DUAL 0x10000u
#define HOW_RIGID 0x20000u
#define HOW_ANEW 0x40000u

#define PART_THREADS 4u     // a part may have four vertices
#define GROUP_PARTS 8u      // so many parts are one workgroup's: to begin one costs a software device as much as a part
#define LIGHT_THREADS 64u

/// Whether what is in a bin is lit at its vertices: the scan puts these first, and the light goes over them.
bool is_lit(uint bin) {
    return bin < BIN_PIXEL || bin == BIN_LIT_VEIL || bin == BIN_LIT_THIN;
}

/// What the scan writes.
struct MeshDraws {
    IndexedDraw commands[BINS];
    Groups groups;         // over the parts that are drawn
    Groups light_groups;   // over the vertices that may be lit by themselves
    uint parts;            // that are drawn, with those that did not fit
    uint vertices;
    uint lit;              // vertices before this may be lit by themselves; none after it is
    uint triangles;
    uint drawn;            // parts that are drawn
    uint left_out;         // parts that did not fit
};

vec3 turned(vec4 q, vec3 v) {
    vec3 t = 2.0 * cross(q.xyz, v);
    return v + q.w * t + cross(q.xyz, t);
}

/// The rotation `a` after the rotation `b`.
vec4 after(vec4 a, vec4 b) {
    return vec4(a.w * b.xyz + b.w * a.xyz + cross(a.xyz, b.xyz), a.w * b.w - dot(a.xyz, b.xyz));
}

/// Share of a pixel that a surface covers, at so many pixels from its row's middle (x) and so many of half
/// its row's width (y; negative: a ring, whose near and far side together cover what it covers).
float thin_share(vec2 across, float edge) {
    float covered = covered_share(abs(across.y), abs(across.x), edge);
    return across.y < 0.0 ? 1.0 - sqrt(1.0 - covered) : covered;
}

/// The unit vector on an octahedron.
vec3 unpacked_normal(uint packed) {
    vec2 a = max(vec2(ivec2(int(packed << 16) >> 16, int(packed) >> 16)) / 32767.0, -1.0);
    float z = 1.0 - abs(a.x) - abs(a.y);
    vec2 low = (1.0 - abs(a.yx)) * mix(vec2(1.0), vec2(-1.0), lessThan(a, vec2(0.0)));
    vec3 n = vec3(z < 0.0 ? low : a, z);
    return n * inversesqrt(dot(n, n));
}
