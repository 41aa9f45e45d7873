//! How many wave trains matter from how far away (§3.3.1), so that nobody sees what is left out.
//!
//! The paper drops each train whose own amplitude is below the threshold A_min on the screen. Thirty of them may add up to
//! several times that. Here the *sum* of the amplitudes that are left out, at the particle's own depth, stays below A_min:
//! then so does the whole error, whatever the phases are. The paper's own rule is there, too, to compare.

use reef_abi as abi;

use super::{dispersion::exp, orbit::acts};
use crate::math::cos_sin_f64;

/// Distances in the table: eight steps an octave from 2^−4 m to 2^12 m.
const NEAREST: i32 = -4;
const OCTAVES_OF_DISTANCE: i32 = 16;
/// Depths below still water: eight steps an octave from 2^−6 m to 2^14 m; above is the surface.
const SHALLOWEST: i32 = -6;
const OCTAVES_OF_DEPTH: i32 = 20;
/// Steps an octave, as bits of the mantissa.
const STEP_BITS: u32 = 3;

/// What a camera makes of a length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Pixels that a length of 1 covers at a distance of 1 in the middle of the picture.
    pub focal: f64,
    /// 1 + the square of the tangent off the axis in the picture's corner: how much more a length may cover there, at equal
    /// distance from the eye.
    pub corner: f64,
}

impl Lens {
    /// The lens of a camera with its nominal viewport.
    pub fn new(camera: &abi::Camera) -> Self {
        let [width, height] = [camera.width, camera.height].map(|size| f64::from(size.max(1)));
        let (cosine, sine) = cos_sin_f64(0.5 * f64::from(camera.fov_y));
        let tangent = sine / cosine;
        let corner = 1.0 + tangent * tangent * (1.0 + (width / height) * (width / height));
        Self { focal: 0.5 * height / tangent, corner }
    }
}

/// Which trains are left out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rule {
    /// Those that move water by less than A_min on the screen all together, at its own depth: nobody sees it.
    #[default]
    Sum,
    /// Each that raises the surface by less than A_min on the screen (§3.3.1): together they may move water by several
    /// times that.
    Each,
}

/// How many trains count, by distance and depth. Depends on the trains' amplitudes and lengths alone, not on time.
#[derive(Clone, Debug, PartialEq)]
pub struct Selection {
    rule: Rule,
    /// See [`Lens::corner`].
    corner: f32,
    /// A row a depth, shallow to deep; in it distances, near to far.
    counts: Vec<u16>,
}

impl Selection {
    /// The table for trains in their order, over the depth [m], through a lens, for a threshold A_min [px].
    pub fn new(waves: &[abi::Wave], depth: f64, lens: Lens, threshold: f64, rule: Rule) -> Self {
        let waves: Vec<&abi::Wave> = waves.iter().filter(|wave| acts(wave)).collect();
        let mut counts = Vec::with_capacity(rows() * columns());
        let mut axes = Vec::with_capacity(waves.len());
        for row in 0..rows() {
            // The shallow end of the row: what moves most.
            let y = (-step(row, SHALLOWEST)).max(-depth);
            axes.clear();
            axes.extend(waves.iter().map(|wave| match rule {
                Rule::Sum => f64::from(wave.amplitude) * wide_axis(f64::from(wave.wave_number), depth, y),
                Rule::Each => f64::from(wave.amplitude),
            }));
            let reach: f64 = axes.iter().sum();
            for column in 0..columns() {
                // The near end of the column.
                let distance = if column == 0 { 0.0 } else { step(column, NEAREST) };
                counts.push(match rule {
                    // And from there as near as the orbit comes.
                    Rule::Sum if distance > reach => {
                        let nearest = (distance - reach) * (distance - reach) / (distance + reach);
                        needed(&axes, threshold * nearest / lens.focal)
                    }
                    Rule::Sum => needed(&axes, 0.0),
                    Rule::Each => matter(&axes, threshold * distance / lens.focal),
                });
            }
        }
        Self { rule, corner: lens.corner as f32, counts }
    }

    /// How many of the first trains matter for an orbit around a centre at the height `y` [m, world] whose distance from the
    /// eye is `distance` [m], in whatever part of the picture.
    pub fn count(&self, y: f32, distance: f32) -> usize {
        self.count_at(y, distance, distance / self.corner)
    }

    /// The same in one part of the picture. `shown` [m]: a length covers there as much as it would in the picture's middle at
    /// this distance from the eye: z²/d for a point at the distance d [m], z [m] along the view.
    pub fn count_at(&self, y: f32, distance: f32, shown: f32) -> usize {
        let row = index(-y, SHALLOWEST, rows());
        let along = match self.rule {
            Rule::Sum => shown,
            Rule::Each => distance,
        };
        let column = index(along, NEAREST, columns());
        self.counts.get(row * columns() + column).map_or(usize::MAX, |&count| usize::from(count))
    }
}

/// Trains from the front of which each has at least the amplitude `least` [m].
fn matter(axes: &[f64], least: f64) -> u16 {
    let count = axes.iter().take_while(|axis| **axis >= least).count();
    u16::try_from(count).unwrap_or(u16::MAX)
}

/// The least number of trains from the front, so that those after them sum to `allowed` at most.
fn needed(axes: &[f64], allowed: f64) -> u16 {
    let mut sum = 0.0;
    let mut count = axes.len();
    for axis in axes.iter().rev() {
        sum += axis;
        // No number counts as too much.
        if sum.is_nan() || sum > allowed {
            break;
        }
        count -= 1;
    }
    u16::try_from(count).unwrap_or(u16::MAX)
}

/// The farthest that the trains carry water whose orbit has its centre at the height `y` [m, world] over the depth [m]: the
/// sum of all their greater axes [m]. Convex in y below still water.
pub fn reach(waves: &[abi::Wave], depth: f64, y: f64) -> f64 {
    let y = y.clamp(-depth.max(0.0), 0.0);
    let axes = waves.iter().filter(|wave| acts(wave) && depth > 0.0);
    axes.map(|wave| f64::from(wave.amplitude) * wide_axis(f64::from(wave.wave_number), depth, y)).sum()
}

/// C: the greater axis of an orbit, over the amplitude at the surface.
fn wide_axis(wave_number: f64, depth: f64, y: f64) -> f64 {
    let (e, back) = (exp(wave_number * y), exp(-wave_number * (y + 2.0 * depth)));
    (e + back) / (1.0 - exp(-2.0 * wave_number * depth))
}

fn rows() -> usize {
    1 + (OCTAVES_OF_DEPTH << STEP_BITS) as usize
}

fn columns() -> usize {
    1 + (OCTAVES_OF_DISTANCE << STEP_BITS) as usize
}

/// Where a row or column begins: 0, then eight steps an octave from 2^first.
fn step(index: usize, first: i32) -> f64 {
    let Some(above) = index.checked_sub(1) else { return 0.0 };
    let steps = 1_usize << STEP_BITS;
    let octave = i64::from(first) + (above / steps) as i64;
    // 2 to the power of the octave, by its exponent.
    let power = f64::from_bits(((1023 + octave) as u64) << 52);
    power * (1.0 + (above % steps) as f64 / steps as f64)
}

/// The last step that does not begin above a value: from the exponent and the first bits of the mantissa, without a
/// logarithm. What is not above 0, or no number, belongs to the first.
fn index(value: f32, first: i32, count: usize) -> usize {
    if value.is_nan() || value <= 0.0 {
        return 0;
    }
    let bits = value.to_bits() >> (23 - STEP_BITS);
    let base = ((127 + first) << STEP_BITS) as u32;
    (bits + 1).saturating_sub(base).min(count as u32 - 1) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_lies_in_the_last_step_that_does_not_begin_above_it() {
        for first in [NEAREST, SHALLOWEST] {
            for i in 0..4000 {
                let value = 1e-4 * 1.006_f32.powi(i);
                let at = index(value, first, rows());
                assert!(step(at, first) <= f64::from(value), "{value} {at}");
                assert!(at + 1 == rows() || step(at + 1, first) > f64::from(value), "{value} {at}");
            }
            assert_eq!(index(0.0, first, 9), 0);
            assert_eq!(index(-1.0, first, 9), 0);
            assert_eq!(index(f32::NAN, first, 9), 0);
            assert_eq!(index(f32::INFINITY, first, 9), 8);
        }
    }
}
