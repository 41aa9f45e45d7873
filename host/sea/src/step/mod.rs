//! [`sea`] steps its modules with a fixed [`clock`], along [`camera`] and [`water`] (keyframed flow), under
//! [`waves`], over [`terrain`], with what came from outside ([`journal`], `kept` in
//! a file) and what modules told one another
//! in the step before (`exchange`); a [`timeline`] keeps the last two steps, `recent` those that another
//! instance would have to make up for, and [`history`] states to which the sea can go back. [`state`] saves
//! and loads all of it; [`record`] and [`hash`] write down what happened.

pub mod camera;
pub mod clock;
pub(crate) mod exchange;
pub(crate) mod ground;
pub mod hash;
pub mod history;
pub mod journal;
pub(crate) mod kept;
pub mod random;
pub(crate) mod recent;
pub mod record;
pub mod sea;
pub mod setting;
pub mod state;
pub mod terrain;
pub mod timeline;
pub mod water;
pub mod waves;
