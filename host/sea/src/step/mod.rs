//! [`sea`] steps its modules (`member`) with a fixed [`clock`] in what does not change while it runs
//! (`setting`: [`camera`], [`water`] with its keyframed flow, [`waves`], [`terrain`]), with what came from
//! outside (`hands`: the [`journal`], `kept` in a file) and what modules told one another in the step before
//! (`exchange`), and makes `frames` of it; a [`timeline`] keeps the last two steps, `recent` those that
//! another instance would have to make up for, and [`history`] states to which the sea can go back. [`state`]
//! saves and loads all of it; [`record`] and [`hash`] write down what happened.

pub mod camera;
pub mod clock;
pub(crate) mod exchange;
pub(crate) mod frames;
pub(crate) mod ground;
pub(crate) mod hands;
pub mod hash;
pub mod history;
pub mod journal;
pub(crate) mod kept;
pub(crate) mod member;
pub mod random;
pub(crate) mod recent;
pub mod record;
pub mod rescue;
pub(crate) mod setting;
pub mod state;
pub mod terrain;
pub mod timeline;
pub mod water;
pub mod waves;
pub mod world;
