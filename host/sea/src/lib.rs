//! The sea itself: [`scene`] reads a file; [`step`] goes on from there, one fixed step after another;
//! [`reload`] lets code and scene change meanwhile.

pub mod reload;
pub mod scene;
pub mod step;

pub use step::{
    timeline::{Blend, Timeline},
    world::{Options, World, WorldError},
};
