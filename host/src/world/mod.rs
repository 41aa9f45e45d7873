//! The sea itself: scene, clock, flow, terrain, journal, and the frames that steps produce.

pub mod assets;
pub mod environment;
pub mod frame;
pub mod scene;
