//! How many wave trains matter from how far away (§3.3.1), so that nobody sees what is left out.
//!
//! The paper drops each train whose own amplitude is below the threshold A_min on the screen. Thirty of them
//! may add up to several times that. Here the *sum* of the amplitudes that are left out, at the particle's
//! own depth, stays below A_min: then so does the whole error, whatever the phases are. The paper's own rule
//! is there, too, to compare.

use fearless_simd::{Simd, f32x8, prelude::*};
use reef_abi as abi;

use super::{dispersion::exp, orbit::acts};
use crate::{math::cos_sin_f64, simd::Lanes};

/// Distances in the table: eight steps an octave from 2^−4 m to 2^12 m.
const NEAREST: i32 = -4;
const OCTAVES_OF_DISTANCE: i32 = 16;
/// Slices of the heights.
const ROWS: usize = 32;
/// Steps an octave, as bits of the mantissa.
const STEP_BITS: u32 = 3;

/// What a camera makes of a length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Pixels that a length of 1 covers at a distance of 1 in the middle of the picture.
    pub focal: f64,
    /// 1 + the square of the tangent off the axis in the picture's corner: how much more a length may cover
    /// there, at equal distance from the eye.
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
    /// Each that raises the surface by less than A_min on the screen (§3.3.1): together they may move water
    /// by several times that.
    Each,
}

/// How many trains count, by distance and depth. Depends on the trains' amplitudes and lengths alone, not on
/// time.
#[derive(Clone, Debug, PartialEq)]
pub struct Selection {
    rule: Rule,
    /// See [`Lens::corner`].
    corner: f32,
    /// Height of the first row's upper end [m, world], and rows a metre.
    top: f32,
    rows: f32,
    /// A row a slice of the heights, from above; in it distances, near to far.
    counts: Vec<u16>,
}

impl Selection {
    /// The table for trains in their order, over the depth [m], through a lens, for a threshold A_min [px],
    /// and for centres between two heights [m, world].
    pub fn new(
        waves: &[abi::Wave],
        depth: f64,
        lens: Lens,
        threshold: f64,
        rule: Rule,
        [bottom, top]: [f64; 2],
    ) -> Self {
        let waves: Vec<&abi::Wave> = waves.iter().filter(|wave| acts(wave)).collect();
        let mut counts = Vec::with_capacity(ROWS * columns());
        let mut axes = Vec::with_capacity(waves.len());
        let slice = (top - bottom) / ROWS as f64;
        for row in 0..ROWS {
            // The upper end of the row: what moves most. What rounding takes for it lies hardly above.
            let y = top - (row as f64 - 1e-3) * slice;
            axes.clear();
            axes.extend(waves.iter().map(|wave| match rule {
                Rule::Sum => axis(wave, depth, y),
                Rule::Each => f64::from(wave.amplitude),
            }));
            let reach: f64 = axes.iter().sum();
            for column in 0..columns() {
                // The near end of the column.
                let distance = step(column);
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
        let rows = if slice > 0.0 { (1.0 / slice) as f32 } else { 0.0 };
        Self { rule, corner: lens.corner as f32, top: top as f32, rows, counts }
    }

    /// How many of the first trains matter for an orbit around a centre at the height `y` [m, world] whose
    /// distance from the eye is `distance` [m], in whatever part of the picture.
    pub fn count(&self, y: f32, distance: f32) -> usize {
        self.count_at(y, distance, distance / self.corner)
    }

    /// The same in one part of the picture. `shown` [m]: a length covers there as much as it would in the
    /// picture's middle at this distance from the eye: z²/d for a point at the distance d [m], z [m] along
    /// the view.
    pub fn count_at(&self, y: f32, distance: f32, shown: f32) -> usize {
        let cell: [i32; 8] = crate::dispatch!(crate::Level::scalar(), simd => {
            let lanes = |value: f32| f32x8::splat(simd, if value.is_nan() { 0.0 } else { value });
            self.cell(simd, lanes(y), lanes(distance), lanes(shown)).into()
        });
        usize::from(self.of(cell[0]))
    }

    /// Where the table holds the answers of [`Selection::count_at`] for many centres.
    #[inline(always)]
    pub fn cell<S: Simd, V: Lanes<S>>(&self, simd: S, y: V, distance: V, shown: V) -> V::Int {
        let row = (V::splat(simd, self.top) - y) * V::splat(simd, self.rows);
        let row: V::Int = row.max(V::splat(simd, 0.0)).min(V::splat(simd, (ROWS - 1) as f32)).to_int();
        let along = match self.rule {
            Rule::Sum => shown,
            Rule::Each => distance,
        };
        // From the exponent and the first bits of the mantissa, without a logarithm.
        let along = along.max(V::splat(simd, LEAST)).min(V::splat(simd, MOST));
        let column = (along.bitcast::<V::Int>() >> (23 - STEP_BITS)) - V::Int::splat(simd, BASE - 1);
        row * V::Int::splat(simd, columns() as i32) + column
    }

    /// What the table holds there.
    #[inline(always)]
    pub fn of(&self, cell: i32) -> u16 {
        self.counts.get(cell as usize).copied().unwrap_or(u16::MAX)
    }

    /// See [`Lens::corner`].
    pub fn corner(&self) -> f32 {
        self.corner
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

/// The farthest that the trains carry water whose orbit has its centre at the height `y` [m, world] over the
/// depth [m]: the sum of all their greater axes [m]. Convex in y below still water.
pub fn reach(waves: &[abi::Wave], depth: f64, y: f64) -> f64 {
    let y = y.clamp(-depth.max(0.0), 0.0);
    let acting = waves.iter().filter(|wave| acts(wave) && depth > 0.0);
    acting.map(|wave| axis(wave, depth, y)).sum()
}

/// The greater axis of the orbit that a train gives water with its centre at the height `y` [m, world] over
/// the depth [m].
pub fn axis(wave: &abi::Wave, depth: f64, y: f64) -> f64 {
    f64::from(wave.amplitude) * wide_axis(f64::from(wave.wave_number), depth, y.clamp(-depth.max(0.0), 0.0))
}

/// C: the greater axis of an orbit, over the amplitude at the surface.
fn wide_axis(wave_number: f64, depth: f64, y: f64) -> f64 {
    let (e, back) = (exp(wave_number * y), exp(-wave_number * (y + 2.0 * depth)));
    (e + back) / (1.0 - exp(-2.0 * wave_number * depth))
}

/// The first step that is not 0, as bits of an f32 without the last ones of its mantissa.
const BASE: i32 = (127 + NEAREST) << STEP_BITS;
/// What lies just before the first step that is not 0, and the end of the last [m].
const LEAST: f32 = 0.0624;
const MOST: f32 = 4095.0;

const fn columns() -> usize {
    1 + (OCTAVES_OF_DISTANCE << STEP_BITS) as usize
}

/// Where a column begins [m]: 0, then eight steps an octave from 2^[`NEAREST`].
fn step(index: usize) -> f64 {
    let Some(above) = index.checked_sub(1) else { return 0.0 };
    let steps = 1_usize << STEP_BITS;
    let octave = i64::from(NEAREST) + (above / steps) as i64;
    // 2 to the power of the octave, by its exponent.
    let power = f64::from_bits(((1023 + octave) as u64) << 52);
    power * (1.0 + (above % steps) as f64 / steps as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_distance_lies_in_the_last_step_that_does_not_begin_above_it() {
        let wave = abi::Wave { amplitude: 1.0, wave_number: 1.0, ..abi::Wave::default() };
        let lens = Lens { focal: 100.0, corner: 2.0 };
        let selection = Selection::new(&[wave], 9.0, lens, 1.0, Rule::Each, [-1.0, 0.0]);
        let column = |distance: f32| {
            let cell: [i32; 8] = crate::dispatch!(crate::Level::best(), simd => {
                let lanes = |value: f32| f32x8::splat(simd, value);
                selection.cell(simd, lanes(-0.001), lanes(distance), lanes(0.0)).into()
            });
            cell[0] as usize
        };
        for i in 0..3000 {
            let value = 1e-3 * 1.005_f32.powi(i);
            let at = column(value);
            assert!(step(at) <= f64::from(value), "{value} {at}");
            assert!(at + 1 == columns() || step(at + 1) > f64::from(value), "{value} {at}");
        }
        assert_eq!([column(0.0), column(-1.0), column(f32::INFINITY)], [0, 0, columns() - 1]);
    }
}
