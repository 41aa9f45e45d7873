//! The table of parameters that makes a species (§6 of the paper wishes for one): anemones with a foot and
//! tentacles, and seagrasses, which are the same fibres standing in the sand.
//!
//! The doc comments and ranges here are the reference: the JSON Schema, the checks of scenes, and
//! assets/species/README.md are made from them.

use glam::DVec2;
use reef_flow::color::linear_rgb;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// One species. A file NAME.toml in assets/species, or a table `[species.NAME]` of a scene; `base = "OTHER"`
/// takes over what the table does not set itself.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Species {
    /// Name for people.
    #[schemars(length(max = 200))]
    pub title: String,
    /// The wide fibre that the tentacles stand on. `foot = { height = 0 }`: none, the fibres stand in the
    /// ground (seagrasses).
    pub foot: Foot,
    /// The fibres on top.
    pub tentacles: Tentacles,
    /// Differences between individuals and between the fibres of one plant.
    pub variation: Variation,
    /// Colours and how light passes through.
    pub look: Look,
}

/// The foot: a column from the pedal disc to the oral disc.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Foot {
    /// Height of the column; 0: no foot. Taller columns lean further in a surge.
    #[schemars(range(min = 0.0, max = 2.0), extend("x-unit" = "m"))]
    pub height: f64,
    /// Radius of the pedal disc on the ground: wider looks more firmly attached.
    #[schemars(range(min = 0.001, max = 1.0), extend("x-unit" = "m"))]
    pub base_radius: f64,
    /// Radius of the column at its narrowest.
    #[schemars(range(min = 0.001, max = 1.0), extend("x-unit" = "m"))]
    pub waist_radius: f64,
    /// Radius of the oral disc: room for more or thicker tentacles.
    #[schemars(range(min = 0.001, max = 1.0), extend("x-unit" = "m"))]
    pub disc_radius: f64,
    /// Radius around the mouth that stays free of tentacles.
    #[schemars(range(min = 0.0, max = 1.0), extend("x-unit" = "m"))]
    pub mouth_radius: f64,
    /// Height at which the column is narrowest, as a share of the whole: low gives a vase, high a trumpet.
    #[schemars(range(min = 0.05, max = 0.95))]
    pub waist: f64,
    /// Nodes of its skeleton, the ground's included: more bend more smoothly, and cost more.
    #[schemars(range(min = 2, max = 64))]
    pub nodes: u32,
    /// Vertices of each of its rings at full detail.
    #[schemars(range(min = 3, max = 64))]
    pub sides: u32,
    /// K of eq. (11) at its top: less lets the whole animal sway.
    #[schemars(range(min = 1e-6, max = 1e9), extend("x-unit" = "N/m"))]
    pub stiffness: f64,
    /// n of eq. (11): greater keeps the wider parts still.
    #[schemars(range(min = 0.0, max = 40.0))]
    pub exponent: f64,
    /// τ: time in which it follows the water; greater is lazier, 0 is the paper's jump.
    #[schemars(range(min = 0.0, max = 60.0), extend("x-unit" = "s"))]
    pub relaxation: f64,
}

impl Default for Foot {
    fn default() -> Self {
        Self {
            height: 0.05,
            base_radius: 0.042,
            waist_radius: 0.03,
            disc_radius: 0.042,
            mouth_radius: 0.012,
            waist: 0.5,
            nodes: 10,
            sides: 32,
            stiffness: 450.0,
            exponent: 1.0,
            relaxation: 0.5,
        }
    }
}

/// The fibres on top of the foot: tentacles or blades.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Tentacles {
    /// How many. The disc may have room for fewer: the log says so.
    #[schemars(range(min = 0, max = 4096))]
    pub count: u32,
    /// How many of them are simulated as guides; the others take over the bends of the nearest three. 0: all
    /// are simulated.
    #[schemars(range(min = 0, max = 4096))]
    pub guides: u32,
    /// Nodes of each skeleton, the root included: more bend more smoothly, and cost more.
    #[schemars(range(min = 2, max = 64))]
    pub nodes: u32,
    /// Vertices of each ring at full detail.
    #[schemars(range(min = 3, max = 64))]
    pub sides: u32,
    /// Length from root to tip.
    #[schemars(range(min = 0.001, max = 5.0), extend("x-unit" = "m"))]
    pub length: f64,
    /// Length of those next to the mouth as a share of `length`, which those at the rim have.
    #[schemars(range(min = 0.1, max = 3.0))]
    pub inner_length: f64,
    /// Radius at the root; also what phyllotaxis keeps them apart by.
    #[schemars(range(min = 0.0001, max = 0.2), extend("x-unit" = "m"))]
    pub root_radius: f64,
    /// Radius at the tip; a blunt or a pointed look.
    #[schemars(range(min = 0.0001, max = 0.2), extend("x-unit" = "m"))]
    pub tip_radius: f64,
    /// Shape of the taper: 1 a cone, above 1 thin early, below 1 thick almost to the tip.
    #[schemars(range(min = 0.1, max = 5.0))]
    pub taper: f64,
    /// Extra radius of a bulb just below the tip, as a share of the tip's radius (bubble tips).
    #[schemars(range(min = 0.0, max = 4.0))]
    pub bulb: f64,
    /// Lean away from the axis at the mouth: 0 stands up, 90 lies flat.
    #[schemars(range(min = -90.0, max = 150.0), extend("x-unit" = "deg"))]
    pub inner_lean: f64,
    /// Lean away from the axis at the rim.
    #[schemars(range(min = -90.0, max = 150.0), extend("x-unit" = "deg"))]
    pub outer_lean: f64,
    /// Outward turn of the lower half at rest, from its root up: the arch of a fountain.
    #[schemars(range(min = -360.0, max = 360.0), extend("x-unit" = "deg"))]
    pub arch: f64,
    /// Outward turn of the upper half at rest; negative lets the tips curl up again.
    #[schemars(range(min = -360.0, max = 360.0), extend("x-unit" = "deg"))]
    pub curl: f64,
    /// Thickness over width of a flat blade; 1: round.
    #[schemars(range(min = 0.02, max = 1.0))]
    pub flatness: f64,
    /// K of eq. (11), at the tip: less bends further.
    #[schemars(range(min = 1e-9, max = 1e9), extend("x-unit" = "N/m"))]
    pub stiffness: f64,
    /// n of eq. (11): greater bends nearer to the tip.
    #[schemars(range(min = 0.0, max = 40.0))]
    pub exponent: f64,
    /// τ: time in which they follow the water; greater is lazier, 0 is the paper's jump.
    #[schemars(range(min = 0.0, max = 60.0), extend("x-unit" = "s"))]
    pub relaxation: f64,
    /// τ at the tip over τ at the root: greater lets the tip come after the base where the water swings; 1 is
    /// the paper's. Without a τ all jump together.
    #[schemars(range(min = 1.0, max = 100.0))]
    pub lag: f64,
    /// C_D of eq. (9): greater catches more of the current. The paper's ½ρLr is 0.5.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub drag_coefficient: f64,
    /// Force at the root that breaks one off (§4.3): then it is gone, from recordings, too. Without it:
    /// never.
    #[schemars(range(min = 1e-9, max = 1e9), extend("x-unit" = "N"))]
    pub break_force: Option<f64>,
}

impl Default for Tentacles {
    fn default() -> Self {
        Self {
            count: 60,
            guides: 0,
            nodes: 10,
            sides: 8,
            length: 0.054,
            inner_length: 0.8,
            root_radius: 0.003,
            tip_radius: 0.0012,
            taper: 1.0,
            bulb: 0.0,
            inner_lean: 12.0,
            outer_lean: 85.0,
            arch: 32.0,
            curl: -36.0,
            flatness: 1.0,
            stiffness: 4.2,
            exponent: 1.0,
            relaxation: 0.3,
            lag: 1.0,
            drag_coefficient: 0.5,
            break_force: None,
        }
    }
}

/// Differences between individuals and between the fibres of one plant, all from the scene's seed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Variation {
    /// Size of individuals, ± this share.
    #[schemars(range(min = 0.0, max = 0.5))]
    pub size: f64,
    /// Length of fibres, ± this share.
    #[schemars(range(min = 0.0, max = 0.9))]
    pub length: f64,
    /// Direction of fibres at their root, ± this angle.
    #[schemars(range(min = 0.0, max = 60.0), extend("x-unit" = "deg"))]
    pub lean: f64,
    /// Stiffness and τ of fibres, ± this share: neighbours get out of step.
    #[schemars(range(min = 0.0, max = 0.9))]
    pub motion: f64,
}

impl Default for Variation {
    fn default() -> Self {
        Self { size: 0.12, length: 0.12, lean: 8.0, motion: 0.2 }
    }
}

/// What a pattern looks like.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum PatternKind {
    /// Plain.
    #[default]
    None,
    /// Round spots.
    Spots,
    /// Rings around the fibre.
    Bands,
    /// Lines along the fibre.
    Stripes,
    /// Irregular patches.
    Blotches,
}

/// The surface of the foot or of the fibres.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Surface {
    /// Colour at the root, like "#A8182A" (sRGB).
    #[schemars(regex(pattern = "^#[0-9A-Fa-f]{6}$"))]
    pub base: String,
    /// Colour at the tip (for the foot: of the oral disc).
    #[schemars(regex(pattern = "^#[0-9A-Fa-f]{6}$"))]
    pub tip: String,
    /// Where along the fibre the tip's colour begins.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub tip_start: f64,
    /// Pattern over both colours.
    pub pattern: PatternKind,
    /// Colour of the pattern.
    #[schemars(regex(pattern = "^#[0-9A-Fa-f]{6}$"))]
    pub accent: String,
    /// Share of the surface that the pattern covers.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub accent_share: f64,
    /// Size of the pattern: spots or blotches a metre, bands or stripes in all.
    #[schemars(range(min = 0.0, max = 10000.0))]
    pub pattern_scale: f64,
    /// Softness of the pattern's edges.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub softness: f64,
    /// How much light shines through.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub translucency: f64,
}

impl Default for Surface {
    fn default() -> Self {
        Self {
            base: "#B79A6A".into(),
            tip: "#C9B48A".into(),
            tip_start: 0.6,
            pattern: PatternKind::None,
            accent: "#FFFFFF".into(),
            accent_share: 0.0,
            pattern_scale: 100.0,
            softness: 0.4,
            translucency: 0.6,
        }
    }
}

/// Colours and how light passes through.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Look {
    /// The foot and its disc.
    pub foot: Surface,
    /// The fibres.
    pub tentacles: Surface,
}

impl Species {
    /// What the ranges of single keys cannot say. The message begins with the key.
    pub fn check(&self) -> Result<(), (&'static str, String)> {
        let foot = &self.foot;
        let room = foot.disc_radius - foot.mouth_radius;
        if self.tentacles.count > 0 && room < 2.0 * self.tentacles.root_radius {
            return Err((
                "foot.disc_radius",
                format!(
                    "leaves no room for a tentacle: between the mouth ({} m) and the rim ({} m) a base {} m wide must fit",
                    foot.mouth_radius,
                    foot.disc_radius,
                    2.0 * self.tentacles.root_radius
                ),
            ));
        }
        for (key, color) in [
            ("look.foot.base", &self.look.foot.base),
            ("look.foot.tip", &self.look.foot.tip),
            ("look.foot.accent", &self.look.foot.accent),
            ("look.tentacles.base", &self.look.tentacles.base),
            ("look.tentacles.tip", &self.look.tentacles.tip),
            ("look.tentacles.accent", &self.look.tentacles.accent),
        ] {
            if linear_rgb(color).is_none() {
                return Err((key, format!("must be a colour like \"#A8182A\", is {color:?}")));
            }
        }
        Ok(())
    }

    /// Whether the plant stands on a foot.
    pub fn has_foot(&self) -> bool {
        self.foot.height > 0.0
    }

    /// Radius of the column at a share `t` of its height: the pedal disc's flare, the waist, the oral disc.
    pub fn foot_radius(&self, t: f64) -> f64 {
        let foot = &self.foot;
        let smooth = |u: f64| u * u * (3.0 - 2.0 * u);
        if t < foot.waist {
            let u = 1.0 - t / foot.waist;
            // The flare hugs the ground: most of it in the lowest third.
            foot.waist_radius + (foot.base_radius - foot.waist_radius) * u * u * u
        } else {
            let u = (t - foot.waist) / (1.0 - foot.waist);
            foot.waist_radius + (foot.disc_radius - foot.waist_radius) * smooth(u)
        }
    }

    /// Radius of a fibre at a share `t` of its length.
    pub fn tentacle_radius(&self, t: f64) -> f64 {
        let fibre = &self.tentacles;
        let cone = crate::math::pow(1.0 - t + 1e-12, fibre.taper);
        let bulb = (1.0 - ((t - 0.9) / 0.12) * ((t - 0.9) / 0.12)).max(0.0);
        fibre.tip_radius
            + (fibre.root_radius - fibre.tip_radius) * cone
            + fibre.tip_radius * fibre.bulb * bulb
    }

    /// Rest bends of a fibre of `segments` segments: the arch over the lower half, the curl over the upper
    /// one, outward.
    pub fn rest_bends(&self, segments: usize) -> Vec<DVec2> {
        let fibre = &self.tentacles;
        let total = [fibre.arch.to_radians(), fibre.curl.to_radians()];
        let weight = |i: usize| {
            // Middle of each joint; the two halves blend into each other.
            let t = (i as f64 + 0.5) / segments as f64;
            let upper = ((t - 0.25) * 2.0).clamp(0.0, 1.0);
            [1.0 - upper, upper]
        };
        let sums = (1..segments).map(weight).fold([0.0; 2], |sum, w| [sum[0] + w[0], sum[1] + w[1]]);
        (0..segments)
            .map(|i| {
                if i == 0 {
                    return DVec2::ZERO;
                }
                let w = weight(i);
                let part = |k: usize| if sums[k] > 0.0 { total[k] * w[k] / sums[k] } else { 0.0 };
                // No single joint turns by a right angle or more.
                DVec2::new((part(0) + part(1)).clamp(-1.5, 1.5), 0.0)
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_column_flares_at_the_ground_and_at_the_disc() {
        let species = Species::default();
        let foot = &species.foot;
        assert!((species.foot_radius(0.0) - foot.base_radius).abs() < 1e-12);
        assert!((species.foot_radius(foot.waist) - foot.waist_radius).abs() < 1e-12);
        assert!((species.foot_radius(1.0) - foot.disc_radius).abs() < 1e-12);
        assert!((0..=100).all(|i| species.foot_radius(f64::from(i) / 100.0) >= foot.waist_radius - 1e-12));
    }

    #[test]
    fn rest_bends_add_up_to_arch_and_curl() {
        let species = Species::default();
        let sum: f64 = species.rest_bends(9).iter().map(|bend| bend.x).sum();
        let wanted = (species.tentacles.arch + species.tentacles.curl).to_radians();
        assert!((sum - wanted).abs() < 1e-12);
        assert_eq!(species.rest_bends(1), [DVec2::ZERO]);
    }

    #[test]
    fn a_disc_without_room_and_a_wrong_colour_are_named() {
        let mut species = Species::default();
        assert_eq!(species.check(), Ok(()));
        species.look.tentacles.tip = "pink".into();
        assert_eq!(species.check().unwrap_err().0, "look.tentacles.tip");
        species.foot.mouth_radius = 0.04;
        assert_eq!(species.check().unwrap_err().0, "foot.disc_radius");
    }
}
