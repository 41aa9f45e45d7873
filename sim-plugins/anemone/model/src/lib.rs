//! Sea anemones and seagrasses as fibres in a flow of singularities.
//!
//! The model is that of J. J. Aliaga and C. Larboulette, "Physically Based Animation of Sea Anemones in
//! Real-Time" (2009): a fibre is a chain of nodes (§3.2), the flow exerts a force on each node (§4.1), a node
//! bends until its spring holds that force (§4.2), and what it does not hold it hands down the chain (§4.3).
//! A plant is one wide fibre, the foot, and many thin ones on top of it, placed by spiral phyllotaxis (§3.1).
//!
//! - [`shape`]: what a fibre is at rest; [`reference`]: the equations, one fibre, f64, to be read beside the
//!   paper; [`wide`]: the same, eight fibres a vector; [`residual`]: how far a pose is from satisfying the
//!   equations.
//! - [`phyllotaxis`], [`species`], [`plant`]: from a small table of parameters to a plant.
//! - [`config`], [`bed`]: all plants of a scene, stepped together. The plugin is [`Anemones`].
//!
//! Units are metres, seconds, kilograms and radians unless a name says otherwise.

pub mod bare;
pub mod bed;
pub mod config;
mod debug;
pub mod frame;
pub mod math;
pub mod phyllotaxis;
pub mod plant;
mod plugin;
pub mod reference;
pub mod residual;
pub mod shape;
mod sow;
pub mod species;
pub mod wide;

pub use plugin::{Anemones, PARAMS};
