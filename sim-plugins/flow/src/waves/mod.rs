//! The waves that the whole sea feels (Coulais et al. 2005, §3.2): a wind sea cut into trains, and the orbits
//! on which each train carries the water below it.
//!
//! One train of amplitude r, wave number k, frequency ω and heading θ raises the surface by η = r sin ψ,
//! where ψ = k (x cos θ + z sin θ) − ω t + phase. Water whose orbit has its centre at (x, y, z) is displaced
//! by
//!
//! - along the heading: r C cos ψ, C = cosh(k (y + h)) / sinh(k h)
//! - upward: r S sin ψ, S = sinh(k (y + h)) / sinh(k h)
//!
//! In deep water C = S = exp(k y), and this is the paper's eq. (2) with its phase counted a quarter turn
//! later: x with sin, y with −cos. (Eq. (1)'s k·y₀ in place of k·x₀ turns backwards.) So a crest's water
//! moves with the wave. In shallow water C is nearly 1/(k h) at every depth and S falls linearly to zero at
//! the bed.
//!
//! [`spectrum`] makes the trains, [`dispersion`] ties k to ω; [`Trains`] is what a kernel takes, relative to
//! an object's own origin; [`orbit`](fn@orbit) and [`surface`](fn@surface) are the kernels, [`carry`] runs
//! one over many points; [`select`] says how many trains matter from how far away, [`Choice`] keeps its
//! answer. [`surge`] is for what stands still and sways: the orbital velocity over a whole plant, to first
//! order, from one look at the trains; [`Sway`] is the choice and the look together.

pub mod bare;
mod carry;
mod choice;
pub mod dispersion;
mod orbit;
pub mod reference;
pub mod select;
pub mod spectrum;
pub mod surge;
mod sway;
pub mod trig;

pub use carry::{Carried, carry};
pub use choice::{Choice, Steady};
pub use orbit::{Orbit, Surface, Trains, orbit, surface};
pub use select::{Lens, Rule, Selection};
pub use spectrum::{Train, WindSea, WindSeaError};
pub use surge::{Places, Surges, Swell};
pub use sway::Sway;

/// Standard gravity [m/s²].
pub const GRAVITY: f64 = 9.80665;
