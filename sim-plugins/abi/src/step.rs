//! A step: what it is given, and where its outputs go.

use core::ffi::c_void;

use bytemuck::{Pod, Zeroable};

use super::{Actor, Flow};

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
/// what is asked for, and the state after the step are those of a step that is seen. The first step that is
/// seen again emits all: it does not return [`SLEEP`](crate::SLEEP) where something was left out
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
