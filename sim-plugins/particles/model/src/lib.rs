//! Suspended particles: sand, clay, phytoplankton, marine snow, plankton that drifts.
//!
//! The model is that of Y. Coulais, D. Ghazanfarpour, O. Terraz and S. Thon, "Real-Time Animation of
//! Particles and Seaweeds in Underwater Scenes" (2005), §3. Particles of one kind fill a box (§3.1). The
//! centre P₀ of each particle's orbit drifts with all currents of the sea, eq. (3), and stays in its box; the
//! wave trains carry the particle around its centre, eq. (2). Four levels of detail (§3.3) leave out what
//! nobody sees:
//!
//! 1. wave trains that are too small for the distance ([`reef_flow::waves::select`]: their sum stays below a
//!    threshold),
//! 2. orbits of particles that are not in view ([`reef_flow::view`]),
//! 3. orbits of slaves, which follow a master beyond D_m ([`ride`]),
//! 4. single particles beyond D_M, for which a local fog stands ([`fog`]).
//!
//! - [`config`], [`kind`]: what a scene says, and what each kind of particle is without it.
//! - [`seed`]: where particles begin; [`group`]: which of them are a master and its slaves.
//! - [`cloud`]: all boxes of a module, stepped together; [`drift`]: eq. (3) and what is in view; [`reenter`]:
//!   those that leave their box, [`inflow`]: where they come again, [`lasting`]: which sources count;
//!   [`ride`]: eq. (2), and sprites; [`fog`]: what stands for many.
//! - The plugin is [`Particles`].
//!
//! # Positions
//!
//! A centre is three whole numbers: its offset from the box's middle in 2⁻³² of the box's extent. Leaving the
//! box through a wall and entering through the opposite one is then the integers' own overflow, and nothing
//! is lost however long it drifts. What the flow does to all centres alike is kept once a box, in f64: a
//! uniform current moves every centre by exactly V t. Currents that travel are taken with the nearest
//! wavelengths that fit the box, so that they, too, go on behind the opposite wall as they came.
//!
//! Units are metres, seconds and radians unless a name says otherwise.

pub mod cloud;
pub mod config;
mod debug;
pub mod drift;
pub mod fog;
pub mod group;
pub mod inflow;
pub mod kind;
pub mod lasting;
pub mod levels;
pub mod looks;
mod plugin;
pub mod reenter;
pub mod ride;
pub mod seed;
pub mod texture;

pub use cloud::{Cloud, Surroundings};
pub use levels::Levels;
pub use plugin::{PARAMS, Particles};
