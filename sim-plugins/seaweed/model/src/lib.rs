//! Seaweeds.
pub mod bed;
pub mod config;
pub mod grow;
mod kernel;
pub use kernel::bare;
mod lanes;
pub mod levels;
pub mod random;
pub mod reference;
pub mod skeleton;
pub mod sow;
pub mod species;
pub mod view;
pub mod water;
