// Records of the fibre passes. Mirrors fibre_records.rs and gather.rs of host/render/src; the functions
// mirror twin.rs there.

#include "shared.glsl"

/// Tissue that light crosses in a tentacle, in radii: it is a hollow tube, whose two walls are a quarter of
/// its radius thick. A blade is solid.
#define HOLLOW 0.5

struct Fibre {
    uint object;
    uint previous_node;
    uint current_node;
    uint nodes_flags;      // node count in the low half, FLAG_CAP and FLAG_BLADE in the high half
    uint material;
    uint variation;
    uint sides;
    float flatness;
    vec3 normal;
    float stands;          // 1: as in this step, 0: between the two, as the picture is
    vec3 previous_normal;
    uint plain;            // 1: round, without a cap, of one opaque tissue without a pattern
};

/// Two texels: see mesh_texels.glsl.
struct Object {
    vec3 previous;         // origin in eye space at the step before [m]
    uint previous_end;     // 0
    vec3 current;          // origin in eye space at this step [m]
    uint current_end;      // 0
};

struct Node {
    vec3 position;         // relative to its object's origin [m]
    float radius;          // [m]
};

/// What the first pass chose for a fibre. `first_vertex` and `first_index` are filled by the scan.
struct Choice {
    uint levels;           // ring level, side level << 8, LIT_RIBBON, THIN; 0xffffffff: not drawn
    uint rings;
    uint sides;            // 2: a ribbon that faces the eye
    uint first_vertex;
    uint first_index;
    float ring_morph;      // 0: this level, 1: the next coarser
    float side_morph;
    float chain;           // length [m]
};

struct Ring {
    vec3 center;           // eye space [m]
    float radius;          // that is drawn [m]
    vec3 normal;           // unit, angle 0
    float coverage;        // true over drawn width
    vec3 tangent;          // unit
    float along;           // position along the fibre: 0 root, 1 last node, 2 the end of its cap
    vec2 slope;            // share of the tangent in the surface's normal, share of the radial direction
};

/// A tube's vertex, as fibre.vert reads it.
struct TubeVertex {
    vec4 clip;
    uint normal_xy;        // 16 bits each
    uint normal_z_along;   // 16 bits each; half of how far along the fibre
    uint circle;           // cosine and sine of the angle around the fibre, 16 bits each
    uint radius_half;      // halves: true radius [cm], half the true width [px]
    uint material_flags;   // 24 and 8 bits
    uint variation;
    uint chain_tissue;     // halves: length [m], tissue that light crosses in radii
    float edge;            // distance from the middle of a ribbon [px]; 0: a tube
};

/// A lit ribbon's vertex, as fibre_ribbon.vert reads it.
struct StripVertex {
    vec4 clip;
    uint edge;             // what is shown; a: true over drawn width; 8 bits each
    uint bow;              // middle minus mean of the edges; 8 bits each
};

/// VkDrawIndirectCommand.
struct Draw {
    uint vertices;
    uint instances;
    uint first_vertex;
    uint first_instance;
};

/// VkDrawIndexedIndirectCommand.
struct IndexedDraw {
    uint indices;
    uint instances;
    uint first_index;
    int vertex_offset;
    uint first_instance;
};

/// VkDispatchIndirectCommand.
struct Groups {
    uint x;
    uint y;
    uint z;
};

/// What the scan writes: the draws.
struct FibreDraws {
    IndexedDraw tubes;       // those that are no ribbons
    IndexedDraw flat_tubes;  // those that are, whose indices come after all others
    Draw solid;              // lit ribbons that hide what is behind them
    Draw thin;               // and those that let it through
    Groups groups;           // that skin the tubes
    uint tube_count;
    uint vertices;           // of the tubes
    uint drawn;              // fibres that are drawn
    uint left_out;           // fibres that did not fit
};

/// A ribbon hides what is behind it where it covers this share of a pixel or more: such a pixel comes first,
/// and shows a rim of what was there before. What covers less comes last and hides nothing.
#define HIDES 0.75

/// Share of a pixel that a ribbon covers whose half width is `half_px`, at a distance from its middle [px];
/// its edge fades over twice `edge`. Its sum across the ribbon is the ribbon's width, however thin that is.
float covered_share(float half_px, float distance_px, float edge) {
    return clamp((half_px + edge - distance_px) / (2.0 * edge), 0.0, min(half_px / edge, 1.0));
}

/// Vertices of a ribbon that is lit at its rings: a strip, whose first and last stand twice to join it to the
/// next.
uint strip_count(uint rings) { return 2u * rings + 2u; }

uint ring_count(uint level) { return uint(RINGS) >> level; }

/// Rings on the chain itself; the others close its end.
uint body_rings(uint level, bool cap) {
    if (cap) return level == 0u ? 9u : level == 1u ? 5u : 3u;
    return level == 0u ? 13u : level == 1u ? 7u : 3u;
}

/// Where ring `k` of a level lies: 0 at the root, 1 at the last node, 2 at the end of the cap.
float ring_position(uint level, uint k, bool cap) {
    uint body = body_rings(level, cap);
    if (k < body) return float(k) / float(body - 1u);
    return 1.0 + float(k + 1u - body) / float(ring_count(level) - body);
}

/// Vertices around a ring after `level` halvings; 2 stands for a ribbon.
uint side_count(uint sides, uint level) {
    for (uint i = 0u; i < level; i++) sides = sides <= 4u ? 2u : (sides + 1u) >> 1;
    return sides;
}

/// An inscribed polygon is thinner than its circle; this factor gives it the circle's mean width.
float polygon_scale(uint sides) {
    if (sides <= 2u) return 1.0;
    float a = 3.14159265 / float(sides);
    return a / sin(a);
}

uint vertex_count(uint rings, uint sides) { return rings * sides; }

uint index_count(uint rings, uint sides) { return (rings - 1u) * (sides == 2u ? 1u : sides) * 6u; }

/// Rotates `n`, a unit vector across `from`, by the least rotation that turns `from` into `to`.
vec3 transport(vec3 n, vec3 from, vec3 to) {
    float d = max(1.0 + dot(from, to), 1e-4);
    n -= (from + to) * (dot(n, to) / d);
    n -= to * dot(n, to);
    return n * inversesqrt(max(dot(n, n), 1e-12));
}
