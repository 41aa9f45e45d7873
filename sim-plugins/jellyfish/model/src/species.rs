//! The table of parameters that makes a species of jellyfish.
//!
//! The doc comments and ranges here are the reference: the JSON Schema and the checks of scenes are made from
//! them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    slice::{Build, Gait},
    surface::{Form, FringeForm},
    water::Grid,
};

/// One species of jellyfish. A file NAME.toml in assets/species, or a table `[species.NAME]` of a scene;
/// `base = "OTHER"` takes over what the table does not set itself.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Species {
    /// Name for people.
    #[schemars(length(max = 200))]
    pub title: String,
    /// The bell that swims.
    pub bell: BellTable,
    /// How it swims.
    pub motion: Motion,
    /// The water around each animal.
    pub grid: GridTable,
    /// What the bell's surface looks like.
    pub surface: SurfaceTable,
    /// Tentacles around the margin.
    pub tentacles: Tentacles,
    /// Arms around the mouth.
    pub arms: Arms,
    /// Colours.
    pub look: Look,
}

/// The bell that swims.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct BellTable {
    /// Width at rest.
    #[schemars(range(min = 0.002, max = 2.0), extend("x-unit" = "m"))]
    pub diameter: f64,
    /// Height at rest: flat discs are slow, tall bells jet.
    #[schemars(range(min = 0.001, max = 2.0), extend("x-unit" = "m"))]
    pub height: f64,
    /// ϑ: thickness at the apex.
    #[schemars(range(min = 0.0001, max = 0.3), extend("x-unit" = "m"))]
    pub thickness: f64,
    /// Thickness at the margin as a share of that at the apex.
    #[schemars(range(min = 0.02, max = 1.0))]
    pub margin_thickness: f64,
    /// How stiff it is, against the paper's animal of the same size and frequency.
    #[schemars(range(min = 0.05, max = 20.0))]
    pub stiffness: f64,
    /// How strongly it rights itself, against the paper's animal of the same size and frequency.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub righting: f64,
    /// Length of the strand that hangs from each side of the margin and holds the water back; 0: none.
    #[schemars(range(min = 0.0, max = 2.0), extend("x-unit" = "m"))]
    pub strand: f64,
    /// Longest that a part of the strand gets, over its length at rest. The jet draws out a strand that may
    /// get 100 times as long to about five times its length, as the paper's section has it.
    #[schemars(range(min = 1.0, max = 100.0))]
    pub strand_stretch: f64,
    /// How much denser than the water its tissue is: what is denser sinks when it is idle.
    #[schemars(range(min = -50.0, max = 50.0), extend("x-unit" = "kg/m³"))]
    pub excess_density: f64,
}

impl Default for BellTable {
    fn default() -> Self {
        Self {
            diameter: 0.04,
            height: 0.028,
            thickness: 0.004,
            margin_thickness: 0.3,
            stiffness: 1.0,
            righting: 1.0,
            strand: 0.02,
            strand_stretch: 1.9,
            excess_density: 0.0,
        }
    }
}

/// How it swims.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Motion {
    /// Contractions a second; the bell is tuned to it.
    #[schemars(range(min = 0.05, max = 5.0), extend("x-unit" = "Hz"))]
    pub frequency: f64,
    /// How far the muscles contract: 0 is idle.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub strength: f64,
    /// Differences of frequency between individuals, ± this share.
    #[schemars(range(min = 0.0, max = 0.5))]
    pub variation: f64,
}

impl Default for Motion {
    fn default() -> Self {
        Self { frequency: 0.7, strength: 1.0, variation: 0.1 }
    }
}

/// The water around each animal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct GridTable {
    /// n: cells along a side; more feel finer eddies and cost more.
    #[schemars(range(min = 16, max = 256))]
    pub cells: u32,
    /// Width of the window, in widths of the bell.
    #[schemars(range(min = 2.5, max = 20.0))]
    pub bells: f64,
}

impl Default for GridTable {
    fn default() -> Self {
        Self { cells: 100, bells: 10.0 }
    }
}

/// What the bell's surface looks like. Heights are in thicknesses of the bell.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SurfaceTable {
    /// Vertices around a ring: 64, 128, 192 or 256.
    #[schemars(range(min = 64, max = 256))]
    pub around: u32,
    /// Rings from the apex over the margin to the inner apex; even.
    #[schemars(range(min = 8, max = 256))]
    pub rings: u32,
    /// Height of the ridges that the species has at rest, eq. (2).
    #[schemars(range(min = 0.0, max = 10.0))]
    pub structure: f64,
    /// How many of these there are.
    #[schemars(range(min = 0, max = 64))]
    pub structures: u32,
    /// Grooves between lobes instead of waves.
    pub lobes: bool,
    /// Height of the ridges of a contracted bell, eq. (4).
    #[schemars(range(min = 0.0, max = 10.0))]
    pub compression: f64,
    /// How many of these there are.
    #[schemars(range(min = 0, max = 64))]
    pub compressions: u32,
    /// Differences between individuals, eq. (5).
    #[schemars(range(min = 0.0, max = 10.0))]
    pub noise: f64,
}

impl Default for SurfaceTable {
    fn default() -> Self {
        let form = Form::default();
        Self {
            around: form.around as u32,
            rings: form.rings as u32,
            structure: form.structure,
            structures: form.structures,
            lobes: form.lobes,
            compression: form.compression,
            compressions: form.compressions,
            noise: form.noise,
        }
    }
}

/// Tentacles around the margin.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Tentacles {
    /// How many: a multiple of 8; 0: none.
    #[schemars(range(min = 0, max = 256))]
    pub count: u32,
    /// Length, that of the strand included.
    #[schemars(range(min = 0.0, max = 20.0), extend("x-unit" = "m"))]
    pub length: f64,
    /// Radius at the root.
    #[schemars(range(min = 0.00002, max = 0.1), extend("x-unit" = "m"))]
    pub radius: f64,
    /// Differences of lengths, ± this share.
    #[schemars(range(min = 0.0, max = 0.9))]
    pub variation: f64,
}

impl Default for Tentacles {
    fn default() -> Self {
        Self { count: 24, length: 0.05, radius: 0.0004, variation: 0.3 }
    }
}

/// Arms around the mouth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Arms {
    /// How many: a multiple of 8; 0: none.
    #[schemars(range(min = 0, max = 64))]
    pub count: u32,
    /// Length.
    #[schemars(range(min = 0.0, max = 20.0), extend("x-unit" = "m"))]
    pub length: f64,
    /// Half of their width at the root.
    #[schemars(range(min = 0.00002, max = 0.2), extend("x-unit" = "m"))]
    pub width: f64,
    /// Depth of the frills of their edges, as a share of the width.
    #[schemars(range(min = 0.0, max = 0.95))]
    pub frill: f64,
    /// How many frills there are along an arm.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub frills: f64,
}

impl Default for Arms {
    fn default() -> Self {
        Self { count: 0, length: 0.03, width: 0.003, frill: 0.4, frills: 6.0 }
    }
}

/// Colours, like "#DDE6F2" (sRGB).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Look {
    /// The bell.
    #[schemars(regex(pattern = "^#[0-9A-Fa-f]{6}$"))]
    pub bell: String,
    /// Tentacles.
    #[schemars(regex(pattern = "^#[0-9A-Fa-f]{6}$"))]
    pub tentacles: String,
    /// Arms.
    #[schemars(regex(pattern = "^#[0-9A-Fa-f]{6}$"))]
    pub arms: String,
    /// The margin, canals and streaks.
    #[schemars(regex(pattern = "^#[0-9A-Fa-f]{6}$"))]
    pub rim: String,
    /// The horseshoes around the mouth.
    #[schemars(regex(pattern = "^#[0-9A-Fa-f]{6}$"))]
    pub gonads: String,
    /// How many of these there are.
    #[schemars(range(min = 0, max = 8))]
    pub gonad_count: u32,
    /// How many canals run from the stomach to the margin.
    #[schemars(range(min = 0, max = 64))]
    pub canals: u32,
    /// How strong the streaks of the exumbrella are, one a lobe of 16.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub streaks: f64,
    /// The light that it makes.
    #[schemars(regex(pattern = "^#[0-9A-Fa-f]{6}$"))]
    pub glow: String,
    /// How much of what is behind the middle of the bell it hides.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub opacity: f64,
    /// How much light shines through.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub translucency: f64,
}

impl Default for Look {
    fn default() -> Self {
        Self {
            bell: "#DDE6F2".into(),
            tentacles: "#E8D8D0".into(),
            arms: "#EFE0DC".into(),
            rim: "#C9D6EA".into(),
            gonads: "#C9A6D8".into(),
            gonad_count: 0,
            canals: 16,
            streaks: 0.0,
            glow: "#5FD0FF".into(),
            opacity: 0.35,
            translucency: 0.9,
        }
    }
}

/// g [m/s²].
const GRAVITY: f64 = 9.81;
/// Length of a strand's segment, as a share of the bell's width.
const SEGMENT: f64 = 0.1;
/// Thickness of an arm over its width.
const ARM_FLATNESS: f64 = 0.15;
/// Radius of an arm's and a tentacle's tip, as a share.
const ARM_TAPER: f64 = 0.25;
const TENTACLE_TAPER: f64 = 0.4;

impl Species {
    /// The slice of an animal of this species.
    ///
    /// Forces grow with ρ · diameter · (diameter · frequency)²: so an animal of another size moves like the
    /// paper's, at its own frequency.
    pub fn build(&self) -> Build {
        let paper = Build::default();
        let (size, pace) =
            (self.bell.diameter / paper.diameter, self.motion.frequency / Gait::default().frequency);
        let stiff = self.bell.stiffness * pace * pace;
        let segments = (self.bell.strand / (SEGMENT * self.bell.diameter)).round();
        Build {
            diameter: self.bell.diameter,
            height: self.bell.height,
            thickness: self.bell.thickness,
            points: paper.points,
            // E ϑ is what counts: a thinner bell of the same stiffness is of a harder tissue.
            modulus: paper.modulus * paper.thickness * stiff * size.powi(3) / self.bell.thickness,
            bending: paper.bending * stiff * size.powi(4),
            muscle: paper.muscle * stiff * size.powi(2),
            push: paper.push,
            strand_segments: if self.bell.strand > 0.0 { segments.clamp(1.0, 32.0) as usize } else { 0 },
            strand: self.bell.strand,
            strand_section: paper.strand_section,
            strand_stretch: self.bell.strand_stretch,
            righting: self.bell.righting * paper.righting * pace * pace * size.powi(3),
            weight: self.weight(self.bell.excess_density),
        }
    }

    /// Weight less buoyancy of tissue that is so much denser than the water [N per metre of depth].
    pub fn weight(&self, excess_density: f64) -> f64 {
        // Half of an ellipse's circumference (Ramanujan), and the mean of figure 3's profile.
        let (a, b) = (0.5 * self.bell.diameter, self.bell.height);
        let chain = core::f64::consts::FRAC_PI_2 * (3.0 * (a + b) - ((3.0 * a + b) * (a + 3.0 * b)).sqrt());
        let mean = (2.0 + self.bell.margin_thickness) / 3.0 * self.bell.thickness;
        excess_density * GRAVITY * chain * mean
    }

    /// An individual that is larger by a factor, in all its lengths.
    pub fn sized(&self, size: f64) -> Self {
        let mut made = self.clone();
        let lengths = [
            &mut made.bell.diameter,
            &mut made.bell.height,
            &mut made.bell.thickness,
            &mut made.bell.strand,
            &mut made.tentacles.length,
            &mut made.tentacles.radius,
            &mut made.arms.length,
            &mut made.arms.width,
        ];
        lengths.into_iter().for_each(|length| *length *= size);
        made
    }

    /// The grid of its water, of so much density [kg/m³] and kinematic viscosity [m²/s].
    pub fn water(&self, density: f64, viscosity: f64) -> Grid {
        let n = self.grid.cells as usize;
        let cell = self.grid.bells * self.bell.diameter / f64::from(self.grid.cells.max(1));
        Grid { n, cell, density, viscosity }
    }

    /// How it swims when nothing else is said.
    pub fn gait(&self) -> Gait {
        Gait { frequency: self.motion.frequency, strength: self.motion.strength, turn: 0.0 }
    }

    /// The form of its bell's surface.
    pub fn form(&self) -> Form {
        let surface = &self.surface;
        Form {
            around: surface.around as usize,
            rings: surface.rings as usize,
            margin_thickness: self.bell.margin_thickness,
            structure: surface.structure,
            structures: surface.structures,
            lobes: surface.lobes,
            compression: surface.compression,
            compressions: surface.compressions,
            noise: surface.noise,
        }
    }

    /// The form of its tentacles.
    pub fn tentacle_form(&self) -> FringeForm {
        FringeForm {
            count: self.tentacles.count as usize,
            radius: [self.tentacles.radius; 2],
            taper: TENTACLE_TAPER,
            frill: 0.0,
            frills: 0.0,
            variation: self.tentacles.variation,
        }
    }

    /// The form of its arms.
    pub fn arm_form(&self) -> FringeForm {
        FringeForm {
            count: self.arms.count as usize,
            radius: [self.arms.width, ARM_FLATNESS * self.arms.width],
            taper: ARM_TAPER,
            frill: self.arms.frill,
            frills: self.arms.frills,
            variation: 0.2,
        }
    }

    /// What is wrong with it. The message begins with the key.
    ///
    /// # Errors
    /// The first key that is out of its range, or does not fit another one, and what is allowed.
    pub fn check(&self) -> Result<(), String> {
        reef_sdk::ranges::check(self).map_err(|error| error.to_string())?;
        for (key, color) in [
            ("look.bell", &self.look.bell),
            ("look.tentacles", &self.look.tentacles),
            ("look.arms", &self.look.arms),
            ("look.rim", &self.look.rim),
            ("look.gonads", &self.look.gonads),
            ("look.glow", &self.look.glow),
        ] {
            if reef_flow::color::linear_rgb(color).is_none() {
                return Err(format!("{key}: must be a colour like \"#DDE6F2\", is {color:?}"));
            }
        }
        self.form().check().map_err(|problem| format!("surface.{problem}"))?;
        self.check_sizes()?;
        for (key, count) in [("tentacles", self.tentacles.count), ("arms", self.arms.count)] {
            if count % 8 != 0 {
                return Err(format!("{key}.count: must be a multiple of 8, is {count}"));
            }
        }
        Ok(())
    }

    /// What is wrong with its lengths, which an individual's size multiplies. The message begins with the
    /// key.
    ///
    /// # Errors
    /// As [`Species::check`].
    pub fn check_sizes(&self) -> Result<(), String> {
        reef_sdk::ranges::check(&self.bell).map_err(|error| format!("bell.{error}"))?;
        for (key, form) in [("tentacles.radius", self.tentacle_form()), ("arms.width", self.arm_form())] {
            if let Some(radius) = form.radius.iter().find(|radius| **radius > 1.0) {
                return Err(format!("{key}: makes tubes of a radius of {radius} m; the limit is 1 m"));
            }
        }
        let tall = self.bell.height + self.bell.strand;
        let window = self.grid.bells * self.bell.diameter;
        if window < crate::slice::LEAST_ROOM * tall.max(self.bell.diameter) {
            return Err(format!(
                "grid.bells: the bell is larger than its window allows: bell and strand are {tall} m tall, the window is {window} m wide and must be {} times as wide",
                crate::slice::LEAST_ROOM
            ));
        }
        Ok(())
    }
}
