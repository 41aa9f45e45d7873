//! The host's services: the flow, meshes, textures, assets, limits.

use core::ffi::{c_char, c_void};

use bytemuck::{Pod, Zeroable};

use super::Joint;

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
    /// Not 0: the watchdog asks this call to return soon: with DISCARD where the state is as it was before
    /// the step, else with ERROR. What comes too late is the library's fault. [any]
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
