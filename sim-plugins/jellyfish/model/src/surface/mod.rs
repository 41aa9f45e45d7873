//! The surface in 3D (§3.4): a profile of both sides of the bell, a disc for each pair of its points, ridges
//! and noise.
//!
//! Discs let uneven bells be drawn: each pair of opposite points is turned about its own axis, which goes
//! through the middle between them, across the line that joins them. Where there are two slices at right
//! angles, a ring goes through the pairs of both.
//!
//! Eqs. (2) and (5) move points along "the surface's normal", and (5) both sides of the bell by up to twice
//! its thickness. Here the two sides go the same way, outward from the sub-umbrella: so the bell waves, and
//! its sides never pass through each other. Eq. (4) moves the exumbrella alone.

mod bell;
mod disc;
mod form;
mod fringe;
mod noise;
mod normals;
mod profile;
mod spline;

pub use bell::Bell;
pub(crate) use disc::discs;
pub use disc::{Disc, Frame};
pub use form::Form;
pub use fringe::{Fringe, FringeForm};
