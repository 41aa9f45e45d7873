//! How high and how wide the skin is along the body.

use core::f64::consts::TAU;

use glam::DVec3;
use reef_flow::math::cos_sin_f64;

use crate::species::Species;

/// How far the skin reaches into the tail fin, as a share of it.
const STALK: f64 = 0.35;
/// Height and width of a blunt head at its first section, over those at its second.
const BLUNT: [f64; 2] = [0.8, 0.82];
/// Height of its end over the last section's.
const STALK_HEIGHT: f64 = 0.75;

/// The skin of a species at rest.
#[derive(Clone, Debug)]
pub struct Outline {
    /// The nose [m].
    pub nose: f64,
    /// From the nose to the tail fin's edge [m].
    pub length: f64,
    /// Where the skin ends, as a share of the length.
    pub end: f64,
    /// Of the joints, nose first [m].
    stations: Vec<f64>,
    /// Shares of the length, half heights and half widths [m].
    knots: Vec<[f64; 3]>,
    snout: f64,
}

impl Outline {
    /// Of a table that was checked.
    pub fn new(species: &Species) -> Self {
        let (body, look) = (&species.body, &species.look);
        let length = body.lengths.iter().sum::<f64>() + body.tail;
        let mut knots = vec![[0.0; 3]];
        let (mut way, mut ways) = (0.0, vec![0.0]);
        for ((step, height), width) in body.lengths.iter().zip(&body.half_heights).zip(&body.half_widths) {
            way += step;
            ways.push(way);
            knots.push([way / length, height * look.height, width * look.width]);
        }
        // The snout goes on from a blunt head's second section, not from its first.
        let neck = knots[2];
        for (axis, share) in [(1, BLUNT[0]), (2, BLUNT[1])] {
            let blunt = (share * neck[axis]).max(knots[1][axis]);
            knots[1][axis] += (blunt - knots[1][axis]) * look.snout;
        }
        let end = (way + STALK * body.tail) / length;
        let [_, height, width] = knots[knots.len() - 1];
        // A stalk: flat where the fin begins.
        knots.push(if body.level_fin {
            [end, 0.0, width * STALK_HEIGHT]
        } else {
            [end, height * STALK_HEIGHT, 0.0]
        });
        ways.push(length);
        // The model's origin is the mean of its nodes: four a section, two of the fin, one of the nose.
        let sections = (body.lengths.len() * 4) as f64;
        let sum = ways[1..ways.len() - 1].iter().sum::<f64>() * 4.0 + 2.0 * length;
        let nose = sum / (sections + 3.0);
        Self {
            nose,
            length,
            end,
            stations: ways.iter().map(|way| nose - way).collect(),
            knots,
            snout: look.snout,
        }
    }

    /// x at a share of the length from the nose [m].
    pub fn x(&self, v: f64) -> f64 {
        self.nose - v * self.length
    }

    /// Where the last section is, as a share of the length.
    pub fn last(&self) -> f64 {
        self.knots[self.knots.len() - 2][0]
    }

    /// How many joints lie ahead of x, with shares.
    pub fn station(&self, x: f64) -> f64 {
        let last = self.stations.len() - 1;
        let next = self.stations.partition_point(|station| *station > x).clamp(1, last);
        let [ahead, behind] = [self.stations[next - 1], self.stations[next]];
        next as f64 - 1.0 + ((ahead - x) / (ahead - behind)).clamp(0.0, 1.0)
    }

    /// Half of its height and of its width [m] at a share of the length.
    pub fn extent(&self, v: f64) -> [f64; 2] {
        let knots = &self.knots;
        let next = knots.partition_point(|knot| knot[0] < v).clamp(1, knots.len() - 1);
        let t = ((v - knots[next - 1][0]) / (knots[next][0] - knots[next - 1][0])).clamp(0.0, 1.0);
        core::array::from_fn(|axis| {
            if next == 1 {
                // Round at the nose.
                let root = t.sqrt();
                return knots[1][axis + 1] * (t + (root - t) * (0.4 + 0.5 * self.snout));
            }
            // A cubic through the knots that follows the ways between their neighbours.
            let slope = |i: usize| {
                let (a, b) = (knots[i - 1], knots[(i + 1).min(knots.len() - 1)]);
                (b[axis + 1] - a[axis + 1]) / (b[0] - a[0])
            };
            let step = knots[next][0] - knots[next - 1][0];
            let (a, b) = (knots[next - 1][axis + 1], knots[next][axis + 1]);
            let (from, to) = (slope(next - 1) * step, slope(next) * step);
            let left = 1.0 - t;
            let value =
                left * left * ((1.0 + 2.0 * t) * a + t * from) + t * t * ((3.0 - 2.0 * t) * b - left * to);
            value.max(0.0)
        })
    }

    /// A place on the skin: at a share of the length, and a share of a turn from the back over the right side
    /// [m].
    pub fn skin(&self, v: f64, turn: f64) -> DVec3 {
        let [height, width] = self.extent(v);
        let (cos, sin) = cos_sin_f64(TAU * turn);
        DVec3::new(self.x(v), height * cos, width * sin)
    }
}
