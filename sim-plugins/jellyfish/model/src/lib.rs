//! Jellyfish.
mod lanes;
pub mod slice;
pub mod surface;
pub mod trail;
pub mod water;
pub use lanes::Real;
