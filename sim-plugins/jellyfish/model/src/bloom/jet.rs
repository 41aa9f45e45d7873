//! What an animal does to the sea: a few whirlwinds and sources in the plane of its slice, chosen anew in
//! each step so that they come nearest to the water of the slice (orthogonal matching pursuit).
//!
//! The sea's primitives fall off in three dimensions and know neither the slice's walls nor the small eddies
//! of a wake: [`Fit::squares`] says what four of them miss. More of them miss less, and cost everything that
//! feels them more.

use core::f64::consts::TAU;

use glam::{DVec2, DVec3};
use reef_flow::math::cos_sin_f64;
use reef_sdk::abi::{self, Flow};

use crate::{lanes::Real, slice::Slice};

/// Rings of places at which the fit looks, in widths of the bell around the middle of the aperture, and
/// places on each.
const RINGS: [f64; 3] = [0.6, 0.9, 1.3];
const AROUND: usize = 16;
const PLACES: usize = RINGS.len() * AROUND;
/// Where primitives may stand: a lattice from here on, of so many a side, in widths of the bell.
const CORNER: DVec2 = DVec2::new(-1.4, -1.6);
const SPACING: f64 = 0.35;
const SIDE: usize = 9;
/// How far the primitives reach, in widths of the bell, and from which share on they fade.
const REACH: f64 = 4.0;
const FADE: f64 = 0.4;
/// Distance at which the speed is half of what it would be without a core, in widths of the bell; and where
/// the direction's jump at the centre is rounded, as a share of that.
const CORE: f64 = 0.35;
const ROUND: f64 = 0.2;
/// What is weaker than this [m³/s] moves nobody.
const WEAKEST: f64 = 1e-9;
/// Share of the diagonal that is added to the normal equations: neighbours on the lattice are nearly alike.
const RIDGE: f64 = 1e-3;
/// Partial sums of a [`dot`].
const PARTIAL: usize = 8;
/// Primitives of an animal.
pub const PRIMITIVES: usize = 4;

/// A primitive that may be chosen.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    whirls: bool,
    /// From the middle of the aperture, in widths of the bell; the animal's axis along y.
    at: DVec2,
}

impl Candidate {
    /// Velocity at a place for a strength of 1, both in widths of the bell.
    fn shape(&self, place: DVec2) -> DVec2 {
        let way = place - self.at;
        let square = way.length_squared();
        let fall = 1.0 / ((CORE * CORE + square) * square.sqrt().max(f64::MIN_POSITIVE));
        if self.whirls { DVec2::new(way.y, -way.x) * fall } else { way * fall }
    }
}

/// Velocities where the fit looks: all along x, then all along y.
type Velocities = [f64; 2 * PLACES];

/// The sum of products, over as many partial sums as fill a processor.
fn dot(a: &Velocities, b: &Velocities) -> f64 {
    let mut sums = [0.0; PARTIAL];
    for (a, b) in a.as_chunks::<PARTIAL>().0.iter().zip(b.as_chunks::<PARTIAL>().0) {
        for (sum, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += a * b;
        }
    }
    sums.iter().sum()
}

fn flat(velocities: [DVec2; PLACES]) -> Velocities {
    core::array::from_fn(|k| if k < PLACES { velocities[k].x } else { velocities[k - PLACES].y })
}

/// All primitives that may be chosen, with their velocities where the fit looks, and 1 over their squares'
/// sums.
#[derive(Clone, Debug)]
pub struct Choice {
    places: [DVec2; PLACES],
    candidates: Vec<Candidate>,
    shapes: Vec<(Velocities, f64)>,
}

impl Default for Choice {
    fn default() -> Self {
        let places = core::array::from_fn(|k| {
            let (cos, sin) = cos_sin_f64(TAU * ((k % AROUND) as f64 + 0.5) / AROUND as f64);
            DVec2::new(cos, sin) * RINGS[k / AROUND]
        });
        let candidates: Vec<Candidate> = (0..2 * SIDE * SIDE)
            .map(|k| Candidate {
                whirls: k < SIDE * SIDE,
                at: CORNER + SPACING * DVec2::new((k % SIDE) as f64, (k / SIDE % SIDE) as f64),
            })
            .collect();
        let shapes = candidates.iter().map(|candidate| {
            let shape = flat(places.map(|place| candidate.shape(place)));
            (shape, 1.0 / dot(&shape, &shape))
        });
        let shapes = shapes.collect();
        Self { places, candidates, shapes }
    }
}

/// The primitives that are nearest to a slice's water.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Fit {
    /// Middle of the aperture, in the slice [m].
    pub place: DVec2,
    /// Unit vector toward the apex.
    pub axis: DVec2,
    /// Which candidates were chosen, and their strengths [m³/s].
    pub chosen: [(usize, f64); PRIMITIVES],
    /// Sum of the squared velocities where the fit looks, and what the primitives miss of it [m²/s²].
    pub squares: [f64; 2],
}

impl Choice {
    /// Chooses primitives for a slice.
    pub fn fit<T: Real>(&self, slice: &Slice<T>) -> Fit {
        let mut chain = slice.chain();
        let (left, right) = (chain.next().unwrap_or_default(), chain.next_back().unwrap_or_default());
        let (place, axis) = (0.5 * (left + right), slice.axis());
        let aside = -axis.perp();
        let (corner, diameter) = (slice.corner(), slice.build().diameter);
        let flow = flat(self.places.map(|at| {
            let there = place + (aside * at.x + axis * at.y) * diameter;
            let velocity = DVec2::from(slice.water().velocity((there - corner).to_array()));
            DVec2::new(velocity.dot(aside), velocity.dot(axis))
        }));
        let mut rest = flow;
        let mut chosen = [(0, 0.0); PRIMITIVES];
        for count in 1..=PRIMITIVES {
            let (mut best, mut most) = (0, -1.0);
            for (candidate, (shape, share)) in self.shapes.iter().enumerate() {
                let gain = dot(shape, &rest).powi(2) * share;
                if gain > most && !chosen[..count - 1].iter().any(|(other, _)| *other == candidate) {
                    (best, most) = (candidate, gain);
                }
            }
            chosen[count - 1].0 = best;
            let mut matrix = [[0.0; PRIMITIVES]; PRIMITIVES];
            let mut side = [0.0; PRIMITIVES];
            let shapes = chosen.map(|(candidate, _)| &self.shapes[candidate].0);
            for i in 0..count {
                side[i] = dot(shapes[i], &flow);
                for j in 0..count {
                    matrix[i][j] = dot(shapes[i], shapes[j]);
                }
            }
            solve(&mut matrix, &mut side, count);
            for (k, rest) in rest.iter_mut().enumerate() {
                *rest = flow[k] - (0..count).map(|i| shapes[i][k] * side[i]).sum::<f64>();
            }
            for (chosen, strength) in chosen.iter_mut().zip(side) {
                chosen.1 = strength * diameter * diameter;
            }
        }
        let squares = [flow, rest].map(|list| dot(&list, &list));
        Fit { place, axis, chosen, squares }
    }

    /// As elements of the sea's flow. `across`: the slice's third axis; `world`: a place of the slice in the
    /// world.
    pub(super) fn flows(
        &self,
        fit: &Fit,
        owner: u64,
        diameter: f64,
        across: DVec3,
        world: impl Fn(DVec2) -> DVec3,
    ) -> [Flow; PRIMITIVES] {
        let core = CORE * diameter;
        let aside = -fit.axis.perp();
        fit.chosen.map(|(candidate, strength)| {
            let Candidate { whirls, at } = self.candidates[candidate];
            let strength = if strength.abs() < WEAKEST { WEAKEST } else { strength };
            Flow {
                owner,
                kind: if whirls { abi::FLOW_WHIRLWIND } else { abi::FLOW_SOURCE },
                position: world(fit.place + (aside * at.x + fit.axis * at.y) * diameter).to_array(),
                axis: if whirls { across.as_vec3().to_array() } else { [0.0; 3] },
                strength: strength as f32,
                peak: (strength.abs() / (core * core)) as f32,
                core: (ROUND * core) as f32,
                reach: (REACH * diameter) as f32,
                fade: FADE as f32,
                ..Flow::default()
            }
        })
    }
}

/// Solves the normal equations of the first `count` unknowns, by Cholesky's factors; all are 0 where they
/// have no solution.
fn solve(matrix: &mut [[f64; PRIMITIVES]; PRIMITIVES], side: &mut [f64; PRIMITIVES], count: usize) {
    for (i, row) in matrix.iter_mut().enumerate() {
        row[i] *= 1.0 + RIDGE;
    }
    for j in 0..count {
        let known = |row: &[f64; PRIMITIVES], other: &[f64; PRIMITIVES]| -> f64 {
            row.iter().zip(other).take(j).map(|(a, b)| a * b).sum()
        };
        let pivot = matrix[j][j] - known(&matrix[j], &matrix[j]);
        if pivot.is_nan() || pivot <= 0.0 {
            *side = [0.0; PRIMITIVES];
            return;
        }
        matrix[j][j] = pivot.sqrt();
        for i in j + 1..count {
            matrix[i][j] = (matrix[i][j] - known(&matrix[i], &matrix[j])) / matrix[j][j];
        }
    }
    for i in 0..count {
        for k in 0..i {
            side[i] -= matrix[i][k] * side[k];
        }
        side[i] /= matrix[i][i];
    }
    for i in (0..count).rev() {
        for k in i + 1..count {
            side[i] -= matrix[k][i] * side[k];
        }
        side[i] /= matrix[i][i];
    }
    if !side.iter().all(|value| value.is_finite()) {
        *side = [0.0; PRIMITIVES];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_equations_are_solved() {
        let mut matrix = [[0.0; PRIMITIVES]; PRIMITIVES];
        (matrix[0], matrix[1]) = ([2.0, 1.0, 0.0, 0.0], [1.0, 3.0, 0.0, 0.0]);
        let mut side = [4.0, 7.0, 0.0, 0.0];
        solve(&mut matrix, &mut side, 2);
        // 2 x + y = 4, x + 3 y = 7, but for the ridge.
        assert!((side[0] - 1.0).abs() < 5e-3 && (side[1] - 2.0).abs() < 5e-3, "{side:?}");
    }

    #[test]
    fn a_whirlwind_turns_about_its_place_and_a_source_leaves_it() {
        let at = DVec2::new(0.3, -0.2);
        let place = at + DVec2::new(0.0, 0.5);
        let fall = 1.0 / (CORE * CORE + 0.25);
        let whirl = Candidate { whirls: true, at }.shape(place);
        let source = Candidate { whirls: false, at }.shape(place);
        assert!(whirl.distance(DVec2::new(fall, 0.0)) < 1e-12, "{whirl}");
        assert!(source.distance(DVec2::new(0.0, fall)) < 1e-12, "{source}");
    }
}
