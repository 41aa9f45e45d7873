//! Jellyfish.
pub mod bloom;
mod lanes;
pub mod slice;
pub mod species;
pub mod surface;
pub mod trail;
pub mod water;
pub use lanes::Real;
