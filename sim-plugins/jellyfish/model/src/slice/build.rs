//! What a slice is made of, and its shape at rest.

use glam::DVec2;

use super::LEAST_ROOM;
use crate::water::Grid;

/// Most joints of a tentacle's strand.
pub const STRAND: usize = 64;
/// Fewest and most points of the bell's chain.
pub const CHAIN: [usize; 2] = [9, 101];

/// A slice through the animal. The defaults are the paper's animal (figure 11), read as the crate says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Build {
    /// Width of the bell [m].
    pub diameter: f64,
    /// Height of the bell [m].
    pub height: f64,
    /// ϑ: thickness of the mesoglea [m].
    pub thickness: f64,
    /// Points of the sub-umbrellar chain; an odd number, one of them the apex.
    pub points: usize,
    /// E: elastic modulus along the chain [Pa].
    pub modulus: f64,
    /// Angular stiffness between neighbours [N·m/rad per metre of depth].
    pub bending: f64,
    /// Stiffness of all muscles together [N/m per metre of depth].
    pub muscle: f64,
    /// Stiffness of a muscle that is shorter than it rests, as a share.
    pub push: f64,
    /// Segments of the strand that hangs from each side of the margin; 0: none.
    pub strand_segments: usize,
    /// Length of the strand [m].
    pub strand: f64,
    /// Section of the strand, as a share of the bell's.
    pub strand_section: f64,
    /// Longest that a segment of the strand gets, over its length at rest: what would draw it out further
    /// slips along it. Infinite: the jet draws it out as its section lets it.
    pub strand_stretch: f64,
    /// Force that rights a bell that lies on its side [N per metre of depth].
    pub righting: f64,
    /// Weight less buoyancy [N per metre of depth].
    pub weight: f64,
}

impl Default for Build {
    fn default() -> Self {
        Self {
            diameter: 0.04,
            height: 0.028,
            thickness: 0.004,
            points: 31,
            modulus: 1186.0,
            bending: 0.03,
            muscle: 200.0,
            push: 1.0,
            strand_segments: 5,
            strand: 0.02,
            strand_section: 0.01,
            strand_stretch: f64::INFINITY,
            righting: 0.1,
            weight: 0.0,
        }
    }
}

/// Pairs of points next to the apex that no muscle joins: they hardly move.
const BARE_PAIRS: usize = 2;

/// Between two points: a Hookean spring.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Spring {
    pub(crate) ends: [usize; 2],
    /// Length at rest [m].
    pub(crate) rest: f64,
    /// k [N/m per metre of depth].
    pub(crate) stiffness: f64,
}

/// Between three neighbours: an angular spring.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hinge {
    pub(crate) points: [usize; 3],
    /// Cosine and sine of the angle at rest.
    pub(crate) rest: DVec2,
    /// [N·m/rad per metre of depth].
    pub(crate) stiffness: f64,
    /// Whether it bends where the animal turns: between the apex and the margin.
    pub(crate) turns: bool,
}

/// Across the bell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Muscle {
    pub(crate) spring: Spring,
    /// 0 next to the apex, 1 at the margin.
    pub(crate) place: f64,
}

/// The network of figure 4. Points come in pairs of opposite ones: 2 k is the k-th from the apex on the side
/// of negative x, 2 k + 1 on the other; 0 is the apex itself, and 1 is nothing.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Network {
    /// At rest, the middle of the margin at the origin [m].
    pub(crate) rest: Vec<DVec2>,
    pub(crate) springs: Vec<Spring>,
    pub(crate) hinges: Vec<Hinge>,
    pub(crate) muscles: Vec<Muscle>,
    /// The pair at the margin.
    pub(crate) margin: usize,
}

impl Build {
    /// Whether it can be built and stepped.
    ///
    /// # Errors
    /// The key, what is wrong with it, and what is allowed.
    pub fn check(&self) -> Result<(), String> {
        let above = [
            ("diameter", self.diameter, "m"),
            ("height", self.height, "m"),
            ("thickness", self.thickness, "m"),
            ("modulus", self.modulus, "Pa"),
        ];
        for (key, value, unit) in above {
            if !(value.is_finite() && value > 0.0) {
                return Err(format!("{key} must be above 0 {unit}, is {value}"));
            }
        }
        let not_below = [
            ("bending", self.bending, "N"),
            ("muscle", self.muscle, "N/m²"),
            ("push", self.push, ""),
            ("strand", self.strand, "m"),
            ("strand_section", self.strand_section, ""),
            ("righting", self.righting, "N/m"),
        ];
        for (key, value, unit) in not_below {
            if !(value.is_finite() && value >= 0.0) {
                return Err(format!("{key} must not be below 0 {unit}, is {value}"));
            }
        }
        if self.strand_stretch.is_nan() || self.strand_stretch < 1.0 {
            return Err(format!("strand_stretch must not be below 1, is {}", self.strand_stretch));
        }
        if !self.weight.is_finite() {
            return Err(format!("weight must be a number, is {}", self.weight));
        }
        let [fewest, most] = CHAIN;
        if !(fewest..=most).contains(&self.points) || self.points.is_multiple_of(2) {
            return Err(format!("points must be odd and {fewest} to {most}, are {}", self.points));
        }
        if self.strand_segments > STRAND {
            return Err(format!("strand_segments must be at most {STRAND}, are {}", self.strand_segments));
        }
        if self.strand_segments > 0 && self.strand <= 0.0 {
            return Err("strand must be longer than 0 m where it has segments".to_owned());
        }
        Ok(())
    }

    /// Whether there is room for it on a grid.
    ///
    /// # Errors
    /// How much it needs.
    pub(crate) fn check_room(&self, grid: &Grid) -> Result<(), String> {
        let tall = self.height + if self.strand_segments > 0 { self.strand } else { 0.0 };
        let (widest, width) = (self.diameter.max(tall), grid.width());
        if width < LEAST_ROOM * widest {
            return Err(format!(
                "the bell is larger than its window: {widest} m of bell and strand need {} m, the window has {width} m",
                LEAST_ROOM * widest
            ));
        }
        Ok(())
    }

    /// The half ellipse, from the apex to the margin, as `pairs` chords of one length [m]: places on the
    /// positive side.
    fn side(&self, pairs: usize) -> Vec<DVec2> {
        let (a, b) = (0.5 * self.diameter, self.height);
        let at = |angle: f64| {
            let (cos, sin) = reef_flow::math::cos_sin_f64(angle);
            DVec2::new(a * sin, b * cos)
        };
        // Arc lengths of a fine polygon, and where shares of the whole are reached.
        const FINE: usize = 4096;
        let angle = |k: f64| core::f64::consts::FRAC_PI_2 * k / FINE as f64;
        let mut lengths = vec![0.0];
        for k in 0..FINE {
            let chord = at(angle(k as f64)).distance(at(angle((k + 1) as f64)));
            lengths.push(lengths[k] + chord);
        }
        (1..=pairs)
            .map(|pair| {
                let length = lengths[FINE] * pair as f64 / pairs as f64;
                let k = lengths.partition_point(|other| *other < length).clamp(1, FINE);
                let share = (length - lengths[k - 1]) / (lengths[k] - lengths[k - 1]);
                at(angle((k - 1) as f64 + share.min(1.0)))
            })
            .collect()
    }

    /// The network, with all of its rest lengths and angles.
    pub(crate) fn network(&self) -> Network {
        let margin = self.points / 2;
        let mut rest = vec![DVec2::new(0.0, self.height); 2];
        for place in self.side(margin) {
            rest.extend([DVec2::new(-place.x, place.y), place]);
        }
        for k in 1..=self.strand_segments {
            let down = -self.strand * k as f64 / self.strand_segments as f64;
            let x = 0.5 * self.diameter;
            rest.extend([DVec2::new(-x, down), DVec2::new(x, down)]);
        }
        let last = margin + self.strand_segments;
        let mut made = Network { rest, springs: vec![], hinges: vec![], muscles: vec![], margin };
        // The next point toward the apex, and past it.
        let inner = |pair: usize, side: usize| if pair == 1 { 0 } else { 2 * (pair - 1) + side };
        for pair in 1..=last {
            for side in 0..2 {
                let ends = [inner(pair, side), 2 * pair + side];
                let section = if pair <= margin { 1.0 } else { self.strand_section };
                let length = made.rest[ends[0]].distance(made.rest[ends[1]]);
                let stiffness = self.modulus * self.thickness * section / length;
                made.springs.push(Spring { ends, rest: length, stiffness });
                if pair < last {
                    let points = [ends[0], ends[1], 2 * (pair + 1) + side];
                    let turns = pair < margin;
                    let stiffness = self.bending * if turns { 1.0 } else { self.strand_section };
                    made.hinges.push(Hinge { points, rest: made.angle(points), stiffness, turns });
                }
            }
        }
        let points = [2, 0, 3];
        made.hinges.push(Hinge { points, rest: made.angle(points), stiffness: self.bending, turns: false });
        let first = BARE_PAIRS + 1;
        let count = margin + 1 - first;
        for pair in first..=margin {
            let ends = [2 * pair, 2 * pair + 1];
            let length = made.rest[ends[0]].distance(made.rest[ends[1]]);
            let spring = Spring { ends, rest: length, stiffness: self.muscle / count as f64 };
            let place = (pair - first) as f64 / (count - 1).max(1) as f64;
            made.muscles.push(Muscle { spring, place });
        }
        made
    }
}

impl Network {
    /// Cosine and sine of the angle by which the chain bends at the middle one of three points at rest.
    fn angle(&self, [a, b, c]: [usize; 3]) -> DVec2 {
        let (before, after) = (self.rest[b] - self.rest[a], self.rest[c] - self.rest[b]);
        DVec2::new(before.dot(after), before.perp_dot(after)) / (before.length() * after.length())
    }
}
