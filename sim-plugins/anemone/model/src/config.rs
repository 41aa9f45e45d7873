//! The module's table in a scene file.

use reef_sdk::describe_species;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::species::Species;

/// Most anemones, scattered ones included.
pub const MOST_PLANTS: u64 = 20_000;
/// Most fibres in all, feet included.
pub const MOST_FIBRES: u64 = 400_000;
/// Most nodes in all.
pub const MOST_NODES: u64 = 4_000_000;

/// What the anemone module puts into a scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(transform = describe_species::<Species>)]
pub struct Config {
    /// Anemones and seagrasses one by one.
    #[schemars(length(max = 20000))]
    pub anemones: Vec<Anemone>,
    /// Anemones and seagrasses scattered by seed.
    #[schemars(length(max = 1000))]
    pub scatter: Vec<Scatter>,
    /// Bare fibres in grids, without a plant (the paper's figures 10 to 12). Up to eight by eight of a grid
    /// are one object.
    #[schemars(length(max = 1000))]
    pub fibres: Vec<FibreGrid>,
    /// Tufts of guide fibres with more fibres interpolated between them (figure 18).
    #[schemars(length(max = 1000))]
    pub tufts: Vec<Tuft>,
}

/// One anemone or tuft of seagrass.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Anemone {
    /// Which species: a file of assets/species, or a table `[species.NAME]` of the scene.
    #[schemars(length(max = 100))]
    pub species: String,
    /// Where it stands: x, y, z. Over a sea bed, y counts from the bed.
    #[serde(default)]
    #[schemars(extend("x-unit" = "m"))]
    pub position: [f64; 3],
    /// Size over that of its species.
    #[serde(default = "one")]
    #[schemars(range(min = 0.01, max = 1000.0))]
    pub scale: f64,
    /// Turn about the vertical.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0), extend("x-unit" = "deg"))]
    pub yaw: f64,
    /// Seed of its differences from others of its kind. Without it: its place in the list.
    #[serde(default)]
    pub seed: Option<u32>,
}

/// Anemones or seagrasses scattered over a rectangle of the sea bed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scatter {
    /// Which species; drawn from the list at random.
    #[schemars(length(min = 1, max = 100))]
    pub species: Vec<String>,
    /// How many. Where the rectangle has no room for them at their `spacing`, fewer come.
    #[schemars(range(min = 1, max = 20000))]
    pub count: u32,
    /// x and z of the rectangle's middle.
    #[serde(default)]
    #[schemars(extend("x-unit" = "m"))]
    pub center: [f64; 2],
    /// Its extent along x and z.
    #[schemars(inner(range(min = 0.0)), extend("x-unit" = "m"))]
    pub size: [f64; 2],
    /// Least distance from one to the next.
    #[serde(default)]
    #[schemars(range(min = 0.0), extend("x-unit" = "m"))]
    pub spacing: f64,
    /// Least and greatest size over that of the species.
    #[serde(default = "some_size")]
    #[schemars(inner(range(min = 0.01, max = 1000.0)))]
    pub scale: [f64; 2],
    /// Columns and rows of a regular grid in place of chance; then `count` is their product at most.
    #[serde(default)]
    #[schemars(inner(range(min = 1, max = 20000)))]
    pub grid: Option<[u32; 2]>,
    /// Seed of the places. Without it: the scene's.
    #[serde(default)]
    pub seed: Option<u32>,
}

/// Equal fibres in a grid on a level plane.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct FibreGrid {
    /// The middle of the grid.
    #[schemars(extend("x-unit" = "m"))]
    pub position: [f64; 3],
    /// Fibres along x and along z.
    #[schemars(inner(range(min = 1, max = 1000)))]
    pub count: [u32; 2],
    /// Distance between neighbours.
    #[schemars(range(min = 0.0), extend("x-unit" = "m"))]
    pub spacing: f64,
    /// Nodes of each, the root included.
    #[schemars(range(min = 2, max = 256))]
    pub nodes: u32,
    /// L: length of each segment.
    #[schemars(range(min = 1e-9), extend("x-unit" = "m"))]
    pub length: f64,
    /// Radius at the root and at the tip; each node's is the same share of the one below.
    #[schemars(inner(range(min = 1e-9)), extend("x-unit" = "m"))]
    pub radius: [f64; 2],
    /// K of eq. (11).
    #[schemars(range(max = 1e12), extend("exclusiveMinimum" = 0.0, "x-unit" = "N/m"))]
    pub stiffness: f64,
    /// n of eq. (11).
    #[schemars(range(min = 0.0, max = 40.0))]
    pub exponent: f64,
    /// A of eq. (9), the same at every node. Without it: ρ C_D L r with C_D = 0.5.
    #[schemars(range(min = 0.0, max = 1e6), extend("x-unit" = "kg/s"))]
    pub drag: Option<f64>,
    /// τ: time in which they follow the water; 0 is the paper's jump.
    #[schemars(range(min = 0.0, max = 60.0), extend("x-unit" = "s"))]
    pub relaxation: f64,
    /// Force at the root that breaks a fibre off (§4.3): then it is gone, from recordings, too. Without it:
    /// never.
    #[schemars(range(min = 1e-9, max = 1e12), extend("x-unit" = "N"))]
    pub break_force: Option<f64>,
    /// Lean from the vertical toward +x.
    #[schemars(range(min = -180.0, max = 180.0), extend("x-unit" = "deg"))]
    pub lean: f64,
    /// Bend of the rest shape from root to tip, toward +x.
    #[schemars(range(min = -720.0, max = 720.0), extend("x-unit" = "deg"))]
    pub curve: f64,
    /// Vertices of a ring at full detail.
    #[schemars(range(min = 3, max = 64))]
    pub sides: u32,
    /// Colours from root to tip.
    #[schemars(inner(regex(pattern = "^#[0-9A-Fa-f]{6}$")))]
    pub colors: [String; 2],
}

impl Default for FibreGrid {
    fn default() -> Self {
        Self {
            position: [0.0; 3],
            count: [1, 1],
            spacing: 0.02,
            nodes: 10,
            length: 0.006,
            radius: [0.003, 0.0012],
            stiffness: 4.2,
            exponent: 1.0,
            drag: None,
            relaxation: 0.3,
            break_force: None,
            lean: 0.0,
            curve: 0.0,
            sides: 8,
            colors: ["#7A4A32".into(), "#D8A070".into()],
        }
    }
}

/// A tuft of equal fibres that fan out from a disc under a steady load.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Tuft {
    /// The middle of its roots. Over a sea bed, y counts from the bed.
    #[schemars(extend("x-unit" = "m"))]
    pub position: [f64; 3],
    /// Fibres that are simulated.
    #[schemars(range(min = 1, max = 4096))]
    pub guides: u32,
    /// Fibres in all; those beyond the guides take over the bends of the nearest three.
    #[schemars(range(min = 1, max = 65536))]
    pub fibres: u32,
    /// Nodes of each, the root included.
    #[schemars(range(min = 2, max = 64))]
    pub nodes: u32,
    /// L: length of each segment.
    #[schemars(range(min = 1e-9), extend("x-unit" = "m"))]
    pub length: f64,
    /// Radius at the root and at the tip.
    #[schemars(inner(range(min = 1e-9)), extend("x-unit" = "m"))]
    pub radius: [f64; 2],
    /// Radius of the disc that the roots stand on.
    #[schemars(range(min = 1e-9), extend("x-unit" = "m"))]
    pub spread: f64,
    /// Lean of the outermost fibres.
    #[schemars(range(min = 0.0, max = 170.0), extend("x-unit" = "deg"))]
    pub lean: f64,
    /// K of eq. (11).
    #[schemars(range(max = 1e12), extend("exclusiveMinimum" = 0.0, "x-unit" = "N/m"))]
    pub stiffness: f64,
    /// n of eq. (11).
    #[schemars(range(min = 0.0, max = 40.0))]
    pub exponent: f64,
    /// A of eq. (9), the same at every node.
    #[schemars(range(min = 0.0, max = 1e6), extend("x-unit" = "kg/s"))]
    pub drag: f64,
    /// Weight of each node in water, downward.
    #[schemars(range(min = -1e9, max = 1e9), extend("x-unit" = "N"))]
    pub weight: f64,
    /// τ: time in which they follow the water.
    #[schemars(range(min = 0.0, max = 60.0), extend("x-unit" = "s"))]
    pub relaxation: f64,
    /// Vertices of a ring at full detail.
    #[schemars(range(min = 3, max = 64))]
    pub sides: u32,
    /// Colours from root to tip.
    #[schemars(inner(regex(pattern = "^#[0-9A-Fa-f]{6}$")))]
    pub colors: [String; 2],
}

impl Default for Tuft {
    fn default() -> Self {
        Self {
            position: [0.0; 3],
            guides: 50,
            fibres: 50,
            nodes: 10,
            length: 0.05,
            radius: [0.003, 0.003],
            spread: 0.1,
            lean: 35.0,
            stiffness: 1.0,
            exponent: 0.0,
            drag: 0.0,
            weight: 0.002,
            relaxation: 0.3,
            sides: 6,
            colors: ["#4E6A2C".into(), "#A8B45A".into()],
        }
    }
}

fn one() -> f64 {
    1.0
}

fn some_size() -> [f64; 2] {
    [0.8, 1.2]
}
