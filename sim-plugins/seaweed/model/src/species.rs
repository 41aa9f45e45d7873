//! The table of parameters that makes a species of seaweed.
//!
//! The doc comments and ranges here are the reference: the JSON Schema, the checks of scenes, and
//! assets/species/SEAWEEDS.md are made from them.

use reef_flow::color::linear_rgb;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// One species of seaweed. A file NAME.toml in assets/species, or a table `[species.NAME]` of a scene; `base
/// = "OTHER"` takes over what the table does not set itself.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Species {
    /// Name for people.
    #[schemars(length(max = 200))]
    pub title: String,
    /// A plant that was modelled by hand: a binary glTF 2.0 file (.glb) in `modules/reef.seaweed` of the assets, from
    /// which joints come, and a skinned mesh where there is one. Empty: the plant grows from this table. With it,
    /// `stem.tissue` is what joints are of that no table in `joints` names, and what shapes the rest of a stem,
    /// forks and blades does nothing.
    #[schemars(length(max = 200))]
    pub skeleton: String,
    /// What the joints of a modelled plant are of, by their names and depths: the first that names a joint counts.
    #[schemars(length(max = 64))]
    pub joints: Vec<JointTable>,
    /// What stands in the ground: a blade, a stipe, ribbons.
    pub stem: Stem,
    /// Forks at the end of the stem, and of their own ends.
    pub forks: Forks,
    /// Blades along the stem.
    pub blades: Blades,
    /// How it moves as a whole.
    pub motion: Motion,
    /// Differences between individuals.
    pub variation: Variation,
    /// Colours and how light passes through.
    pub look: Look,
}

/// What a metre of stem, branch or blade is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Tissue {
    /// Width of its mesh: a ribbon's, or twice a stipe's radius.
    #[schemars(range(min = 0.0005, max = 3.0), extend("x-unit" = "m"))]
    pub width: f64,
    /// Thickness of its mesh: thin lets light through.
    #[schemars(range(min = 0.0001, max = 0.5), extend("x-unit" = "m"))]
    pub thickness: f64,
    /// EI: bending rigidity at its base; less leans further. A segment's spring is k = EI / L.
    #[schemars(range(min = 1e-7, max = 1e6), extend("x-unit" = "N·m²"))]
    pub rigidity: f64,
    /// Rigidity at its tip as a share of that at its base: small lets the tip trail.
    #[schemars(range(min = 1e-4, max = 10.0))]
    pub tip_rigidity: f64,
    /// v over k: greater is more sluggish.
    #[schemars(range(min = 0.0, max = 60.0), extend("x-unit" = "s"))]
    pub damping: f64,
    /// Drag of a metre in water that passes at 1 m/s: greater catches more of the current.
    #[schemars(range(min = 0.0, max = 1e4), extend("x-unit" = "N·s/m²"))]
    pub drag: f64,
    /// Mass of a metre: greater swings on.
    #[schemars(range(min = 1e-5, max = 1e3), extend("x-unit" = "kg/m"))]
    pub mass: f64,
    /// Mass of the water that moves along with a metre: greater follows the waves more than the current.
    #[schemars(range(min = 0.0, max = 1e3), extend("x-unit" = "kg/m"))]
    pub added_mass: f64,
    /// Buoyancy less weight of a metre: positive stands up, negative lies down.
    #[schemars(range(min = -100.0, max = 100.0), extend("x-unit" = "N/m"))]
    pub lift: f64,
}

impl Default for Tissue {
    fn default() -> Self {
        Self {
            width: 0.05,
            thickness: 0.002,
            rigidity: 0.15,
            tip_rigidity: 1.0,
            damping: 0.15,
            drag: 10.0,
            mass: 0.1,
            added_mass: 1.0,
            lift: 0.5,
        }
    }
}

/// What some joints of a modelled plant are of.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct JointTable {
    /// Names of joints in the file; `*` stands for any text.
    #[schemars(length(max = 100))]
    pub name: String,
    /// Least and greatest depth: joints from the root's, which is 0, to theirs.
    #[schemars(inner(range(min = 0, max = 255)))]
    pub depth: [u32; 2],
    /// What a metre of them is: mass, stiffness, drag, lift.
    pub tissue: Tissue,
    /// Lift of a gas bladder at the base of each.
    #[schemars(range(min = 0.0, max = 100.0), extend("x-unit" = "N"))]
    pub bladder: f64,
}

impl Default for JointTable {
    fn default() -> Self {
        Self { name: "*".into(), depth: [0, 255], tissue: Tissue::default(), bladder: 0.0 }
    }
}

/// What stands in the ground.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Stem {
    /// How many stand on one holdfast: a shoot of ribbons, a bush.
    #[schemars(range(min = 1, max = 64))]
    pub count: u32,
    /// Segments of each: more bend more smoothly, and cost more.
    #[schemars(range(min = 1, max = 256))]
    pub segments: u32,
    /// Length of each.
    #[schemars(range(min = 0.01, max = 80.0), extend("x-unit" = "m"))]
    pub length: f64,
    /// Lean of the outermost from the vertical: a tuft that opens.
    #[schemars(range(min = 0.0, max = 90.0), extend("x-unit" = "deg"))]
    pub spread: f64,
    /// Bend at rest from base to tip, outward.
    #[schemars(range(min = -360.0, max = 360.0), extend("x-unit" = "deg"))]
    pub curve: f64,
    /// Turn of each segment against the one below: a joint bends about one axis freely, so 90 lets two of
    /// them bend any way.
    #[schemars(range(min = -180.0, max = 180.0), extend("x-unit" = "deg"))]
    pub twist: f64,
    /// What a metre of it is.
    pub tissue: Tissue,
}

impl Default for Stem {
    fn default() -> Self {
        Self {
            count: 1,
            segments: 10,
            length: 1.0,
            spread: 0.0,
            curve: 0.0,
            twist: 90.0,
            tissue: Tissue::default(),
        }
    }
}

/// Forks at the end of the stem.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Forks {
    /// How often it forks in two, one after the other: each doubles the ends. 0: not at all.
    #[schemars(range(min = 0, max = 8))]
    pub times: u32,
    /// Segments of each branch.
    #[schemars(range(min = 1, max = 64))]
    pub segments: u32,
    /// Length of the first branches.
    #[schemars(range(min = 0.005, max = 20.0), extend("x-unit" = "m"))]
    pub length: f64,
    /// Length of a branch as a share of that which it forks from.
    #[schemars(range(min = 0.2, max = 1.5))]
    pub shrink: f64,
    /// Between a branch and the direction of what it forks from: wide opens the bush.
    #[schemars(range(min = 0.0, max = 90.0), extend("x-unit" = "deg"))]
    pub angle: f64,
    /// Turn of each fork's plane against the one before: 0 is a flat fan, 90 a bush.
    #[schemars(range(min = -180.0, max = 180.0), extend("x-unit" = "deg"))]
    pub turn: f64,
    /// Lift of the bladder at the base of each branch, so that they stand in pairs: they hold the plant up.
    #[schemars(range(min = 0.0, max = 100.0), extend("x-unit" = "N"))]
    pub bladder: f64,
}

impl Default for Forks {
    fn default() -> Self {
        Self { times: 0, segments: 2, length: 0.1, shrink: 0.85, angle: 28.0, turn: 70.0, bladder: 0.0 }
    }
}

/// Blades along the stem.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Blades {
    /// How many along each stem. 0: none.
    #[schemars(range(min = 0, max = 512))]
    pub count: u32,
    /// Where the first is, as a share of the stem's length.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub first: f64,
    /// Segments of each.
    #[schemars(range(min = 1, max = 64))]
    pub segments: u32,
    /// Length of the first; they grow shorter toward the tip.
    #[schemars(range(min = 0.005, max = 20.0), extend("x-unit" = "m"))]
    pub length: f64,
    /// Length of the last as a share of the first's.
    #[schemars(range(min = 0.05, max = 2.0))]
    pub tip_length: f64,
    /// Between a blade and its stem at rest.
    #[schemars(range(min = 0.0, max = 150.0), extend("x-unit" = "deg"))]
    pub angle: f64,
    /// Turn about the stem from one blade to the next: 180 is a feather, 137.5 a spiral.
    #[schemars(range(min = -360.0, max = 360.0), extend("x-unit" = "deg"))]
    pub spiral: f64,
    /// Lift of the gas bladder at the base of each blade: a canopy rises.
    #[schemars(range(min = 0.0, max = 100.0), extend("x-unit" = "N"))]
    pub bladder: f64,
    /// What a metre of them is.
    pub tissue: Tissue,
}

impl Default for Blades {
    fn default() -> Self {
        Self {
            count: 0,
            first: 0.1,
            segments: 2,
            length: 0.3,
            tip_length: 0.6,
            angle: 50.0,
            spiral: 137.5,
            bladder: 0.0,
            tissue: Tissue::default(),
        }
    }
}

/// How it moves as a whole.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Motion {
    /// τ: lag of the procedural method, by which far plants move.
    #[schemars(range(min = 0.0, max = 60.0), extend("x-unit" = "s"))]
    pub lag: f64,
    /// How much its acceleration pushes the water around it: Φ of its source over |a|. 0: it disturbs
    /// nothing.
    #[schemars(range(min = 0.0, max = 100.0), extend("x-unit" = "m²·s"))]
    pub disturbance: f64,
}

impl Default for Motion {
    fn default() -> Self {
        Self { lag: 0.3, disturbance: 0.01 }
    }
}

/// Differences between individuals, all from the scene's seed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Variation {
    /// Size of individuals, ± this share.
    #[schemars(range(min = 0.0, max = 0.7))]
    pub size: f64,
    /// Stiffness and damping, ± this share: neighbours get out of step.
    #[schemars(range(min = 0.0, max = 0.9))]
    pub stiffness: f64,
    /// Angles at rest, ± this angle at each joint: no two have the same shape.
    #[schemars(range(min = 0.0, max = 60.0), extend("x-unit" = "deg"))]
    pub bend: f64,
    /// Hue, ± this angle on the colour wheel.
    #[schemars(range(min = 0.0, max = 60.0), extend("x-unit" = "deg"))]
    pub hue: f64,
    /// Age of the oldest as a share: old blades have torn edges, and tips that pale.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub age: f64,
}

impl Default for Variation {
    fn default() -> Self {
        Self { size: 0.25, stiffness: 0.3, bend: 5.0, hue: 6.0, age: 1.0 }
    }
}

/// Colours and how light passes through.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Look {
    /// Colour of stipes and midribs, like "#5A4A20" (sRGB).
    #[schemars(regex(pattern = "^#[0-9A-Fa-f]{6}$"))]
    pub stem: String,
    /// Colour of blades at their base.
    #[schemars(regex(pattern = "^#[0-9A-Fa-f]{6}$"))]
    pub base: String,
    /// Colour of blades at their tip.
    #[schemars(regex(pattern = "^#[0-9A-Fa-f]{6}$"))]
    pub tip: String,
    /// How much light shines through.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub translucency: f64,
    /// Depth of the waves along a blade's edges, as a share of its width.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub ruffle: f64,
    /// How many waves an edge has along a blade.
    #[schemars(range(min = 0.0, max = 200.0))]
    pub ruffles: f64,
    /// Width of the midrib, as a share of the blade's. 0: none.
    #[schemars(range(min = 0.0, max = 0.5))]
    pub midrib: f64,
    /// Share of a flat stem's length that is a round stipe, below its blade. 0: the blade begins at the
    /// ground.
    #[schemars(range(min = 0.0, max = 0.9))]
    pub stipe: f64,
    /// Radius of the claw that holds it to the ground. 0: none is seen.
    #[schemars(range(min = 0.0, max = 2.0), extend("x-unit" = "m"))]
    pub holdfast: f64,
    /// Teeth on each side of a blade, which make it a feather. 0: none.
    #[schemars(range(min = 0, max = 64))]
    pub teeth: u32,
    /// Length of the longest of them.
    #[schemars(range(min = 0.0, max = 1.0), extend("x-unit" = "m"))]
    pub tooth: f64,
}

impl Default for Look {
    fn default() -> Self {
        Self {
            stem: "#5A4A20".into(),
            base: "#6B7A2A".into(),
            tip: "#9A8B3C".into(),
            translucency: 0.6,
            ruffle: 0.0,
            ruffles: 0.0,
            midrib: 0.0,
            stipe: 0.0,
            holdfast: 0.0,
            teeth: 0,
            tooth: 0.0,
        }
    }
}

impl Species {
    /// What the ranges of single keys cannot say. The message begins with the key.
    ///
    /// # Errors
    /// The key, and what is wrong with it.
    pub fn check(&self) -> Result<(), (&'static str, String)> {
        for (key, color) in
            [("look.stem", &self.look.stem), ("look.base", &self.look.base), ("look.tip", &self.look.tip)]
        {
            if linear_rgb(color).is_none() {
                return Err((key, format!("must be a colour like \"#6B7A2A\", is {color:?}")));
            }
        }
        let modelled = !self.skeleton.is_empty();
        if modelled && (self.forks.times > 0 || self.blades.count > 0) {
            let key = if self.forks.times > 0 { "forks.times" } else { "blades.count" };
            return Err((key, "must be 0 where `skeleton` names a file, which has all branches".into()));
        }
        if !modelled && !self.joints.is_empty() {
            return Err(("joints", "are those of a file, which `skeleton` must name".into()));
        }
        Ok(())
    }
}
