// Records of the mesh passes. Mirrors host/render/src/meshes/records.rs; the functions mirror meshes/twin.rs.

#define MESH_DUAL 1u       // joints are blended as dual quaternions
#define MESH_TWO_SIDED 2u
#define DRAWN_ANEW 1u      // an instance's vertices come with the step
#define RIGID 2u           // one joint moves all
#define VEIL 4u            // light shines through by opacity: drawn from far to near
#define FAR_SIDE 8u        // of a veil: only what faces away
#define PLAIN 16u          // no texture
#define SMOOTH 32u         // no pattern either
#define LIT_VEIL 64u       // a veil that is lit at its vertices
#define CUT_OUT 128u       // where its texture is less than half opaque there is nothing

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
    vec4 bounds;           // at rest: middle, radius [m]
};

struct Level {
    uint first_index;      // in all indices
    uint triangles;
    uint first_vertex;     // in the mesh
    uint vertices;
    float error;           // [m]
    uint influences;
    float slim;            // half the width of most of its surface [m]
    uint spare;
};

/// A joint at rest.
struct Rest {
    vec4 rotation;
    vec4 place;            // translation [m]; w: scale
    vec4 reach;            // x: farthest that a vertex is from it [m]
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
    float x;
    float y;
    float z;
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
    vec4 bounds;           // of what is drawn anew: middle and radius relative to the object's origin [m]
};

/// An instance at one level of detail; each has two, the finer first.
struct Part {
    uint level;            // NOT_DRAWN: none
    uint bin;
    uint first_vertex;     // filled by the scan
    uint first_index;
    vec3 base;             // the object's origin in eye space
    uint shares;           // of the pixels: from, to, 16 bits each
};

// NOT_DRAWN is in fibre.glsl.
#define LEFT_OUT 0x100u     // in a bin: there was no room for it
#define BINS 8u
#define BIN_LIT 0u         // lit at its vertices
#define BIN_PIXEL 2u       // lit pixel by pixel
#define BIN_VEIL 4u        // the same, let through; + 1 in those before: two-sided
#define BIN_LIT_VEIL 5u
#define BIN_THIN 6u        // so thin that its edges fade
#define BIN_LIT_THIN 7u
#define THIN_HALF 1.0      // of what is thin most of the surface is in rows of less than half this width [px]
#define NO_ROW 100.0       // half width of what is never widened [px]
#define SMOOTH_LIT 4.0     // what has no pattern may be so many times as large and still lit at its vertices
#define BAND 1.15          // a coarser level begins to fade in at this many times its threshold
#define PART_THREADS 4u     // a part may have four vertices
#define GROUP_PARTS 8u      // so many parts are one workgroup's: to begin one costs a software device as much as a part
#define LIGHT_THREADS 64u

/// What the scan writes.
struct MeshDraws {
    uvec4 commands[16];    // VkDrawIndexedIndirectCommand of each bin, in 8 words
    uvec4 groups;          // VkDispatchIndirectCommand over the parts that are drawn; w: how many
    uvec4 light_groups;    // the same over all vertices
    uvec4 counts;          // vertices, triangles, instances that are drawn, parts that did not fit
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
