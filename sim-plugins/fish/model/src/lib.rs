//! Fish: bodies of springs that muscles bend, and the water that they push themselves off.
//!
//! The model is that of A. Gritt, "Procedural Fish Animation" (MSc thesis, 2010), after X. Tu and
//! D. Terzopoulos, "Artificial Fishes: Physics, Locomotion, Perception, Behavior" (1994). A body is put
//! together of segments (§5.3); springs hold it in shape, and two groups of muscles take turns in shortening
//! (§5.5). What moves it is the water on its skin alone.
//!
//! - [`body`]: what a fish is made of; [`material`]: of which stuff, and what its muscles are told.
//! - [`reference`]: the equations, one fish, f64, the matrix written out; [`bare`]: the least that they can
//!   cost.
//! - [`tank`]: the bodies of all fish of a species, stepped together, eight a vector.
//! - [`species`]: tables of parameters; [`gait`]: how a species swims, worked out from its mechanics.
//! - [`shoal`]: all fish, what each perceives and wants; [`frames`]: what they are skinned by.
//! - [`look`]: how a species looks; [`mesh`], [`paint`]: its skin; [`breed`]: all that it is, made once.
//! - [`config`], [`sow`]: where which fish are; [`plugin`]: configuration in, streams out.
//!
//! # What differs from the thesis
//!
//! - The table of its figure 5.1 is lost; the counts are those of Tu and Terzopoulos.
//! - The force of §5.1 has a vector for rest length: it would not turn with the fish, and its sign is off.
//!   Here a spring pulls along its unit vector, and its damping acts along it, too.
//! - The muscles of §5.5 change sides with a jump. That is an option; a smooth change is the default.
//! - The thesis does not say how its fish moves forward. Here water resists each outer face that meets it.
//! - Forward Euler, as printed, blows up. Semi-implicit Euler holds in the thesis's steps; the default is a
//!   linearly implicit step, which stays finite whatever speed, force and step are.
//!
//! Units are metres, seconds, kilograms, newtons and radians unless a name says otherwise. A body looks
//! along +x; y is up, z to its right.

pub mod body;
pub mod breed;
pub mod config;
mod draw;
pub mod frames;
pub mod gait;
mod kernel;
mod lanes;
pub mod look;
pub mod material;
pub mod mesh;
pub mod paint;
pub mod plugin;
pub mod reference;
pub mod shoal;
pub mod sow;
pub mod species;
pub mod tank;

pub use kernel::{Plan, bare};
pub use plugin::Fish;
