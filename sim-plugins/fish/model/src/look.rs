//! What a species looks like, as its table says.

use reef_flow::color::linear_rgb;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::body::BodyError;

/// What is drawn over the colours of back, side and belly.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Pattern {
    /// Nothing.
    #[default]
    Plain,
    /// Bars from the back to the belly, at shares of the length.
    Bars,
    /// Stripes from head to tail, at heights from 1 (back) to −1 (belly).
    Stripes,
    /// Irregular patches.
    Blotches,
    /// The regal tang's: a painter's palette.
    Palette,
}

/// What it looks like. Colours are sRGB.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Look {
    /// Colour of the back, like "#4A5A62".
    #[schemars(regex(pattern = "^#[0-9A-Fa-f]{6}$"))]
    pub back: String,
    /// Colour of the sides.
    #[schemars(regex(pattern = "^#[0-9A-Fa-f]{6}$"))]
    pub side: String,
    /// Colour of the belly.
    #[schemars(regex(pattern = "^#[0-9A-Fa-f]{6}$"))]
    pub belly: String,
    /// Colour of the fins.
    #[schemars(regex(pattern = "^#[0-9A-Fa-f]{6}$"))]
    pub fin: String,
    /// Colour of the fins' edges.
    #[schemars(regex(pattern = "^#[0-9A-Fa-f]{6}$"))]
    pub edge: String,
    /// Colour of the tail fin.
    #[schemars(regex(pattern = "^#[0-9A-Fa-f]{6}$"))]
    pub tail: String,
    /// Colour of the iris.
    #[schemars(regex(pattern = "^#[0-9A-Fa-f]{6}$"))]
    pub iris: String,
    /// What is drawn over them.
    pub pattern: Pattern,
    /// Colour of the pattern.
    #[schemars(regex(pattern = "^#[0-9A-Fa-f]{6}$"))]
    pub mark: String,
    /// Colour of the lines around bars.
    #[schemars(regex(pattern = "^#[0-9A-Fa-f]{6}$"))]
    pub line: String,
    /// Where bars or stripes are.
    #[schemars(length(max = 16), inner(range(min = -1.0, max = 1.0)))]
    pub marks: Vec<f64>,
    /// Width of a bar as a share of the length, of a stripe as a share of the height; how much of the skin
    /// patches cover.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub broad: f64,
    /// Scales from head to tail that can be seen. 0: none.
    #[schemars(range(min = 0.0, max = 200.0))]
    pub scales: f64,
    /// How dark the fold behind its gills is. 0: none.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub gill: f64,
    /// How much its scales mirror the sun.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub sheen: f64,
    /// Height of the skin over that of the sections, whose corners lie inside.
    #[schemars(range(min = 0.5, max = 3.0))]
    pub height: f64,
    /// Width of the skin over that of the sections.
    #[schemars(range(min = 0.2, max = 3.0))]
    pub width: f64,
    /// From a pointed snout (0) to a blunt one (1).
    #[schemars(range(min = 0.0, max = 1.0))]
    pub snout: f64,
    /// Diameter of an eye, as a share of the length.
    #[schemars(range(min = 0.0, max = 0.2))]
    pub eye: f64,
    /// Where the eyes are, as a share of the length from the nose.
    #[schemars(range(min = 0.01, max = 0.4))]
    pub eye_at: f64,
    /// How far the tail fin is cut in, as a share of its length; below 0 it is round.
    #[schemars(range(min = -0.5, max = 0.8))]
    pub fork: f64,
    /// The fin on its back.
    pub dorsal: Fin,
    /// The fin below, behind the belly.
    pub anal: Fin,
    /// The pair of fins behind its gills.
    pub pectoral: Fin,
    /// The pair of fins below its belly.
    pub pelvic: Fin,
}

/// A fin. A table that gives one gives all of it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Fin {
    /// Where its root begins, as a share of the length from the nose.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub from: f64,
    /// Where its root ends.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub to: f64,
    /// How far it stands out, as a share of the length. 0: there is none.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub height: f64,
    /// Where along its root it is highest.
    #[schemars(range(min = 0.05, max = 0.95))]
    pub peak: f64,
    /// How far its edge lies back, as a share of its height.
    #[schemars(range(min = 0.0, max = 3.0))]
    pub sweep: f64,
}

impl Default for Look {
    fn default() -> Self {
        Self {
            back: "#4A5A62".into(),
            side: "#8FA0A4".into(),
            belly: "#D8DEDA".into(),
            fin: "#7F8C8E".into(),
            edge: "#5C686A".into(),
            tail: "#7F8C8E".into(),
            iris: "#C8B46A".into(),
            pattern: Pattern::Plain,
            mark: "#20262A".into(),
            line: "#14110F".into(),
            marks: Vec::new(),
            broad: 0.08,
            scales: 60.0,
            gill: 0.3,
            sheen: 0.3,
            height: 1.35,
            width: 1.1,
            snout: 0.5,
            eye: 0.045,
            eye_at: 0.1,
            fork: 0.3,
            dorsal: Fin { from: 0.3, to: 0.72, height: 0.09, peak: 0.35, sweep: 0.5 },
            anal: Fin { from: 0.55, to: 0.74, height: 0.07, peak: 0.4, sweep: 0.5 },
            pectoral: Fin { from: 0.25, to: 0.3, height: 0.13, peak: 0.4, sweep: 0.5 },
            pelvic: Fin { from: 0.33, to: 0.38, height: 0.09, peak: 0.4, sweep: 0.8 },
        }
    }
}

impl Look {
    /// What the ranges of single keys cannot say.
    ///
    /// # Errors
    /// The key, and what is allowed.
    pub fn check(&self) -> Result<(), BodyError> {
        let refuse = |key: &str, problem: String| Err(BodyError { key: format!("look.{key}"), problem });
        let colors = [
            ("back", &self.back),
            ("side", &self.side),
            ("belly", &self.belly),
            ("fin", &self.fin),
            ("edge", &self.edge),
            ("tail", &self.tail),
            ("iris", &self.iris),
            ("mark", &self.mark),
            ("line", &self.line),
        ];
        for (key, color) in colors {
            if linear_rgb(color).is_none() {
                return refuse(key, format!("must be a colour like \"#4A5A62\", is {color:?}"));
            }
        }
        for (key, fin) in self.fins() {
            if fin.height > 0.0 && fin.from >= fin.to {
                return refuse(
                    &format!("{key}.to"),
                    format!("must be above `from`, which is {}, is {}", fin.from, fin.to),
                );
            }
        }
        Ok(())
    }

    /// Its fins but for the tail's, by their keys.
    pub fn fins(&self) -> [(&'static str, &Fin); 4] {
        [
            ("dorsal", &self.dorsal),
            ("anal", &self.anal),
            ("pectoral", &self.pectoral),
            ("pelvic", &self.pelvic),
        ]
    }
}
