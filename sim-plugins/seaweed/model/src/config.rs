//! The module's table in a scene file.

use reef_sdk::describe_species;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::species::Species;

/// Most plants, those of beds included.
pub const MOST_PLANTS: u64 = 20_000;
/// Most segments of all plants together.
pub const MOST_SEGMENTS: u64 = 2_000_000;

/// What the seaweed module puts into a scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(transform = describe_species::<Species>)]
pub struct Config {
    /// Plants one by one.
    #[schemars(length(max = 20000))]
    pub plants: Vec<Single>,
    /// Plants by their density over a rectangle.
    #[schemars(length(max = 1000))]
    pub beds: Vec<BedTable>,
}

/// One plant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Single {
    /// Which species: a file of assets/species, or a table `[species.NAME]` of the scene.
    #[schemars(length(max = 100))]
    pub species: String,
    /// Where it stands: x, y, z. Over a sea bed, y counts from the bed.
    #[serde(default)]
    #[schemars(inner(range(min = -100000.0, max = 100000.0)), extend("x-unit" = "m"))]
    pub position: [f64; 3],
    /// Size over that of its species.
    #[serde(default = "one")]
    #[schemars(range(min = 0.05, max = 20.0))]
    pub scale: f64,
    /// Turn about the vertical.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0), extend("x-unit" = "deg"))]
    pub yaw: f64,
    /// Seed of its differences from others of its kind. Without it: its place in the list.
    #[serde(default)]
    pub seed: Option<u32>,
}

/// What plants of a bed stand on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum On {
    /// Rocks and the ground between them.
    #[default]
    Both,
    /// The ground alone, not where a rock lies on it.
    Ground,
    /// Rocks alone.
    Rock,
}

/// Plants by their density over a rectangle of the sea bed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BedTable {
    /// Which species; drawn from the list at random.
    #[schemars(length(min = 1, max = 100))]
    pub species: Vec<String>,
    /// Plants on a square metre, where everything else suits them.
    #[schemars(range(max = 400.0), extend("exclusiveMinimum" = 0.0, "x-unit" = "1/m²"))]
    pub density: f64,
    /// x and z of the rectangle's middle.
    #[serde(default)]
    #[schemars(inner(range(min = -100000.0, max = 100000.0)), extend("x-unit" = "m"))]
    pub center: [f64; 2],
    /// Its extent along x and z.
    #[schemars(inner(range(min = 0.0, max = 10000.0)), extend("x-unit" = "m"))]
    pub size: [f64; 2],
    /// Least and greatest slope of what they stand on.
    #[serde(default = "any_slope")]
    #[schemars(inner(range(min = 0.0, max = 90.0)), extend("x-unit" = "deg"))]
    pub slope: [f64; 2],
    /// Least and greatest depth of the root below still water. Without a sea bed: of y = 0.
    #[serde(default = "any_depth")]
    #[schemars(inner(range(min = 0.0, max = 11000.0)), extend("x-unit" = "m"))]
    pub depth: [f64; 2],
    /// What they stand on.
    #[serde(default)]
    pub on: On,
    /// Least and greatest size over that of the species, before its own variation.
    #[serde(default = "same_size")]
    #[schemars(inner(range(min = 0.05, max = 20.0)))]
    pub scale: [f64; 2],
    /// Seed of the places. Without it: the scene's.
    #[serde(default)]
    pub seed: Option<u32>,
}

fn one() -> f64 {
    1.0
}

fn any_slope() -> [f64; 2] {
    [0.0, 90.0]
}

fn any_depth() -> [f64; 2] {
    [0.0, 11_000.0]
}

fn same_size() -> [f64; 2] {
    [1.0, 1.0]
}
