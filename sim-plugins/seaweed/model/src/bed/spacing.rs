//! How far apart the waves' motion may be evaluated along a branch, so that what is between two such stations
//! errs by [`MOST_ERROR`] at most.
//!
//! Between stations s apart a train of the wave number k is taken to be linear, which errs by (k s)²/8 of it,
//! whatever way the branch goes: along the train its phase turns by k s, downward it fades by as much. Trains
//! count by what they accelerate the water by, where the most of it is: at the plant's highest place.

use reef_flow::waves::{Steady, select};
use reef_sdk::abi::Wave;

/// Greatest error of the waves' acceleration between two stations, over the sum of all trains'.
const MOST_ERROR: f64 = 0.03;

/// Depths below still water [m] from which on plants whose highest place is there are a band.
const DEPTHS: [f64; 6] = [0.0, 1.0, 2.0, 4.0, 8.0, 16.0];

/// The band of a plant that reaches up to a height [m, world].
pub(super) fn band(top: f64) -> usize {
    DEPTHS.iter().rposition(|depth| -top >= *depth).unwrap_or(0)
}

/// The greatest height that a plant of a band reaches up to [m, world].
pub(super) fn top(band: usize) -> f64 {
    -DEPTHS[band]
}

/// The farthest that stations may be apart.
#[derive(Clone, Debug, Default)]
pub(super) struct Spacing {
    trains: Steady,
    /// Band by band, for so many of the first trains [m].
    farthest: Vec<f32>,
}

impl Spacing {
    /// Looks at a step's trains, in the order in which they are counted, over the depth [m].
    pub(super) fn update(&mut self, waves: &[Wave], depth: f64) {
        if self.trains.are(waves, depth) {
            return;
        }
        self.trains.become_these(waves, depth);
        self.farthest.clear();
        for band in 0..DEPTHS.len() {
            let (mut sum, mut bent) = (0.0, 0.0);
            self.farthest.push(f32::INFINITY);
            for wave in waves {
                let pull = select::axis(wave, depth, top(band)) * f64::from(wave.frequency).powi(2);
                if pull.is_finite() {
                    sum += pull;
                    bent += pull * f64::from(wave.wave_number).powi(2);
                }
                let farthest =
                    if bent > 0.0 { (8.0 * MOST_ERROR * sum / bent).sqrt() } else { f64::INFINITY };
                self.farthest.push(farthest as f32);
            }
        }
    }

    /// For the first trains, in a band [m].
    pub(super) fn farthest(&self, band: usize, count: usize) -> f32 {
        let row = self.farthest.len() / DEPTHS.len();
        self.farthest.get(band * row + count.min(row.saturating_sub(1))).copied().unwrap_or(f32::INFINITY)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(length: f64, amplitude: f32) -> Wave {
        let k = core::f64::consts::TAU / length;
        Wave {
            amplitude,
            wave_number: k as f32,
            frequency: (9.81 * k).sqrt() as f32,
            direction: [1.0, 0.0],
            ..Wave::default()
        }
    }

    #[test]
    fn stations_are_a_thirteenth_of_a_wave_apart_and_nearer_for_short_ones() {
        let mut spacing = Spacing::default();
        spacing.update(&[wave(6.0, 0.2), wave(1.5, 0.05)], 50.0);
        // (k s)²/8 = 0.03
        let alone = 0.24_f32.sqrt() * 6.0 / core::f32::consts::TAU;
        assert!((spacing.farthest(0, 1) / alone - 1.0).abs() < 1e-5, "{}", spacing.farthest(0, 1));
        // The short one fades with depth, and is chosen or not.
        let both: Vec<f32> = (0..DEPTHS.len()).map(|band| spacing.farthest(band, 2)).collect();
        assert!(both[0] < 0.4 * alone && both.is_sorted() && both[5] > 0.999 * alone, "{both:?}");
        assert_eq!((spacing.farthest(3, 0), spacing.farthest(0, 9)), (f32::INFINITY, both[0]));
        spacing.update(&[], 50.0);
        assert_eq!(spacing.farthest(2, 3), f32::INFINITY);
    }

    #[test]
    fn a_band_begins_at_its_top() {
        let bands = [1.0, 0.0, -0.5, -1.0, -3.9, -4.0, -900.0].map(band);
        assert_eq!(bands, [0, 0, 0, 1, 2, 3, 5]);
        assert!((0..DEPTHS.len()).all(|number| band(top(number)) == number));
    }
}
