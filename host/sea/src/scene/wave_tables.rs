//! The keys of a scene file that are about waves.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A wind sea.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WavesTable {
    /// The wind, 19.5 m over the water. Below 0.23 m/s, the least speed of a wave on water, the sea is still.
    #[schemars(range(min = 0.0, max = 60.0), extend("x-unit" = "m/s"))]
    pub wind: f64,
    /// Where the wind blows to: 0 along +x, 90 along +z. The trains spread around it as cos².
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0), extend("x-unit" = "deg"))]
    pub direction: f64,
    /// How many wave trains the sea is made of. Few repeat what they do, many cost more; the height is the
    /// same.
    #[serde(default = "default_trains")]
    #[schemars(range(min = 1, max = 256))]
    pub trains: u32,
}

fn default_trains() -> u32 {
    reef_flow::waves::spectrum::DEFAULT_TRAINS
}

/// A wave train on the surface: amplitude · sin(k·p − ω t + phase), ω² = g k tanh(k depth).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WaveTable {
    /// Half the height from trough to crest.
    #[schemars(range(min = 0.0), extend("x-unit" = "m"))]
    pub amplitude: f64,
    /// Distance from crest to crest.
    #[schemars(extend("exclusiveMinimum" = 0.0, "x-unit" = "m"))]
    pub wavelength: f64,
    /// Where it goes: 0 along +x, 90 along +z.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0), extend("x-unit" = "deg"))]
    pub direction: f64,
    /// Phase at the time 0. Without it: random by the scene's seed.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0), extend("x-unit" = "deg"))]
    pub phase: Option<f64>,
}
