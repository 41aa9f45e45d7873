//! Caustics on the CPU's side: which wave trains focus the sun, and how bright they are on average.

use glam::{DVec2, DVec3, Vec2};

use crate::world::environment::Environment;

/// Wave trains that the shaders know.
pub const WAVES: usize = 8;
/// Trains that count at low quality.
const WAVES_LOW: usize = 4;
/// Gravity [m/s²].
const GRAVITY: f64 = 9.81;

/// A train of small waves: its length [m], its direction [rad], its focusing power A k² [1/m], its phase [rad].
type Ripple = (f64, f64, f64, f64);

/// A breeze over the reef: wind waves around one direction, lengths without a common measure, focusing at 2 to 6 m.
const BREEZE: [Ripple; WAVES] = [
    (0.89, 0.35, 0.66, 0.0),
    (0.61, -0.62, 0.70, 2.1),
    (1.19, 1.41, 0.50, 4.4),
    (0.47, 2.25, 0.62, 1.3),
    (0.73, -1.52, 0.44, 5.2),
    (0.39, 0.86, 0.50, 3.7),
    (1.49, -0.21, 0.34, 0.8),
    (0.53, -2.33, 0.40, 2.9),
];

#[derive(Clone, Copy, Debug, PartialEq)]
struct Train {
    vector: DVec2,
    power: f64,
    frequency: f64,
    phase: f64,
}

/// The trains of a scene with the mean of their gain at four depths.
#[derive(Clone, Debug, PartialEq)]
pub struct Caustics {
    trains: Vec<Train>,
    mean_low: [f32; 4],
    mean_high: [f32; 4],
}

impl Caustics {
    /// The scene's own waves where they are steep enough to focus light within 12 m, filled up with a breeze.
    pub fn new(environment: &Environment) -> Self {
        let own = environment.waves.iter().filter_map(|w| {
            let k = f64::from(w.wave_number);
            let power = f64::from(w.amplitude) * k * k;
            (power > 0.33).then(|| Train {
                vector: DVec2::new(f64::from(w.direction[0]), f64::from(w.direction[1])) * k,
                power: power.min(1.0),
                frequency: f64::from(w.frequency),
                phase: f64::from(w.phase),
            })
        });
        let breeze = BREEZE.iter().map(|&(length, angle, power, phase)| {
            let k = std::f64::consts::TAU / length;
            let frequency = (GRAVITY * k).sqrt();
            Train { vector: DVec2::from_angle(angle) * k, power, frequency, phase }
        });
        let trains: Vec<Train> = own.take(WAVES / 2).chain(breeze).take(WAVES).collect();
        let mut caustics = Self { trains, mean_low: [1.0; 4], mean_high: [1.0; 4] };
        caustics.mean_low = [1.0, 2.0, 4.0, 8.0].map(|depth| caustics.sample_mean(WAVES_LOW, depth));
        caustics.mean_high = [1.0, 2.0, 4.0, 8.0].map(|depth| caustics.sample_mean(WAVES, depth));
        caustics
    }

    /// How many trains a quality uses.
    pub fn count(&self, high: bool) -> usize {
        if high { WAVES } else { WAVES_LOW }
    }

    /// Mean of the raw gain at 1, 2, 4 and 8 m.
    pub fn mean(&self, high: bool) -> [f32; 4] {
        if high { self.mean_high } else { self.mean_low }
    }

    /// The trains as the shaders take them: wave vector, A k², phase at the eye, reduced in f64.
    pub fn at(&self, eye: DVec3, time: f64) -> [[f32; 4]; WAVES] {
        let mut waves = [[0.0; 4]; WAVES];
        for (out, train) in waves.iter_mut().zip(&self.trains) {
            let phase = train.vector.dot(DVec2::new(eye.x, eye.z)) - train.frequency * time + train.phase;
            *out = [
                train.vector.x as f32,
                train.vector.y as f32,
                train.power as f32,
                phase.rem_euclid(std::f64::consts::TAU) as f32,
            ];
        }
        waves
    }

    /// Mean of [`raw_gain`] over the plane, by a low-discrepancy sequence.
    fn sample_mean(&self, count: usize, depth: f32) -> f32 {
        const SAMPLES: u32 = 4096;
        let waves = self.at(DVec3::ZERO, 0.0);
        let sum: f32 = (0..SAMPLES)
            .map(|i| {
                // The plastic number's sequence covers 61 x 61 m evenly.
                let x = f64::from(i) * 0.754_877_666_246_692_8;
                let z = f64::from(i) * 0.569_840_290_998_053_3;
                raw_gain(
                    &waves[..count],
                    Vec2::new((x.fract() * 61.0) as f32, (z.fract() * 61.0) as f32),
                    depth,
                )
            })
            .sum();
        sum / SAMPLES as f32
    }
}

/// The twin of `caustic_gain` in `shaders/caustics.glsl` before its mean is taken out: 1 / (|det(I + d/4 H)| + .15),
/// within .3 to 4.
pub fn raw_gain(waves: &[[f32; 4]], x: Vec2, depth: f32) -> f32 {
    let mut h = [0.0_f32; 3];
    let mut bend = 0.0_f32;
    for &[kx, kz, power, phase] in waves {
        let fade = (2.0 - depth * power * 0.25).clamp(0.0, 1.0);
        let s = (kx * x.x + kz * x.y + phase + bend).sin();
        bend = 0.9 * s + 0.35 * bend;
        let n = Vec2::new(kx, kz).normalize_or_zero();
        let a = -power * fade * s;
        h[0] += a * n.x * n.x;
        h[1] += a * n.y * n.y;
        h[2] += a * n.x * n.y;
    }
    let h = h.map(|v| v * 0.25 * depth);
    let det = (1.0 + h[0]) * (1.0 + h[1]) - h[2] * h[2];
    (1.0 / (det.abs() + 0.15)).clamp(0.3, 4.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::sample;

    #[test]
    fn caustics_keep_the_mean_brightness_and_leave_most_of_the_ground_dim() {
        let caustics = Caustics::new(&sample::environment());
        let waves = caustics.at(DVec3::new(3.0, -2.0, 7.0), 12.5);
        for (i, depth) in [1.0, 2.0, 4.0, 8.0].into_iter().enumerate() {
            let gains: Vec<f32> = (0..10_000)
                .map(|n| raw_gain(&waves, Vec2::new((n % 100) as f32 * 0.37, (n / 100) as f32 * 0.41), depth))
                .map(|g| 1.0 + (g / caustics.mean(true)[i] - 1.0) * (-0.058 * depth).exp())
                .collect();
            let mean = gains.iter().sum::<f32>() / gains.len() as f32;
            // 4096 and 10 000 samples of a field whose standard deviation is about 0.6: 3 sigma of their difference.
            assert!((mean - 1.0).abs() < 0.04, "mean {mean} at {depth} m");
            let bright = gains.iter().filter(|g| **g > 1.5).count() as f32 / gains.len() as f32;
            assert!(bright < 0.25, "{bright} of the ground is bright at {depth} m");
        }
    }

    #[test]
    fn waves_move_with_time_and_their_phase_follows_the_eye() {
        let caustics = Caustics::new(&sample::environment());
        let here = caustics.at(DVec3::ZERO, 1.0);
        let there = caustics.at(DVec3::new(10.0, 0.0, -4.0), 1.0);
        let x = Vec2::new(10.3, -4.2);
        let a = raw_gain(&here, x, 3.0);
        let b = raw_gain(&there, x - Vec2::new(10.0, -4.0), 3.0);
        // Phases differ by f32 rounding of a product near 100.
        assert!((a - b).abs() < 1e-2, "{a} {b}");
        assert_ne!(here, caustics.at(DVec3::ZERO, 1.1));
    }
}
