//! The sea's flow field: sources, holes, whirlwinds, directional fields (Aliaga & Larboulette 2009, §2) and
//! shelters, evaluated eight or sixteen points at a time, shared by all models.
//!
//! The way of a step: the host hands every plugin one list of [`reef_abi::Flow`] elements. A model puts it
//! into a [`Field`] once (a grid over what reaches only so far), then asks for one [`Packed`] form an object:
//! positions relative to the object's own f64 origin, without what the object emits itself and what cannot
//! reach it. The model's kernel calls [`velocity8`] on that, fused with its own equations, inside
//! [`dispatch!`].
//!
//! [`waves`] are the other thing that moves the water: trains on the surface and the orbits below them.
//!
//! Everything here gives the same bytes at every [`simd::Level`]: IEEE-exact operations only, every
//! multiply-add that is written as fused is fused, lanes are independent points.

pub mod bounds;
pub mod color;
pub mod field;
pub mod keyframe;
pub mod lanes;
pub mod limit;
pub mod math;
pub mod packed;
pub mod random;
pub mod reference;
pub mod sample;
pub mod scalar;
pub mod simd;
pub mod steepness;
pub mod view;
pub mod waves;

pub use fearless_simd;
pub use field::{Field, Look, Sphere};
pub use keyframe::{Interpolation, Key, Track};
pub use packed::{Packed, divergence, velocity, velocity8, velocity16};
pub use simd::Level;
pub use steepness::steepness;

/// A primitive that is so many times as strong. A shelter's peak means nothing and stays.
pub fn stronger(flow: &reef_abi::Flow, factor: f32) -> reef_abi::Flow {
    let peak = if flow.kind == reef_abi::FLOW_SHELTER { flow.peak } else { flow.peak * factor };
    reef_abi::Flow { strength: flow.strength * factor, peak, ..*flow }
}
