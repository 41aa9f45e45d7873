//! Jellyfish that swim by themselves.
//!
//! The model is that of D. Rudolf and D. Mould, "Interactive Jellyfish Animation Using Simulation" (GRAPP
//! 2009). A vertical slice of bell and tentacles, a network of springs, swims in a square of water of its own
//! (§3.2): muscles shorten by a periodic curve (§3.3), the water carries the points, and what the springs
//! push goes into the water (immersed boundary). A surface in 3D is then made of the slice (§3.4).
//!
//! - [`water`]: the grid; [`bare`]: the least that its parts can cost.
//! - [`slice`]: springs, muscles, strands, and how they and the water move each other.
//! - [`surface`]: bell, tentacles and arms as vertices; [`trail`]: what is too long for the slice.
//! - [`species`]: from a table of parameters to an animal; [`bloom`]: animals in the sea; [`paint`], [`breed`]:
//!   what is on a bell.
//! - [`config`], [`sow`]: where which animals are; [`plugin`]: configuration in, streams out.
//!
//! # What differs from the paper
//!
//! - Figure 11 does not run as printed. Its viscosity is read as a dynamic one (ν = 1.304e-6 m²/s), its
//!   density of 1 as 1000 kg/m³; its angular stiffness is 0.03 N·m/rad a metre of depth, between the
//!   printed value and that of plate theory. Forces are per metre of depth.
//! - Springs are linearly implicit, so steps are 4 to 8 ms long. The paper's safety factor of 0.001 would
//!   make them 20 µs, which its own frame rates contradict.
//! - One strand a side instead of two, as long as half of the bell is wide: longer and more strands take the
//!   travel away. What tentacles have beyond that follows without pushing back ([`trail`]).
//! - A couple holds the bell upright, or on its course: without it rounding tips it over within 20 s. An
//!   uneven contraction turns it, which the paper's authors could not do.
//! - Eq. (4) is printed with a coefficient of 1 for a relaxed bell; its figures show ridges on a contracted
//!   one, and so does [`surface`]. Eq. (5) wraps around the bell, and both of its sides go the same way.
//!
//! Units are metres, seconds, kilograms and radians; lengths, masses and forces of the slice are per metre of
//! depth where a name says so.

pub mod bare;
pub mod bloom;
pub mod breed;
pub mod config;
mod draw;
mod lanes;
pub mod paint;
pub mod plugin;
pub mod slice;
pub mod sow;
pub mod species;
pub mod surface;
pub mod trail;
pub mod water;

pub use lanes::Real;
pub use plugin::Jellyfish;
