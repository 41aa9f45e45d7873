//! Jellyfish.
mod lanes;
pub mod slice;
pub mod water;
pub use lanes::Real;
