//! Seaweeds: trees of segments that currents and waves bend.
//!
//! The model is that of Y. Coulais, D. Ghazanfarpour, O. Terraz and S. Thon, "Real-Time Animation of
//! Particles and Seaweeds in Underwater Scenes" (2005), §4, after T. Di Giacomo, S. Capo and F. Faure, "An
//! interactive forest" (2001). A plant is a skeleton of segments, each turned against its parent by θ and φ
//! (§4.2). The water pushes each segment (§4.3.1); two methods turn that into angles: the procedural one
//! follows the torque of each sub-branch (§4.3.2), the physical one integrates damped springs (§4.3.3). Both
//! have the same static equilibrium. What plants do moves the water (§4.3.4), and levels of detail leave out
//! what nobody sees (§4.4).
//!
//! - [`skeleton`]: what a plant is; [`reference`]: the equations, one plant, f64, to be read beside the
//!   paper; [`bare`]: the least that they can cost.
//! - [`water`]: what is taken from the sea; [`levels`], [`reef_flow::view`]: what is left out of it.
//! - [`bed`]: all plants, stepped together, eight plants a vector, in packs.
//! - [`species`], [`grow`]: from a table of parameters to a skeleton; [`modelled`]: from a modelling program's
//!   file to one, with its mesh; [`config`], [`sow`]: where plants
//!   stand, and how individuals differ; [`mesh`], [`looks`], [`paint`]: what they look like.
//! - [`plugin`]: configuration in, streams out.
//!
//! # What differs from the paper
//!
//! - Eq. (6) prints 1/m where by its place a stiffness stands; here it is k, and the equilibria of both
//!   methods agree.
//! - Eq. (5) takes the force of one segment with its whole length as lever. Here forces act where they do, at
//!   the segments' centres, and those of a sub-branch act on all that it stands on: a float at the tip
//!   stretches the whole plant.
//! - Eq. (9) divides each segment's torque by its own mass. Here masses (with the water that moves along) and
//!   rotational inertia are those of the whole tree, and eq. (10), Euler's explicit step, is a linearly
//!   implicit one: the step stays finite for any k, v and dt.
//!
//! Units are metres, seconds, kilograms, newtons and radians unless a name says otherwise.

pub mod bed;
pub mod config;
mod debug;
pub mod grow;
mod kernel;
mod lanes;
pub mod levels;
pub mod looks;
pub mod mesh;
pub mod modelled;
pub mod paint;
pub mod plugin;
pub mod reference;
pub mod skeleton;
pub mod sow;
pub mod species;
pub mod water;

pub use kernel::bare;
pub use plugin::Seaweeds;
