//! The module's table in a scene file.

use reef_sdk::describe_species;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::species::Species;

/// Most animals of a module.
pub const MOST_ANIMALS: u64 = 512;
/// Most specks of dye of one of them.
pub const MOST_TRACERS: u32 = 20_000;

/// What the jellyfish module puts into a scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(transform = describe_species::<Species>)]
pub struct Config {
    /// Groups of animals, each of one species in a box that it stays in.
    #[schemars(length(max = 512))]
    pub groups: Vec<Group>,
    /// Animals one by one: they swim on, up to the surface.
    #[schemars(length(max = 512))]
    pub animals: Vec<Placed>,
}

/// Animals of one species, placed by a seed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Group {
    /// Which species: a file of assets/species, or a table `[species.NAME]` of the scene.
    #[schemars(length(max = 100))]
    pub species: String,
    /// How many there are.
    #[serde(default = "one_whole")]
    #[schemars(range(min = 1, max = 512))]
    pub count: u32,
    /// The corner with the least x, y and z of the box: they swim up until they are near its top, then sink,
    /// as far as they are heavier than water, until they are near its bottom.
    #[schemars(inner(range(min = -100000.0, max = 100000.0)), extend("x-unit" = "m"))]
    pub low: [f64; 3],
    /// The corner with the greatest x, y and z.
    #[schemars(inner(range(min = -100000.0, max = 100000.0)), extend("x-unit" = "m"))]
    pub high: [f64; 3],
    /// Least and greatest size over that of the species.
    #[serde(default = "same_size")]
    #[schemars(inner(range(min = 0.05, max = 20.0)))]
    pub scale: [f64; 2],
    /// Slices of water of each: 1, or 2 at right angles, which cost twice as much; with 2 they turn to any
    /// side, and their bells need not be symmetric.
    #[serde(default = "one_whole")]
    #[schemars(range(min = 1, max = 2))]
    pub slices: u32,
    /// Seed of places, sizes and differences. Without it: the scene's.
    #[serde(default)]
    pub seed: Option<u32>,
}

/// One animal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Placed {
    /// Which species: a file of assets/species, or a table `[species.NAME]` of the scene.
    #[schemars(length(max = 100))]
    pub species: String,
    /// Middle of its bell.
    #[schemars(inner(range(min = -100000.0, max = 100000.0)), extend("x-unit" = "m"))]
    pub position: [f64; 3],
    /// Turn of its slice about the vertical, from +x toward +z.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0), extend("x-unit" = "deg"))]
    pub heading: f64,
    /// Size over that of the species.
    #[serde(default = "one")]
    #[schemars(range(min = 0.05, max = 20.0))]
    pub scale: f64,
    /// Contractions a second, of a body that is tuned to its species' frequency. Without it: that one.
    #[serde(default)]
    #[schemars(range(min = 0.05, max = 5.0), extend("x-unit" = "Hz"))]
    pub frequency: Option<f64>,
    /// Share of its period at which it begins. Without it: by chance.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub phase: Option<f64>,
    /// The direction in which it swims: of one slice, as far as its plane goes.
    #[serde(default = "upward")]
    #[schemars(inner(range(min = -1.0, max = 1.0)))]
    pub aim: [f64; 3],
    /// Slices of water: 1, or 2 at right angles, which cost twice as much; with 2 it turns to any side, and
    /// its bell need not be symmetric.
    #[serde(default = "one_whole")]
    #[schemars(range(min = 1, max = 2))]
    pub slices: u32,
    /// Specks of dye in its water, which debug lines show.
    #[serde(default)]
    #[schemars(range(min = 0, max = 20000))]
    pub tracers: u32,
    /// Seed of its differences. Without it: the scene's, and its number.
    #[serde(default)]
    pub seed: Option<u32>,
}

fn one_whole() -> u32 {
    1
}

fn one() -> f64 {
    1.0
}

fn same_size() -> [f64; 2] {
    [1.0, 1.0]
}

fn upward() -> [f64; 3] {
    [0.0, 1.0, 0.0]
}
