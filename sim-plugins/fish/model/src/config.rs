//! The module's table in a scene file.

use reef_sdk::describe_species;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::species::Species;

/// Most fish of a module.
pub const MOST_FISH: u64 = 100_000;

/// What the fish module puts into a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(transform = describe_species::<Species>)]
pub struct Config {
    /// Groups of fish, each of one species in a box that it does not leave.
    #[schemars(length(max = 1000))]
    pub groups: Vec<Group>,
    /// Species that feel the sources and holes that fish carry: those rise near one of them. What fish live
    /// in is among them anyway.
    #[schemars(length(max = 100))]
    pub hosts: Vec<String>,
}

impl Default for Config {
    fn default() -> Self {
        let hosts = [
            "host-anemone",
            "actinia-fragacea",
            "anthopleura-xanthogrammica",
            "anthothoe-chilensis",
            "stomphia-coccinea",
        ];
        Self { groups: Vec::new(), hosts: hosts.map(String::from).into() }
    }
}

/// Fish of one species.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Group {
    /// Which species: a file of assets/species, or a table `[species.NAME]` of the scene.
    #[schemars(length(max = 100))]
    pub species: String,
    /// How many there are.
    #[serde(default = "one_fish")]
    #[schemars(range(min = 1, max = 100_000))]
    pub count: u32,
    /// The corner with the least x, y and z of the box that they do not leave.
    #[schemars(inner(range(min = -100000.0, max = 100000.0)), extend("x-unit" = "m"))]
    pub low: [f64; 3],
    /// The corner with the greatest x, y and z.
    #[schemars(inner(range(min = -100000.0, max = 100000.0)), extend("x-unit" = "m"))]
    pub high: [f64; 3],
    /// Where they begin. Without it: all over the box.
    #[serde(default)]
    #[schemars(inner(range(min = -100000.0, max = 100000.0)), extend("x-unit" = "m"))]
    pub position: Option<[f64; 3]>,
    /// How far around that place they begin at most.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 100000.0), extend("x-unit" = "m"))]
    pub around: f64,
    /// The way that all of them look at first: a turn about the vertical from +x toward −z. Without it: each
    /// its own.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0), extend("x-unit" = "deg"))]
    pub heading: Option<f64>,
    /// Least and greatest size over that of the species, before its own variation.
    #[serde(default = "same_size")]
    #[schemars(inner(range(min = 0.05, max = 20.0)))]
    pub scale: [f64; 2],
    /// Their homes, where the species has a `home`; one after the other gets a fish. Without it they take
    /// what their species `lives_in`.
    #[serde(default)]
    #[schemars(length(max = 1000), inner(inner(range(min = -1e5, max = 1e5))), extend("x-unit" = "m"))]
    pub homes: Vec<[f64; 3]>,
    /// Seed of places, sizes and whims. Without it: the scene's.
    #[serde(default)]
    pub seed: Option<u32>,
}

fn one_fish() -> u32 {
    1
}

fn same_size() -> [f64; 2] {
    [1.0, 1.0]
}
