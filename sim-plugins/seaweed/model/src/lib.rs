//! Seaweeds.
pub mod bed;
mod kernel;
mod lanes;
pub mod levels;
pub mod random;
pub mod reference;
pub mod skeleton;
pub mod view;
pub mod water;
