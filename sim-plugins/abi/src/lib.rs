//! The Rust mirror of `reef_sim.h`, item by item, without the prefix `reef_`.
//!
//! The header is the contract and holds the rules; this file only spells it for Rust. The tests of this
//! package compile the header as C11 and C++11 and compare every size, offset and alignment with what stands
//! here.

#![allow(missing_docs, reason = "the header documents each item; what it says in comments stands here too")]

use core::ffi::{c_char, c_void};

use bytemuck::{Pod, Zeroable};

/// "REEFSIM\0", read as a little-endian integer.
pub const MAGIC: u64 = 0x004d495346454552;
pub const VERSION_MAJOR: u32 = 0;
pub const VERSION_MINOR: u32 = 2;
pub const VERSION: u32 = (VERSION_MAJOR << 16) | VERSION_MINOR;
/// FNV-1a (64 bits) over this file's bytes without its one line that defines REEF_HEADER_HASH. A test keeps
/// it true.
pub const HEADER_HASH: u64 = 0xce78600113969577;
/// done; the outputs count
pub const OK: i32 = 0;
/// nothing changed since the last step: the last outputs stay, flow and actors included. After create(),
/// reset() and load_state() there are none yet: the first step emits
pub const SLEEP: i32 = 1;
/// this step is refused, the state is untouched; the last good outputs stay. Its events are not given again:
/// a parameter whose event was in it keeps its value from before
pub const DISCARD: i32 = 2;
/// the instance needs reset() or load_state()
pub const ERROR: i32 = -1;
/// the library is at fault (a caught panic, say)
pub const FATAL: i32 = -2;
/// not known to this host, or not taken by it; nothing came of the call, and the step goes on
pub const UNSUPPORTED: i32 = -3;
/// load_state: not readable; the instance is untouched
pub const BAD_STATE: i32 = -4;
/// a limit of the host is reached; the message names it
pub const NO_SPACE: i32 = -5;
/// create: the configuration is wrong; the message names the JSON path
pub const BAD_INPUT: i32 = -6;
pub const LOG_ERROR: u32 = 1;
pub const LOG_WARN: u32 = 2;
pub const LOG_INFO: u32 = 3;
pub const LOG_DEBUG: u32 = 4;
/// Instruction sets that a plugin may use in a step (reef_step.simd_level). All give the same bytes.
pub const SIMD_SCALAR: u32 = 0;
/// or NEON
pub const SIMD_SSE4_2: u32 = 1;
/// with FMA
pub const SIMD_AVX2: u32 = 2;
pub const SIMD_AVX512: u32 = 3;
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

/// The scene's camera with its nominal viewport, never the window's. 72 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Camera {
    /// [m]
    pub position: [f64; 3],
    /// unit quaternion x, y, z, w; looks along -z, y up
    pub rotation: [f32; 4],
    /// [rad]
    pub fov_y: f32,
    /// [m]
    pub near_plane: f32,
    /// [m]
    pub far_plane: f32,
    /// [px] nominal
    pub width: u32,
    /// [px] nominal
    pub height: u32,
    pub spare: [u32; 3],
}

#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Water {
    /// rho [kg/m^3]
    pub density: f32,
    /// mu [Pa s], dynamic
    pub viscosity: f32,
    /// h [m] > 0: the bed is at y = -h
    pub depth: f32,
    pub spare: [f32; 5],
}

/// One wave train (Coulais et al. 2005, §3): eta = r sin(k (x cos(theta) + z sin(theta)) - omega t + phase).
/// 32 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Wave {
    /// r [m]
    pub amplitude: f32,
    /// k [rad/m]
    pub wave_number: f32,
    /// omega [rad/s]
    pub frequency: f32,
    /// [rad] of this step: random phase - omega t, reduced modulo 2 pi in f64 by the host
    pub phase: f32,
    /// cos(theta), sin(theta): along x and z
    pub direction: [f32; 2],
    pub spare: [f32; 2],
}

/// Heights y of the sea bed at origin + (column, row) * cell, bilinear between. 40 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Heightfield {
    /// rows * columns, row after row (z), column (x) fastest
    pub heights: *const f32,
    /// [m] x, z
    pub origin: [f64; 2],
    /// [m]
    pub cell: f32,
    pub columns: u32,
    pub rows: u32,
    pub spare: u32,
}

/// A capsule that nothing should enter. 48 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Obstacle {
    pub id: u64,
    /// [m]
    pub from: [f64; 3],
    /// [m] to - from
    pub delta: [f32; 3],
    /// [m]
    pub radius: f32,
}
/// the parameter `param` is now `value`
/// What came from outside in this step, in the journal's order. 64 bytes.
pub const EVENT_PARAM: u32 = 1;
/// somebody touched the sea at `point`, at a speed of `value` [m/s]; object: what was hit, by the id that its
/// module gave it where that is this one, or 0
pub const EVENT_POKE: u32 = 2;

#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Event {
    pub kind: u32,
    /// reef_param.id
    pub param: u32,
    pub object: u64,
    pub value: f64,
    /// [m]
    pub point: [f64; 3],
    pub spare: [u32; 4],
}
/// on the side, before a swap: outputs are checked and thrown away
pub const STEP_TRIAL: u32 = 256;
/// emit the trace stream; dt = 0 with it: only emit, do not advance
pub const STEP_TRACE: u32 = 512;
/// emit debug lines
pub const STEP_DEBUG: u32 = 1024;
/// nobody looks at this step: what only shows may stay out of the streams. Where objects are, flow, actors,
/// what is asked for, and the state after the step are those of a step that is seen
pub const STEP_UNSEEN: u32 = 2048;

#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Step {
    pub size: u32,
    /// REEF_STEP_*
    pub flags: u32,
    /// number of this step, from 1; 0: the state before the first
    pub step: u64,
    /// [s] at the end of this step
    pub time: f64,
    /// [s]; 0: emit the present state, change nothing
    pub dt: f64,
    pub seed: u64,
    /// REEF_SIMD_*
    pub simd_level: u32,
    pub flow_count: u32,
    pub wave_count: u32,
    pub actor_count: u32,
    pub obstacle_count: u32,
    pub event_count: u32,
    pub camera: *const Camera,
    pub water: *const Water,
    /// [opt]
    pub heightfield: *const Heightfield,
    /// the scene's, then what plugins emitted in the step before, in fixed order
    pub flow: *const Flow,
    /// sorted by amplitude, greatest first
    pub waves: *const Wave,
    pub actors: *const Actor,
    pub obstacles: *const Obstacle,
    pub events: *const Event,
}

#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Output {
    pub size: u32,
    pub spare: u32,
    pub ctx: *mut c_void,
    /// Room for `count` elements of the stream. May move what was reserved in it before: reserve before
    /// parallel_for, then write disjoint ranges. elem_size must be the sizeof of the stream's element. [step]
    pub reserve: Option<
        unsafe extern "C" fn(
            ctx: *mut c_void,
            stream: u32,
            elem_size: u32,
            count: u64,
            out: *mut *mut c_void,
        ) -> i32,
    >,
    /// The first `count` reserved elements count. [step]
    pub commit: Option<unsafe extern "C" fn(ctx: *mut c_void, stream: u32, count: u64) -> i32>,
}

/// One piece of a `parallel_for`.
pub type Job = Option<unsafe extern "C" fn(user: *mut c_void, index: u32, worker: u32)>;

/// Velocities of the sea at many points (arrays of `count`). 96 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct FlowQuery {
    pub x: *const f32,
    pub y: *const f32,
    /// [m] relative to origin
    pub z: *const f32,
    pub vx: *mut f32,
    pub vy: *mut f32,
    /// [m/s]
    pub vz: *mut f32,
    /// [m]
    pub origin: [f64; 3],
    /// leave out what this object emits; 0: nothing
    pub owner: u64,
    /// [opt] a point each, in place of `owner`; best in runs of the same
    pub owners: *const u64,
    pub count: u32,
    pub spare: u32,
}

/// A vertex of a mesh at rest. 40 bytes. normal: a unit vector (x, y, z) on an octahedron. d = |x| + |y| +
/// |z|; (a, b) = (x, y) / d, and where z < 0 it is ((1 - |y| / d) * sign(x), (1 - |x| / d) * sign(y)) with
/// sign(0) = 1. The low 16 bits are round(32767 a) as a two's complement, the high ones round(32767 b). Every
/// value is a unit vector.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct MeshVertex {
    /// [m]
    pub position: [f32; 3],
    pub normal: u32,
    /// u around, v from root (0) to tip (1), -100..100; textures lie over 0..1, and again and again around
    pub uv: [f32; 2],
    /// [m] >= 0: tissue that light crosses, for materials with translucency
    pub thickness: f32,
    /// >= 0, multiplies the material's
    pub glow: f32,
    /// sRGB 0xAABBGGRR, multiplies the material's colours; AA: its opacity
    pub color: u32,
    pub spare: u32,
}

/// A level of detail: triangles among some of the mesh's vertices. Levels may share vertices; a step's work
/// grows with vertex_count, so a coarser level's best come first in the mesh. The finer of two levels is
/// chosen where `error` of the coarser one would show; between, a growing share of the pixels is the other's.
/// 32 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct MeshLevel {
    pub first_index: u32,
    /// a multiple of 3, > 0
    pub index_count: u32,
    /// the triangles' corners lie among the vertices from here on ...
    pub first_vertex: u32,
    /// ... which are so many
    pub vertex_count: u32,
    /// [m] farthest from level 0 at rest; 0 for level 0, growing from level to level
    pub error: f32,
    /// 0, 1, 2, 4 or 8, not above the mesh's: the greatest so many of each vertex, made to sum to 1
    pub influences: u32,
    pub spare: [u32; 2],
}

/// flags: joints are blended as dual quaternions; else linearly
pub const MESH_DUAL: u32 = 256;
/// flags: seen, and lit, from both sides; else only from where its triangles are counter-clockwise
pub const MESH_TWO_SIDED: u32 = 512;
/// flags: where the material's texture is less than half opaque there is nothing; else it hides the colours
pub const MESH_CUT_OUT: u32 = 1024;

/// A mesh at rest: read during mesh_create alone. 88 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Mesh {
    /// [opt] for messages
    pub name: *const c_char,
    pub vertices: *const MeshVertex,
    /// into the mesh's vertices, three a triangle
    pub indices: *const u32,
    /// the finest first
    pub levels: *const MeshLevel,
    /// [opt] where the joints stand at rest
    pub rest: *const Joint,
    /// [opt] `influences` joints a vertex, vertex after vertex
    pub joints: *const u32,
    /// [opt] as many: 0..1, those of a vertex sum to 1 within 0.001
    pub weights: *const f32,
    /// 1..2^20
    pub vertex_count: u32,
    /// 3..2^22
    pub index_count: u32,
    /// 1..8
    pub level_count: u32,
    /// 0..256; 0: for mesh draws, or one joint that moves all
    pub joint_count: u32,
    /// 0 (without joints), 1, 2, 4 or 8
    pub influences: u32,
    /// REEF_MESH_*
    pub flags: u32,
    pub spare: [u32; 2],
}

/// red, green and blue are sRGB, as in PNG files; alpha is straight in both
pub const TEXTURE_RGBA8_SRGB: u32 = 1;
/// all are linear
pub const TEXTURE_RGBA8: u32 = 2;

/// A picture: red, green, blue, alpha, 8 bits each. 40 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Texture {
    /// row after row, tightly packed
    pub texels: *const c_void,
    /// REEF_TEXTURE_*
    pub format: u32,
    /// 1..1024
    pub width: u32,
    /// 1..1024
    pub height: u32,
    pub spare: [u32; 3],
    /// for messages
    pub name: *const c_char,
}

#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Host {
    pub size: u32,
    /// REEF_VERSION of the host
    pub version: u32,
    /// first argument of all services
    pub ctx: *mut c_void,
    /// `worker` of a job is below this
    pub worker_count: u32,
    pub spare: u32,
    /// [any]
    pub log: Option<unsafe extern "C" fn(ctx: *mut c_void, level: u32, text: *const c_char, length: u64)>,
    /// The message of the failure that is about to be returned. [any]
    pub set_error: Option<unsafe extern "C" fn(ctx: *mut c_void, text: *const c_char, length: u64)>,
    /// Not 0: the watchdog asks this call to return soon: with DISCARD where the state is as it was before the
    /// step, else with ERROR. What comes too late is the library's fault. [any]
    pub should_stop: Option<unsafe extern "C" fn(ctx: *mut c_void) -> u32>,
    /// Calls job(user, i, worker) for i in 0..count on the host's workers and returns when all are done. A
    /// call from a job runs inline. Which worker runs what is not defined: write only what belongs to i.
    /// [control] [step] [job]
    pub parallel_for:
        Option<unsafe extern "C" fn(ctx: *mut c_void, count: u32, job: Job, user: *mut c_void) -> i32>,
    /// Memory until the end of this step; align: a power of two up to 4096. [step]
    pub scratch:
        Option<unsafe extern "C" fn(ctx: *mut c_void, bytes: u64, align: u64, out: *mut *mut c_void) -> i32>,
    /// [step] [job]
    pub sample_flow: Option<unsafe extern "C" fn(ctx: *mut c_void, query: *const FlowQuery) -> i32>,
    /// A mesh that elements name by its id, as long as it is there. What is made again while it is there (the
    /// same name and content) is the same, with the same id, and stays until it was destroyed as often. Ids
    /// are 1 and up, in the order of making, and never used for anything else. Reset, load_state and a
    /// discarded step leave it; what an instance made goes with it; not in open(). [control] [step]
    pub mesh_create:
        Option<unsafe extern "C" fn(ctx: *mut c_void, mesh: *const Mesh, out_id: *mut u32) -> i32>,
    pub mesh_destroy: Option<unsafe extern "C" fn(ctx: *mut c_void, id: u32) -> i32>,
    /// A picture that elements name by its id, as for meshes: the same name, format, size and texels are the
    /// same. [control] [step]
    pub texture_create:
        Option<unsafe extern "C" fn(ctx: *mut c_void, texture: *const Texture, out_id: *mut u32) -> i32>,
    pub texture_destroy: Option<unsafe extern "C" fn(ctx: *mut c_void, id: u32) -> i32>,
    /// A figure for people who look at the module in the panel: what a step saved, how many things are awake.
    /// The last value of each name is shown; at most 32 names of at most 64 bytes, what is beyond is not.
    /// [any]
    pub figure: Option<unsafe extern "C" fn(ctx: *mut c_void, name: *const c_char, length: u64, value: f64)>,
    /// A file of the module's own assets: `name` is its path, with `/`, within the folder that is named like
    /// the plugin's id, among the host's assets in `modules/` or beside the library. The bytes stay until
    /// this call of the plugin returned. Where a file that was read changes later, the host makes the
    /// instance anew, as after an edit of its table in the scene. BAD_INPUT: there is none, or the name leads
    /// out of the folder; NO_SPACE: more than 64 MiB in a call. Not in open(). [control]
    pub asset_read: Option<
        unsafe extern "C" fn(
            ctx: *mut c_void,
            name: *const c_char,
            length: u64,
            out_bytes: *mut *const c_void,
            out_length: *mut u64,
        ) -> i32,
    >,
    /// The table of an extension, which lives as long as this one; NULL: the host does not have it. [any]
    pub get_extension: Option<unsafe extern "C" fn(ctx: *mut c_void, id: *const c_char) -> *const c_void>,
}

/// Of [`Limits`].
pub const EXTENSION_LIMITS: &core::ffi::CStr = c"draft/limits";

/// What one instance may have at most, of `get_extension(REEF_EXTENSION_LIMITS)`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    pub size: u32,
    /// streams that the host knows; those from there on it does not take
    pub stream_count: u32,
    /// by a stream's number: most elements in a step; 0: the host does not take it
    pub streams: *const u64,
    /// most of a saved state
    pub state_bytes: u64,
    /// most that scratch lends in a step, all together
    pub scratch_bytes: u64,
    /// most at a time
    pub textures: u32,
    /// most at a time
    pub meshes: u32,
}
pub const PARAM_FLOAT: u32 = 1;
pub const PARAM_INT: u32 = 2;
/// 0 or 1
pub const PARAM_SWITCH: u32 = 3;
/// 0 .. choice_count - 1
pub const PARAM_CHOICE: u32 = 4;
/// flags: a logarithmic slider
pub const PARAM_LOG: u32 = 256;

#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Param {
    /// stable for ever; not an index; not 0
    pub id: u32,
    /// REEF_PARAM_*
    pub kind: u32,
    pub flags: u32,
    pub choice_count: u32,
    pub minimum: f64,
    pub maximum: f64,
    pub default_value: f64,
    /// in scene files: lower_case_words
    pub key: *const c_char,
    /// in the panel
    pub label: *const c_char,
    /// heading in the panel
    pub group: *const c_char,
    /// "m/s", ""
    pub unit: *const c_char,
    /// one sentence
    pub help: *const c_char,
    /// [opt] choice_count names
    pub choices: *const *const c_char,
    pub spare: [u64; 2],
}

/// Where save_state writes and load_state reads. The host wraps the bytes in an envelope of plugin id, state
/// version, length and hash. The payload is the plugin's own, little-endian and without pointers;
/// reef_state.h writes and reads tagged fields, to which a later version may add.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Writer {
    pub size: u32,
    pub spare: u32,
    pub ctx: *mut c_void,
    pub write: Option<unsafe extern "C" fn(ctx: *mut c_void, bytes: *const c_void, length: u64) -> i32>,
    /// So many bytes are still to come, as far as is known: room for them is made at once. Need not be called.
    pub expect: Option<unsafe extern "C" fn(ctx: *mut c_void, length: u64) -> i32>,
}

#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Reader {
    pub size: u32,
    /// of the library that wrote the bytes
    pub state_version: u32,
    pub ctx: *mut c_void,
    /// Copies up to `length` bytes, returns how many; 0 at the end. May return fewer than asked before the
    /// end. -1: it cannot read, and load_state returns BAD_STATE.
    pub read: Option<unsafe extern "C" fn(ctx: *mut c_void, bytes: *mut c_void, length: u64) -> i64>,
    /// of the whole payload
    pub length: u64,
}

/// Filled by create(), up to the size that the host put there.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Instance {
    pub size: u32,
    pub spare: u32,
    /// first argument of all functions below
    pub ctx: *mut c_void,
    /// [control]
    pub destroy: Option<unsafe extern "C" fn(ctx: *mut c_void)>,
    /// Back to the state after create(), parameters included. [control]
    pub reset: Option<unsafe extern "C" fn(ctx: *mut c_void) -> i32>,
    /// [step]
    pub step:
        Option<unsafe extern "C" fn(ctx: *mut c_void, input: *const Step, output: *const Output) -> i32>,
    /// [control]
    pub save_state: Option<unsafe extern "C" fn(ctx: *mut c_void, writer: *const Writer) -> i32>,
    /// All or nothing: anything but REEF_OK leaves the instance as it was. A state_version below
    /// state_min_version or above state_version is REEF_BAD_STATE. [control]
    pub load_state: Option<unsafe extern "C" fn(ctx: *mut c_void, reader: *const Reader) -> i32>,
    /// The parameter's present value. Parameters change through the step's events only. [control]
    pub get_param: Option<unsafe extern "C" fn(ctx: *mut c_void, id: u32, out_value: *mut f64) -> i32>,
    /// [opt] The table of an extension, which lives as long as the instance; NULL: it does not have it.
    /// [control]
    pub get_extension: Option<unsafe extern "C" fn(ctx: *mut c_void, id: *const c_char) -> *const c_void>,
}

#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Descriptor {
    pub size: u32,
    pub flags: u32,
    /// "reef.anemone": reverse-domain or vendor.name; stable
    pub id: *const c_char,
    pub name: *const c_char,
    /// of the plugin: "1.2.3"
    pub version: *const c_char,
    pub vendor: *const c_char,
    pub description: *const c_char,
    /// [opt] JSON Schema of the module's table in a scene file: what does not fit never gets to create()
    pub config_schema: *const c_char,
    /// [opt]
    pub params: *const Param,
    pub param_count: u32,
    /// what save_state writes
    pub state_version: u32,
    /// the oldest that load_state reads
    pub state_min_version: u32,
    pub spare: u32,
    /// config: JSON object {"scene": {"name", "seed", "scale", "dt"}, "species": {NAME: {...}}, "config":
    /// {...}}. An error's message begins with the path in "config": `anemones[3].species: ...`. `host` is
    /// this instance's own: valid until destroy() returned, or create() returned a failure. [control]
    pub create: Option<
        unsafe extern "C" fn(
            host: *const Host,
            config: *const c_char,
            length: u64,
            out: *mut Instance,
        ) -> i32,
    >,
    /// [opt] what its traces are of, as recordings name it: "fibre", "fish"; lower_case_words
    pub traces: *const *const c_char,
    /// at most 16
    pub trace_count: u32,
    pub spare_traces: u32,
}

#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// REEF_MAGIC
    pub magic: u64,
    pub size: u32,
    /// REEF_VERSION
    pub version: u32,
    /// REEF_HEADER_HASH
    pub header_hash: u64,
    /// 1..64
    pub descriptor_count: u32,
    pub spare: u32,
    pub descriptors: *const *const Descriptor,
    /// Once, before anything else; `host` stays valid until close() returns. [control]
    pub open: Option<unsafe extern "C" fn(host: *const Host) -> i32>,
    /// Once, after every instance is destroyed. [control]
    pub close: Option<unsafe extern "C" fn()>,
}

// SAFETY: a parameter, a descriptor and an entry point only at constants of the library that defines them.
unsafe impl Sync for Param {}
// SAFETY: as above.
unsafe impl Sync for Descriptor {}
// SAFETY: as above.
unsafe impl Sync for Entry {}

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

/// The name of the one symbol that a plugin exports: a [`Entry`].
pub const ENTRY_SYMBOL: &str = "reef_sim_entry";

/// FNV-1a, 64 bits: the hash of the header and of stable names.
pub const fn fnv1a_64(bytes: &[u8]) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let mut i = 0;
    while i < bytes.len() {
        hash = (hash ^ bytes[i] as u64).wrapping_mul(0x0000_0100_0000_01b3);
        i += 1;
    }
    hash
}

/// FNV-1a, 32 bits: a species' name as [`Actor::species`].
pub const fn fnv1a_32(bytes: &[u8]) -> u32 {
    let mut hash = 0x811c_9dc5_u32;
    let mut i = 0;
    while i < bytes.len() {
        hash = (hash ^ bytes[i] as u32).wrapping_mul(0x0100_0193);
        i += 1;
    }
    hash
}

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
