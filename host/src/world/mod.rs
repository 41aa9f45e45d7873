//! The sea itself: [`scene`] reads a file; [`sea`] steps its modules with a fixed [`clock`], along [`camera`] and [`water`]
//! (keyframed flow), under [`waves`], over [`terrain`], with what came from outside ([`journal`]) and what modules told one another
//! in the step before (`exchange`); each step is a [`frame`], of which a [`timeline`] keeps the last two.
//! [`state`] saves and loads all of it; `recent` remembers the last steps, and [`swap`] puts other instances in the places
//! of running ones; [`adopt`] takes up an edited scene; [`record`] and [`hash`] write down what happened.

pub mod adopt;
pub mod assets;
pub mod camera;
pub mod catalogue;
pub mod clock;
mod exchange;
pub mod hash;
pub mod journal;
pub mod random;
mod recent;
pub mod record;
pub mod scene;
pub mod sea;
pub mod setting;
pub mod state;
pub mod swap;
pub mod terrain;
pub mod timeline;
pub mod water;
pub mod waves;

pub use sea::{Options, World, WorldError};
pub use timeline::{Blend, Timeline};
