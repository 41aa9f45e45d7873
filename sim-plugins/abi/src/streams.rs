//! What a step emits: the streams and their elements.

use bytemuck::{Pod, Zeroable};

/// reef_object: one anemone, plant, fish, box; what everything below belongs to
pub const STREAM_OBJECT: u32 = 1;
/// reef_material: how surfaces look
pub const STREAM_MATERIAL: u32 = 2;
/// reef_fibre: a node chain with radii
pub const STREAM_FIBRE: u32 = 3;
/// reef_fibre_node
pub const STREAM_FIBRE_NODE: u32 = 4;
/// reef_skinned: a mesh uploaded once, moved by joints
pub const STREAM_SKINNED: u32 = 5;
/// reef_joint
pub const STREAM_JOINT: u32 = 6;
/// reef_mesh_draw: a mesh uploaded once, with vertices made anew
pub const STREAM_MESH_DRAW: u32 = 7;
/// reef_draw_vertex
pub const STREAM_DRAW_VERTEX: u32 = 8;
/// reef_billboard
pub const STREAM_BILLBOARD: u32 = 9;
/// reef_flow: what this instance does to the water, felt in the next step
pub const STREAM_FLOW: u32 = 10;
/// reef_actor: what others may perceive, follow, avoid, pick, in the next step
pub const STREAM_ACTOR: u32 = 11;
/// reef_debug_line, when reef_step.flags has REEF_STEP_DEBUG
pub const STREAM_DEBUG_LINE: u32 = 12;
/// reef_trace, when reef_step.flags has REEF_STEP_TRACE; recordings read it alone
pub const STREAM_TRACE: u32 = 13;
pub const STREAM_COUNT: u32 = 14;
/// Common bits of all flags (0 to 7): do not blend with the step before (it jumped or wrapped).
pub const FLAG_NO_BLEND: u32 = 1;

/// The greatest id of an object: the 16 bits above tell others its module.
pub const GREATEST_ID: u64 = 0xffff_ffff_ffff;

/// One thing in the sea. The renderer matches objects of two steps by id. Ids are 1 to [`GREATEST_ID`]. To
/// other modules an object has that id with the tag of its module in the 16 bits above, which follows from
/// the module's name in the scene. 64 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Object {
    /// stable over steps, reloads and saves; unique within the instance
    pub id: u64,
    /// id of the object that it rides on, 0: none; the checker alone reads it
    pub parent: u64,
    /// [m] world position that the elements' f32 positions are relative to
    pub origin: [f64; 3],
    /// [m] bounding sphere, relative to origin: the renderer leaves out what is not in view, and people who
    /// point at the sea hit it
    pub bounds_center: [f32; 3],
    /// [m] >= 0
    pub bounds_radius: f32,
    /// REEF_FLAG_*
    pub flags: u32,
    pub spare: u32,
}
/// How a surface looks. Colours are linear RGB, 0..1. 128 bytes.
pub const PATTERN_NONE: u32 = 0;
/// round spots of accent
pub const PATTERN_SPOTS: u32 = 1;
/// rings around the fibre
pub const PATTERN_BANDS: u32 = 2;
/// lines along the fibre
pub const PATTERN_STRIPES: u32 = 3;
/// irregular patches
pub const PATTERN_BLOTCHES: u32 = 4;

#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Material {
    /// colour at the root; [3]: opacity
    pub base: [f32; 4],
    /// colour at the tip; [3]: where the tip's colour begins along the fibre, 0..1
    pub tip: [f32; 4],
    /// colour of the pattern; [3]: its share of the surface, 0..1
    pub accent: [f32; 4],
    /// REEF_PATTERN_*
    pub pattern: u32,
    /// id from texture_create, 0: none
    pub texture: u32,
    /// [1/m] for spots and blotches; rings or stripes in all for bands and stripes
    pub pattern_scale: f32,
    /// 0 hard .. 1 soft edge
    pub pattern_softness: f32,
    /// 0 opaque .. 1 light shines through with exp(-2 thickness/cm)
    pub translucency: f32,
    /// 0 Lambert .. 1 light wraps round
    pub wrap: f32,
    /// strength of the rim light
    pub rim: f32,
    /// emitted light at the tip; 0 by day
    pub glow: f32,
    /// 0 mirror .. 1 matt
    pub roughness: f32,
    /// reflectance at normal incidence under water: .0003 tissue, .008 rock
    pub specular: f32,
    pub spare: [f32; 10],
}
/// flags: close the end with a disc that carries things (an anemone's mouth)
/// A node chain, root first, skinned by the renderer as a generalised cylinder (the paper's §3.2). 64 bytes.
pub const FIBRE_CAP: u32 = 256;
/// flags: a flat blade, a radius wide to both sides along `normal`; `flatness`: thickness over width
pub const FIBRE_BLADE: u32 = 512;

#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Fibre {
    /// index into the object stream
    pub object: u32,
    /// index into the node stream
    pub first_node: u32,
    /// >= 2
    pub node_count: u32,
    /// index into the material stream
    pub material: u32,
    /// REEF_FLAG_*, REEF_FIBRE_*
    pub flags: u32,
    /// vertices of a ring at full detail, 3..64
    pub sides: u32,
    /// a hash: small differences of hue between neighbours
    pub variation: u32,
    /// 1 round; below 1 with REEF_FIBRE_BLADE
    pub flatness: f32,
    /// unit vector across the first segment: angle 0 of the first ring; carried along without twist
    pub normal: [f32; 3],
    pub spare: [f32; 5],
}

#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct FibreNode {
    /// [m] relative to the object's origin
    pub position: [f32; 3],
    /// [m] > 0
    pub radius: f32,
}

/// Where a joint stands: x in the joint's own frame is translation + scale * rotate(rotation, x). 32 bytes.
/// Joints are rigid frames, one a section, rather than points. A body of seven sections is 224 bytes a step,
/// its corners as points would be 368, and a frame turns normals without a rule of its own.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Joint {
    /// unit quaternion x, y, z, w
    pub rotation: [f32; 4],
    /// [m] relative to the object's origin; of a mesh at rest: in the mesh's space
    pub translation: [f32; 3],
    /// > 0
    pub scale: f32,
}

/// An instance of a mesh that was uploaded once (reef_host.mesh_create), moved by joints. 64 bytes. T_j =
/// joint_j * inverse(rest_j) moves a vertex v at rest, weight w_j: linear  p = sum w_j T_j(v), n = unit(sum
/// w_j s_j R_j n): cheap, thinner where joints twist dual    REEF_MESH_DUAL: the T_j as unit dual
/// quaternions, turned to the first one's side, summed with w_j, made unit again; their
///           scales are blended beside them and applied first. Twists keep their thickness.
/// One joint moves any mesh as a whole: T = joint_0, and `rest` is not read. So what is far costs one joint.
/// Between two steps joints are blended one by one: translation and scale along a line, rotation along the
/// shorter arc. The element of the step before is the one with the same number among the elements of the
/// object with the same id; where that has another mesh or another joint_count, or with REEF_FLAG_NO_BLEND,
/// nothing is blended. Elements may share joints.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Skinned {
    /// index into the object stream
    pub object: u32,
    /// id from mesh_create
    pub mesh: u32,
    /// index into the material stream; along a mesh "root to tip" is uv[1], "around" is uv[0]
    pub material: u32,
    /// REEF_FLAG_*
    pub flags: u32,
    /// index into the joint stream
    pub first_joint: u32,
    /// the mesh's own number, or 1
    pub joint_count: u32,
    /// > 0: the mesh at rest is so many times as large
    pub scale: f32,
    /// patterns are moved on by it: bands and stripes by that share of their period, 0..1
    pub phase: f32,
    /// [rad] turns the colours' hue, -pi..pi
    pub hue: f32,
    /// colours * (1 + value), -1..4
    pub value: f32,
    /// 0: there .. 1: gone; between, a share of the pixels
    pub fade: f32,
    pub spare: [u32; 5],
}
/// flags: turned to the viewer; else it lies across `axis`
pub const BILLBOARD_FACING: u32 = 256;

/// A sprite. It brings its own velocity, so that the picture between two steps needs the newer one alone:
/// sprites have no identity, and a step emits those that may be seen, in any order that is the same for every
/// run. 64 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Billboard {
    /// [m] at the end of the step, relative to the object's origin
    pub position: [f32; 3],
    /// [m] diameter > 0
    pub size: f32,
    /// unit normal of the sprite; not read with REEF_BILLBOARD_FACING
    pub axis: [f32; 3],
    /// 0..1
    pub opacity: f32,
    /// [m/s] of this step: earlier by t the sprite is shown at position - velocity t. With REEF_FLAG_NO_BLEND
    /// it is not read, and the sprite stands at its position
    pub velocity: [f32; 3],
    /// [rad] the picture's turn about the sprite's normal
    pub roll: f32,
    /// index into the object stream
    pub object: u32,
    /// id from texture_create; 0: a soft round dot
    pub texture: u32,
    /// sRGB 0xAABBGGRR, multiplies the texture
    pub color: u32,
    /// REEF_FLAG_*, REEF_BILLBOARD_*
    pub flags: u32,
}

/// An instance of an uploaded mesh whose vertices are made anew: the mesh gives indices, levels, uv, colour
/// and glow, the stream positions, normals and thickness. 48 bytes. No two elements share a vertex. Identity
/// from step to step is as for reef_skinned: the same mesh and number within the object with the same id;
/// then positions, normals and thickness are blended vertex by vertex.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct MeshDraw {
    pub object: u32,
    /// id from mesh_create
    pub mesh: u32,
    pub material: u32,
    /// REEF_FLAG_*
    pub flags: u32,
    /// index into the draw vertex stream
    pub first_vertex: u32,
    /// the mesh's own number
    pub vertex_count: u32,
    /// as in reef_skinned
    pub phase: f32,
    pub hue: f32,
    pub value: f32,
    pub fade: f32,
    pub spare: [u32; 2],
}

/// 20 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct DrawVertex {
    /// [m] relative to the object's origin
    pub position: [f32; 3],
    /// as in reef_mesh_vertex
    pub normal: u32,
    /// [m] >= 0
    pub thickness: f32,
}

/// One primitive of the sea's flow field. V(p) = sum of all; shelters then multiply. 128 bytes.
/// Local kinds (Aliaga & Larboulette 2009, eq. 2-4), d = |p - C|:
///   source     sign * |F| / (|F|/F_max + d^2) * unit(p - C)         F < 0 is a hole
///   whirlwind  sign * |F| / (|F|/F_max + d^2) * unit((p - C) x R)
/// Global kind (eq. 5):
///   directional  F * (1 - m + m sin(phase + k.p)) * max(0, 1 + g (y - level)) * v
///                constant: m = 0; sine in time: m > 0, k = 0; travelling: k > 0; growing with height: g != 0
pub const FLOW_SOURCE: u32 = 1;
/// a source with the opposite sign
pub const FLOW_HOLE: u32 = 2;
pub const FLOW_WHIRLWIND: u32 = 3;
pub const FLOW_DIRECTIONAL: u32 = 4;
/// multiplies the velocity by 1 - strength * fade(d / reach)
pub const FLOW_SHELTER: u32 = 5;

#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Flow {
    /// object that emits it; an object does not feel what it emits itself. 0: the scene
    pub owner: u64,
    /// REEF_FLOW_*
    pub kind: u32,
    pub flags: u32,
    /// [m] C
    pub position: [f64; 3],
    /// R, or the direction v; unit
    pub axis: [f32; 3],
    /// F [m^3/s] for local kinds, [m/s] for directional, 0..1 for shelter
    pub strength: f32,
    /// F_max [m/s] > 0: the speed at the centre
    pub peak: f32,
    /// [m] >= 0: rounds the jump of direction at the centre; 0: as printed
    pub core: f32,
    /// [m] the field is exactly 0 beyond it; 0: unlimited
    pub reach: f32,
    /// 0..1: share of reach from which on it fades smoothly to 0
    pub fade: f32,
    /// m, 0..1
    pub modulation: f32,
    /// [rad] reduced modulo 2 pi by who emits it
    pub phase: f32,
    /// k [rad/m]
    pub wave_vector: [f32; 3],
    /// g [1/m]
    pub gradient: f32,
    /// [m] y at which the factor of height is 1
    pub level: f32,
    pub spare: [u32; 7],
}

/// What others may perceive. 104 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Actor {
    pub id: u64,
    pub parent: u64,
    /// [m]
    pub position: [f64; 3],
    /// [m/s]
    pub velocity: [f32; 3],
    /// [m]
    pub radius: f32,
    /// unit, or zero
    pub forward: [f32; 3],
    /// FNV-1a (32 bits) of the species' name
    pub species: u32,
    pub flags: u32,
    pub spare: [u32; 7],
}

/// 48 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct DebugLine {
    /// [m]
    pub from: [f64; 3],
    /// [m] to - from
    pub delta: [f32; 3],
    /// sRGB 0xAABBGGRR
    pub color: u32,
    /// groups that the panel switches, 0..31
    pub channel: u32,
    pub spare: u32,
}
/// 48 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Trace {
    /// number of the plant, animal or fibre in the recording, from 0
    pub object: u64,
    /// [m]
    pub position: [f64; 3],
    /// [m]
    pub radius: f32,
    pub node: u32,
    /// index into the descriptor's `traces`
    pub kind: u32,
    pub spare: u32,
}

/// An element of an output stream.
pub trait Element: Pod + core::fmt::Debug {
    /// Number of its stream.
    const STREAM: u32;
}

macro_rules! elements {
    ($($element:ident = $stream:ident),+ $(,)?) => {
        $(impl Element for $element {
            const STREAM: u32 = $stream;
        })+

        /// What each stream is made of: its number and the Rust name of its element, from stream 1 on.
        pub const ELEMENTS: &[(u32, &str)] = {
            let rows = &[$(($stream, stringify!($element))),+];
            assert!(rows.len() + 1 == STREAM_COUNT as usize, "a stream has no element, or STREAM_COUNT is wrong");
            let mut at = 0;
            while at < rows.len() {
                assert!(rows[at].0 as usize == at + 1, "the elements do not stand in the order of their streams");
                at += 1;
            }
            rows
        };
    };
}
elements!(
    Object = STREAM_OBJECT,
    Material = STREAM_MATERIAL,
    Fibre = STREAM_FIBRE,
    FibreNode = STREAM_FIBRE_NODE,
    Skinned = STREAM_SKINNED,
    Joint = STREAM_JOINT,
    MeshDraw = STREAM_MESH_DRAW,
    DrawVertex = STREAM_DRAW_VERTEX,
    Billboard = STREAM_BILLBOARD,
    Flow = STREAM_FLOW,
    Actor = STREAM_ACTOR,
    DebugLine = STREAM_DEBUG_LINE,
    Trace = STREAM_TRACE,
);

/// A unit vector as vertices have it: on an octahedron, 16 bits a coordinate.
pub fn pack_normal([x, y, z]: [f32; 3]) -> u32 {
    let d = x.abs() + y.abs() + z.abs();
    if d <= 0.0 {
        return 0;
    }
    let (a, b) = (x / d, y / d);
    let sign = |v: f32| if v < 0.0 { -1.0 } else { 1.0 };
    let (a, b) = if z < 0.0 { ((1.0 - b.abs()) * sign(a), (1.0 - a.abs()) * sign(b)) } else { (a, b) };
    let sixteen = |v: f32| u32::from(((v * 32767.0).round() as i16).cast_unsigned());
    sixteen(a) | sixteen(b) << 16
}
