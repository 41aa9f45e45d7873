//! The sea itself: scene, clock, flow, terrain, journal, and the frames that steps produce.

pub mod assets;
pub mod camera;
pub mod environment;
pub mod frame;
pub mod random;
pub mod scene;
pub mod setting;
pub mod terrain;
pub mod water;
