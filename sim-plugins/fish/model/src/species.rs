//! Parameters of a species, as its table says.
//!
//! The doc comments and ranges here are the reference: the JSON Schema and the checks of scenes are made from
//! them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    Plan,
    body::{Body, BodyError, Profile},
    look::Look,
    material::{Beat, LEAST_MASS, Material},
};

/// A species of fish.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Species {
    /// Name for people.
    #[schemars(length(max = 100))]
    pub title: String,
    /// Its shape at rest, nose to tail.
    pub body: Shape,
    /// What it is made of.
    pub material: Stuff,
    /// How it swims.
    pub swim: Swim,
    /// How it behaves.
    pub mind: Mind,
    /// What it does to the water, and to anemones by it.
    pub carries: Carried,
    /// What it looks like.
    pub look: Look,
    /// Size of individuals, ± this share.
    #[schemars(range(min = 0.0, max = 0.7))]
    pub variation: f64,
}

/// Its shape at rest. The three lists have as many numbers as the body has sections, 2 to 64.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Shape {
    /// From each section to what is before it: the first one's to the nose.
    #[schemars(length(min = 2, max = 64), inner(range(min = 0.001, max = 10.0)), extend("x-unit" = "m"))]
    pub lengths: Vec<f64>,
    /// Half of each section's extent from left to right. Behind less than half of the front's it buckles.
    #[schemars(length(min = 2, max = 64), inner(range(min = 0.0005, max = 10.0)), extend("x-unit" = "m"))]
    pub half_widths: Vec<f64>,
    /// Half of each section's extent from top to bottom.
    #[schemars(length(min = 2, max = 64), inner(range(min = 0.0005, max = 10.0)), extend("x-unit" = "m"))]
    pub half_heights: Vec<f64>,
    /// From the last section to the tail fin's edge.
    #[schemars(range(min = 0.001, max = 10.0), extend("x-unit" = "m"))]
    pub tail: f64,
    /// Half of the tail fin's extent.
    #[schemars(range(min = 0.0005, max = 10.0), extend("x-unit" = "m"))]
    pub half_span: f64,
    /// The tail fin lies level and beats up and down, as a whale's.
    pub level_fin: bool,
}

impl Default for Shape {
    fn default() -> Self {
        let Profile { lengths, half_widths, half_heights, tail, half_span, level_fin } = Profile::default();
        Self { lengths, half_widths, half_heights, tail, half_span, level_fin }
    }
}

/// What it is made of.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Stuff {
    /// Stiffness of springs across the body.
    #[schemars(range(max = 1e9), extend("exclusiveMinimum" = 0.0, "x-unit" = "N/m"))]
    pub cross: f64,
    /// Stiffness of the diagonals along its sides.
    #[schemars(range(max = 1e9), extend("exclusiveMinimum" = 0.0, "x-unit" = "N/m"))]
    pub side: f64,
    /// Stiffness of the springs along it, and of its muscles: weak ones bend further.
    #[schemars(range(max = 1e9), extend("exclusiveMinimum" = 0.0, "x-unit" = "N/m"))]
    pub long: f64,
    /// Damping along each spring: greater trembles less.
    #[schemars(range(min = 0.0, max = 1e9), extend("x-unit" = "N·s/m"))]
    pub damping: f64,
    /// What a square metre of skin exerts on water that it meets at 1 m/s: all that drives it.
    #[schemars(range(min = 0.0, max = 1e6), extend("x-unit" = "N·s/m³"))]
    pub water: f64,
    /// Mass of the whole fish.
    #[schemars(range(min = LEAST_MASS, max = 1e6), extend("x-unit" = "kg"))]
    pub mass: f64,
    /// How strongly it is turned upright, as an acceleration of its top and its bottom.
    #[schemars(range(min = 0.0, max = 10.0), extend("x-unit" = "m/s²"))]
    pub righting: f64,
}

impl Default for Stuff {
    fn default() -> Self {
        let Material { cross, side, long, damping, water, mass, righting } = Material::default();
        Self { cross, side, long, damping, water, mass, righting }
    }
}

/// How it swims.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Swim {
    /// Its fastest beat.
    #[schemars(range(min = 0.05, max = 30.0), extend("x-unit" = "1/s"))]
    pub fastest: f64,
    /// By which share a muscle shortens.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub force: f64,
    /// How soft the change of sides is: 0 is a jump, 1 a change that takes all of the beat.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub edge: f64,
    /// By how much of a beat the rear muscles follow the front ones: a wave runs down an eel.
    #[schemars(range(min = -1.0, max = 1.0))]
    pub lag: f64,
    /// By which share the muscles of one side shorten more in the sharpest turn.
    #[schemars(range(min = 0.01, max = 0.4))]
    pub turn: f64,
}

impl Default for Swim {
    fn default() -> Self {
        Self { fastest: 3.0, force: 0.2, edge: 0.5, lag: 0.0, turn: 0.15 }
    }
}

/// How it behaves. Distances are in lengths of its body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Mind {
    /// How far it sees, in lengths: all around but for the 60 degrees behind it.
    #[schemars(range(min = 1.0, max = 50.0))]
    pub range: f64,
    /// How far it keeps from others, in lengths.
    #[schemars(range(min = 0.1, max = 20.0))]
    pub apart: f64,
    /// How strongly it keeps apart.
    #[schemars(range(min = 0.0, max = 20.0))]
    pub separation: f64,
    /// How strongly it swims the way that its own kind around it swims.
    #[schemars(range(min = 0.0, max = 20.0))]
    pub alignment: f64,
    /// How strongly it stays among its own kind.
    #[schemars(range(min = 0.0, max = 20.0))]
    pub cohesion: f64,
    /// How much it wanders.
    #[schemars(range(min = 0.0, max = 5.0))]
    pub wander: f64,
    /// Speed without haste, as a share of its top speed. 0: it hovers.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub cruise: f64,
    /// Species that it hunts, and that flee from it.
    #[schemars(length(max = 20))]
    pub prey: Vec<String>,
    /// Species of other modules that frighten it, whatever they do; of the rest it flees from those that are
    /// wider than it is long and faster than four fifths of its own top speed.
    #[schemars(length(max = 20))]
    pub fears: Vec<String>,
    /// It hunts only when it is hungry.
    pub hunger: bool,
    /// It courts others of its kind from time to time.
    pub mating: bool,
    /// How far it leaves its home, in lengths; from a predator it goes back to it. 0: it has none.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub home: f64,
    /// Species, as of anemones, that it lives in: the nearest of them in its box is its home, rather one
    /// without other fish. A home that a group gives comes first.
    #[schemars(length(max = 20))]
    pub lives_in: Vec<String>,
}

impl Default for Mind {
    fn default() -> Self {
        Self {
            range: 6.0,
            apart: 1.2,
            separation: 2.0,
            alignment: 1.0,
            cohesion: 0.6,
            wander: 0.4,
            cruise: 0.6,
            prey: Vec::new(),
            fears: Vec::new(),
            hunger: false,
            mating: false,
            home: 0.0,
            lives_in: Vec::new(),
        }
    }
}

/// Which kind of flow primitive it carries (Aliaga and Larboulette 2009, §2).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Singularity {
    /// None.
    #[default]
    None,
    /// Tentacles give way, as to a clownfish.
    Source,
    /// Tentacles reach for it, as for a regal tang.
    Hole,
}

/// What it does to the water.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Carried {
    /// The primitive.
    pub kind: Singularity,
    /// Φ near an anemone at its top speed.
    #[schemars(range(min = 0.0, max = 10.0), extend("x-unit" = "m³/s"))]
    pub strength: f64,
    /// How far it reaches, in lengths of its body.
    #[schemars(range(min = 0.1, max = 20.0))]
    pub reach: f64,
}

impl Default for Carried {
    fn default() -> Self {
        Self { kind: Singularity::None, strength: 0.002, reach: 3.0 }
    }
}

impl Species {
    /// Its body.
    ///
    /// # Errors
    /// The key within `body` that is wrong.
    pub fn body(&self) -> Result<Body, BodyError> {
        let Shape { lengths, half_widths, half_heights, tail, half_span, level_fin } = self.body.clone();
        Body::new(&Profile { lengths, half_widths, half_heights, tail, half_span, level_fin })
            .map_err(|error| BodyError { key: format!("body.{}", error.key), ..error })
    }

    /// What its body is made of.
    pub fn material(&self) -> Material {
        let Stuff { cross, side, long, damping, water, mass, righting } = self.material;
        Material { cross, side, long, damping, water, mass, righting }
    }

    /// How its muscles take turns.
    pub fn beat(&self) -> Beat {
        Beat { upright: self.body.level_fin, edge: self.swim.edge, lag: self.swim.lag }
    }

    /// Its body as the kernel walks it.
    ///
    /// # Errors
    /// The key that is wrong, and what is allowed.
    pub fn plan(&self) -> Result<Plan, BodyError> {
        Plan::new(&self.body()?, &self.material(), &self.beat())
            .map_err(|error| BodyError { key: format!("material.{}", error.key), ..error })
    }

    /// Holds a species by this name against its ranges, and against what ranges cannot say.
    ///
    /// # Errors
    /// The key that is wrong, and what is allowed.
    pub fn check(&self, name: &str) -> Result<(), BodyError> {
        self.plan()?;
        reef_sdk::ranges::check(self)
            .map_err(|error| BodyError { key: error.path.clone(), problem: error.message.clone() })?;
        if let Some(at) = self.mind.prey.iter().position(|prey| prey == name) {
            let problem = format!("`{name}` must not hunt itself");
            return Err(BodyError { key: format!("mind.prey[{at}]"), problem });
        }
        self.look.check()
    }
}
