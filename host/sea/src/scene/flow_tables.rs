//! `[[flow]]`: the keys of what moves the water, and of what it moves with.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::keyed::Keyed;

/// Something that moves the water.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum FlowTable {
    /// Pushes water away from a point; with negative strength it is a hole.
    Source(LocalFlow),
    /// Draws water to a point.
    Hole(LocalFlow),
    /// Turns water about an axis.
    Whirlwind(WhirlwindFlow),
    /// The same current everywhere: steady, breathing in time, travelling as a wave, or growing with height.
    Directional(DirectionalFlow),
    /// Calms the water around a point.
    Shelter(ShelterFlow),
}

/// A source or a hole: speed |Φ| / (|Φ|/Φ_max + d²) at the distance d.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LocalFlow {
    /// A name for the panel.
    #[serde(default)]
    #[schemars(length(max = 200))]
    pub name: String,
    /// The centre: a point, or keyframes. With `attach`: relative to the object.
    #[serde(default)]
    #[schemars(extend("x-unit" = "m"))]
    pub position: Keyed<[f64; 3]>,
    /// Φ: a number, or keyframes. Its sign may change: a source becomes a hole.
    #[schemars(extend("x-unit" = "m³/s"))]
    pub strength: Keyed<f64>,
    /// Φ_max: the speed at the centre.
    #[serde(default = "default_peak")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "x-unit" = "m/s"))]
    pub peak: f64,
    /// Rounds the jump of direction at the centre; 0: as the paper prints it.
    #[serde(default = "default_core")]
    #[schemars(range(min = 0.0), extend("x-unit" = "m"))]
    pub core: f64,
    /// The field ends here; 0: it has no end.
    #[serde(default)]
    #[schemars(range(min = 0.0), extend("x-unit" = "m"))]
    pub reach: f64,
    /// Share of `reach` from which on the field fades to nothing.
    #[serde(default = "default_fade")]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub fade: f64,
    /// Moves with an object of a module, which does not feel it.
    #[serde(default)]
    pub attach: Option<AttachTable>,
}

/// A whirlwind: the speed of a source, across the way to the centre and across the axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WhirlwindFlow {
    /// A name for the panel.
    #[serde(default)]
    #[schemars(length(max = 200))]
    pub name: String,
    /// The centre: a point, or keyframes. With `attach`: relative to the object.
    #[serde(default)]
    #[schemars(extend("x-unit" = "m"))]
    pub position: Keyed<[f64; 3]>,
    /// R: the axis, of any length but zero, or keyframes.
    #[serde(default = "default_up")]
    pub axis: Keyed<[f64; 3]>,
    /// Φ: a number, or keyframes. Its sign turns the whirl round.
    #[schemars(extend("x-unit" = "m³/s"))]
    pub strength: Keyed<f64>,
    /// Φ_max: the speed at the centre.
    #[serde(default = "default_peak")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "x-unit" = "m/s"))]
    pub peak: f64,
    /// Rounds the jump of direction at the axis; 0: as the paper prints it.
    #[serde(default = "default_core")]
    #[schemars(range(min = 0.0), extend("x-unit" = "m"))]
    pub core: f64,
    /// The field ends here; 0: it has no end.
    #[serde(default)]
    #[schemars(range(min = 0.0), extend("x-unit" = "m"))]
    pub reach: f64,
    /// Share of `reach` from which on the field fades to nothing.
    #[serde(default = "default_fade")]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub fade: f64,
    /// Moves with an object of a module, which does not feel it.
    #[serde(default)]
    pub attach: Option<AttachTable>,
}

/// A current: speed · (1 − m + m sin(2π t / period + phase − k·p)) · max(0, 1 + gradient (y − level)) along
/// `direction`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DirectionalFlow {
    /// A name for the panel.
    #[serde(default)]
    #[schemars(length(max = 200))]
    pub name: String,
    /// Where the water goes, of any length but zero, or keyframes.
    pub direction: Keyed<[f64; 3]>,
    /// Its speed: a number, or keyframes.
    #[schemars(extend("x-unit" = "m/s"))]
    pub speed: Keyed<f64>,
    /// m: 0 steady; 1 the speed swings from −1 to 1 times `speed`; between them the swing rides on a steady
    /// part.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub modulation: f64,
    /// Time of one swing.
    #[serde(default = "default_period")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "x-unit" = "s"))]
    pub period: f64,
    /// Where the swing begins.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0), extend("x-unit" = "deg"))]
    pub phase: f64,
    /// Length of a travelling swing; 0: the whole sea swings at once.
    #[serde(default)]
    #[schemars(range(min = 0.0), extend("x-unit" = "m"))]
    pub wavelength: f64,
    /// Where a travelling swing goes, of any length but zero. Without it: along `direction` at the time 0.
    #[serde(default)]
    pub travel: Option<[f64; 3]>,
    /// g: growth of the speed with height; 0: none.
    #[serde(default)]
    #[schemars(extend("x-unit" = "1/m"))]
    pub gradient: f64,
    /// y at which the factor of height is 1.
    #[serde(default)]
    #[schemars(extend("x-unit" = "m"))]
    pub level: f64,
}

/// Calm water: multiplies all velocities by 1 − strength at the centre, by 1 from `reach` on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ShelterFlow {
    /// A name for the panel.
    #[serde(default)]
    #[schemars(length(max = 200))]
    pub name: String,
    /// The centre: a point, or keyframes. With `attach`: relative to the object.
    #[serde(default)]
    #[schemars(extend("x-unit" = "m"))]
    pub position: Keyed<[f64; 3]>,
    /// How much of the motion is taken, 0 to 1: a number, or keyframes.
    pub strength: Keyed<f64>,
    /// The shelter ends here.
    #[schemars(extend("exclusiveMinimum" = 0.0, "x-unit" = "m"))]
    pub reach: f64,
    /// Share of `reach` from which on it fades to nothing.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub fade: f64,
    /// Moves with an object of a module, which does not feel it.
    #[serde(default)]
    pub attach: Option<AttachTable>,
}

fn default_peak() -> f64 {
    1.0
}

fn default_core() -> f64 {
    0.01
}

fn default_fade() -> f64 {
    0.5
}

fn default_period() -> f64 {
    6.0
}

fn default_up() -> Keyed<[f64; 3]> {
    Keyed::Fixed([0.0, 1.0, 0.0])
}

/// An object to move with. While there is no such object, what is attached is absent.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AttachTable {
    /// Name of the module in this scene.
    pub module: String,
    /// Number of the object in the module (its id).
    #[schemars(range(min = 1))]
    pub object: u64,
}
