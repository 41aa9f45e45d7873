//! Jellyfish.
pub mod lanes;
pub mod water;
pub use lanes::Real;
