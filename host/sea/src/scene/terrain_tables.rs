//! `[terrain]`, its ripples and its rocks: their keys.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The sea bed: gentle dunes from noise, with rocks half-buried in it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TerrainTable {
    /// Extent along x and z.
    #[schemars(inner(range(min = 1e-9)), extend("x-unit" = "m"))]
    pub size: [f64; 2],
    /// x and z of the middle.
    #[schemars(extend("x-unit" = "m"))]
    pub center: [f64; 2],
    /// Distance between two heights. Size and cell together may give 4 000 000 heights at most.
    #[schemars(extend("exclusiveMinimum" = 0.0, "x-unit" = "m"))]
    pub cell: f64,
    /// Height of the dunes over their mean, and depth below it.
    #[schemars(range(min = 0.0), extend("x-unit" = "m"))]
    pub relief: f64,
    /// Distance from dune to dune.
    #[schemars(extend("exclusiveMinimum" = 0.0, "x-unit" = "m"))]
    pub relief_length: f64,
    /// Layers of noise: each has half the length of the one before.
    #[schemars(range(min = 1, max = 10))]
    pub octaves: u32,
    /// Height of each layer as a share of the one before.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub gain: f64,
    /// Rise of the mean bed per metre along x and along z.
    #[schemars(inner(range(min = -10.0, max = 10.0)))]
    pub slope: [f64; 2],
    /// Seed of dunes and rocks. Without it: the scene's.
    #[schemars(range(min = 0))]
    pub seed: Option<u64>,
    /// Sand ripples, drawn on the bed (nothing feels them).
    pub ripples: RipplesTable,
    /// Rocks scattered by seed.
    pub rocks: RocksTable,
    /// Rocks one by one.
    #[schemars(length(max = 10000))]
    pub rock: Vec<RockTable>,
}

impl Default for TerrainTable {
    fn default() -> Self {
        Self {
            size: [40.0, 40.0],
            center: [0.0, 0.0],
            cell: 0.125,
            relief: 0.25,
            relief_length: 6.0,
            octaves: 4,
            gain: 0.45,
            slope: [0.0, 0.0],
            seed: None,
            ripples: RipplesTable::default(),
            rocks: RocksTable::default(),
            rock: Vec::new(),
        }
    }
}

/// Sand ripples.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RipplesTable {
    /// Distance from crest to crest.
    #[schemars(extend("exclusiveMinimum" = 0.0, "x-unit" = "m"))]
    pub spacing: f64,
    /// Height of a crest over its trough; 0: smooth sand.
    #[schemars(range(min = 0.0), extend("x-unit" = "m"))]
    pub height: f64,
    /// Way of the surge across the crests: 0 along +z, 90 along +x.
    #[schemars(range(min = -360.0, max = 360.0), extend("x-unit" = "deg"))]
    pub direction: f64,
}

impl Default for RipplesTable {
    fn default() -> Self {
        Self { spacing: 0.14, height: 0.012, direction: 70.0 }
    }
}

/// Rocks scattered by seed, never over one another.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RocksTable {
    /// How many. Fewer where there is no room.
    #[schemars(range(max = 10000))]
    pub count: u32,
    /// Smallest and greatest half width.
    #[schemars(inner(range(min = 1e-9)), extend("x-unit" = "m"))]
    pub size: [f64; 2],
    /// Height as a share of the width.
    #[schemars(range(min = 0.1, max = 3.0))]
    pub flatness: f64,
    /// Share of a rock's height that is below the sand.
    #[schemars(range(min = 0.0, max = 0.95))]
    pub buried: f64,
    /// Radius around the terrain's middle that is kept free.
    #[schemars(range(min = 0.0), extend("x-unit" = "m"))]
    pub clearing: f64,
}

impl Default for RocksTable {
    fn default() -> Self {
        Self { count: 0, size: [0.15, 0.7], flatness: 0.7, buried: 0.4, clearing: 1.5 }
    }
}

/// One rock.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RockTable {
    /// x and z. Its height follows from the ground.
    #[schemars(extend("x-unit" = "m"))]
    pub position: [f64; 2],
    /// Half axes along its own x, y, z.
    #[schemars(inner(range(min = 1e-9)), extend("x-unit" = "m"))]
    pub half_axes: [f64; 3],
    /// Turn about the vertical.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0), extend("x-unit" = "deg"))]
    pub yaw: f64,
    /// Share of its height that is below the sand.
    #[serde(default = "default_buried")]
    #[schemars(range(min = 0.0, max = 0.95))]
    pub buried: f64,
}

fn default_buried() -> f64 {
    0.4
}
