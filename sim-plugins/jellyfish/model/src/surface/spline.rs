//! The periodic cubic spline through the profile of the bell, as fixed weights: where a sample lies between
//! its knots never changes, so each sample is one sum over the knots.

use fearless_simd::{Simd, f32x8, prelude::*};
use reef_flow::simd::{mul_add, splat};

use crate::lanes::WIDTH;

/// Weights of all samples, knot after knot.
#[derive(Clone, Debug)]
pub(crate) struct Resample {
    /// Samples, padded to whole vectors.
    samples: usize,
    /// [knot][sample].
    weights: Vec<f32>,
}

impl Resample {
    /// For samples at some places on a loop of `knots` that are one apart.
    pub(crate) fn new(knots: usize, places: &[f64]) -> Self {
        let samples = places.len().next_multiple_of(WIDTH);
        let mut weights = vec![0.0; knots * samples];
        // The loop is the same from each of its knots on: what one knot does, all do, so many places further.
        let mut values = vec![0.0; knots];
        values[0] = 1.0;
        let bends = bends(&values);
        for (knot, weights) in weights.chunks_exact_mut(samples.max(1)).enumerate() {
            for (weight, place) in weights.iter_mut().zip(places) {
                *weight = between(&values, &bends, place - knot as f64) as f32;
            }
        }
        Self { samples, weights }
    }

    /// Samples, padded to whole vectors.
    pub(crate) fn samples(&self) -> usize {
        self.samples
    }

    /// Each sample of a loop of values.
    #[inline(always)]
    pub(crate) fn apply<S: Simd>(&self, simd: S, knots: &[f32], into: &mut [f32]) {
        for at in (0..self.samples).step_by(WIDTH) {
            let mut sum = splat(simd, 0.0);
            for (knot, weights) in knots.iter().zip(self.weights.chunks_exact(self.samples)) {
                sum = mul_add(f32x8::from_slice(simd, &weights[at..at + WIDTH]), splat(simd, *knot), sum);
            }
            sum.store_slice(&mut into[at..at + WIDTH]);
        }
    }
}

/// Second derivatives at the knots of the periodic spline: M₋ + 4 M + M₊ = 6 (y₋ − 2 y + y₊), by sweeps that
/// shrink the error by more than half each.
fn bends(values: &[f64]) -> Vec<f64> {
    const SWEEPS: usize = 100;
    let n = values.len();
    let mut bends = vec![0.0; n];
    for _ in 0..SWEEPS {
        for i in 0..n {
            let (before, after) = ((i + n - 1) % n, (i + 1) % n);
            let right = 6.0 * (values[before] - 2.0 * values[i] + values[after]);
            bends[i] = (right - bends[before] - bends[after]) / 4.0;
        }
    }
    bends
}

fn between(values: &[f64], bends: &[f64], place: f64) -> f64 {
    let n = values.len();
    let whole = place.floor();
    let i = whole.rem_euclid(n as f64) as usize % n;
    let (j, t) = ((i + 1) % n, place - whole);
    let s = 1.0 - t;
    let cubic = (s.powi(3) - s) * bends[i] + (t.powi(3) - t) * bends[j];
    s * values[i] + t * values[j] + cubic / 6.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spline_meets_its_knots_and_follows_a_wave() {
        let angle = |place: f64| core::f64::consts::TAU * place / 24.0;
        let waves: Vec<f32> = (0..24).map(|k| angle(f64::from(k)).cos() as f32).collect();
        let saws: Vec<f32> = (0..24).map(|k| k as f32).collect();
        let places: Vec<f64> = (0..95).map(|k| f64::from(k) / 4.0).collect();
        let resample = Resample::new(24, &places);
        let mut samples = vec![0.0; resample.samples()];
        let level = reef_flow::Level::best();
        reef_flow::dispatch!(level, simd => resample.apply(simd, &waves, &mut samples));
        for (place, sample) in places.iter().zip(&samples) {
            assert!((f64::from(*sample) - angle(*place).cos()).abs() < 1e-4, "{place}");
        }
        reef_flow::dispatch!(level, simd => resample.apply(simd, &saws, &mut samples));
        for (place, sample) in places.iter().zip(&samples).filter(|(place, _)| place.fract() == 0.0) {
            assert!((sample - *place as f32).abs() < 1e-5);
        }
    }
}
