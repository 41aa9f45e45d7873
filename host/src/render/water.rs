//! The water's waves on the CPU's side: which trains focus the sun on the ground and how bright that is on average, and which
//! trains the surface is seen with from below.

use glam::{DVec2, DVec3, Vec2};
use reef_abi as abi;

use crate::world::environment::Environment;

/// Wave trains that the shaders know.
pub const WAVES: usize = 8;
/// Trains that count at low quality.
const WAVES_LOW: usize = 4;
/// A k² of the weakest of the scene's own waves that counts [1/m]: at 10 m its crests are a tenth brighter.
const LEAST_POWER: f64 = 0.04;
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

/// The breeze's waves go this much slower than such short waves do. At their true pace the lines of light that they focus
/// sweep a dozen pixels from one picture to the next, sixty times a second: that reads as flicker, not as water.
const BREEZE_PACE: f64 = 0.5;

/// Trains of the visible surface that the shaders know.
pub const SURFACE_WAVES: usize = 12;
/// The scene's own of them, where it has so many; a breeze over them makes the rest.
const OWN_SURFACE_WAVES: usize = 5;

#[derive(Clone, Copy, Debug, PartialEq)]
struct Train {
    /// Wave vector [rad/m].
    vector: DVec2,
    /// Amplitude [m].
    amplitude: f64,
    /// ω [rad/s].
    frequency: f64,
    /// At the origin at time 0 [rad].
    phase: f64,
}

impl Train {
    fn own(wave: &abi::Wave) -> Self {
        let direction = DVec2::new(f64::from(wave.direction[0]), f64::from(wave.direction[1]));
        Self {
            vector: direction * f64::from(wave.wave_number),
            amplitude: f64::from(wave.amplitude),
            frequency: f64::from(wave.frequency),
            phase: f64::from(wave.phase),
        }
    }

    fn breeze() -> impl Iterator<Item = Self> {
        BREEZE.iter().map(|&(length, angle, power, phase)| {
            let k = std::f64::consts::TAU / length;
            let frequency = BREEZE_PACE * (GRAVITY * k).sqrt();
            Self { vector: DVec2::from_angle(angle) * k, amplitude: power / (k * k), frequency, phase }
        })
    }

    /// A k² [1/m].
    fn power(&self) -> f64 {
        self.amplitude * self.vector.length_squared()
    }

    /// A k: the steepest slope.
    fn slope(&self) -> f64 {
        self.amplitude * self.vector.length()
    }

    /// As the shaders take it: wave vector, `strength`, phase at the eye, reduced in f64.
    fn at(&self, eye: DVec3, time: f64, strength: f64) -> [f32; 4] {
        let phase = self.vector.dot(DVec2::new(eye.x, eye.z)) - self.frequency * time + self.phase;
        [
            self.vector.x as f32,
            self.vector.y as f32,
            strength as f32,
            phase.rem_euclid(std::f64::consts::TAU) as f32,
        ]
    }
}

/// The trains that the surface is seen with: the steepest of the scene's own, and a breeze over them. A few of both come
/// first, for those who take only some.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    trains: Vec<Train>,
}

impl Surface {
    /// Chooses them.
    pub fn new(environment: &Environment) -> Self {
        let mut own: Vec<Train> = environment.waves.iter().map(Train::own).collect();
        own.sort_by(|a, b| b.slope().total_cmp(&a.slope()));
        own.truncate(OWN_SURFACE_WAVES);
        let later = own.split_off(own.len().min(2));
        let mut breeze = Train::breeze();
        let mut trains = own;
        trains.extend(breeze.by_ref().take(2));
        trains.extend(later);
        trains.extend(breeze);
        trains.truncate(SURFACE_WAVES);
        Self { trains }
    }

    /// As the shaders take them: wave vector, amplitude, phase at the eye.
    pub fn at(&self, eye: DVec3, time: f64) -> [[f32; 4]; SURFACE_WAVES] {
        let mut waves = [[0.0; 4]; SURFACE_WAVES];
        for (out, train) in waves.iter_mut().zip(&self.trains) {
            *out = train.at(eye, time, train.amplitude);
        }
        waves
    }
}

/// The trains of a scene that focus light, with the mean of their gain at four depths.
#[derive(Clone, Debug, PartialEq)]
pub struct Caustics {
    trains: Vec<Train>,
    /// How many of them, the first, are the scene's own.
    own: usize,
    mean_low: [f32; 4],
    mean_high: [f32; 4],
}

impl Caustics {
    /// The scene's own waves that focus light most, where that can be seen within some ten metres, filled up with a breeze.
    pub fn new(environment: &Environment) -> Self {
        let own = environment.waves.iter().map(Train::own).filter(|train| train.power() > LEAST_POWER);
        let mut trains: Vec<Train> = own.collect();
        trains.sort_by(|a, b| b.power().total_cmp(&a.power()));
        trains.truncate(WAVES / 2);
        let own = trains.len();
        trains.extend(Train::breeze());
        trains.truncate(WAVES);
        let mut caustics = Self { trains, own, mean_low: [1.0; 4], mean_high: [1.0; 4] };
        caustics.mean_low = [1.0, 2.0, 4.0, 8.0].map(|depth| caustics.sample_mean(WAVES_LOW, depth));
        caustics.mean_high = [1.0, 2.0, 4.0, 8.0].map(|depth| caustics.sample_mean(WAVES, depth));
        caustics
    }

    /// How many of the trains, the first, are the scene's own: they stay where the scene has them.
    pub fn own(&self) -> usize {
        self.own
    }

    /// Mean of the raw gain at 1, 2, 4 and 8 m.
    pub fn mean(&self, high: bool) -> [f32; 4] {
        if high { self.mean_high } else { self.mean_low }
    }

    /// The trains as the shaders take them: wave vector, A k², phase at the eye, reduced in f64.
    pub fn at(&self, eye: DVec3, time: f64) -> [[f32; 4]; WAVES] {
        let mut waves = [[0.0; 4]; WAVES];
        for (out, train) in waves.iter_mut().zip(&self.trains) {
            *out = train.at(eye, time, train.power().min(1.0));
        }
        waves
    }

    /// What each train adds to the Hessian of the surface's height where it is highest: xx, zz, xz [1/m], with the sign
    /// left out; 0.
    pub fn focus(&self) -> [[f32; 4]; WAVES] {
        let mut focus = [[0.0; 4]; WAVES];
        for (out, train) in focus.iter_mut().zip(&self.trains) {
            let n = train.vector.normalize_or_zero();
            *out = [n.x * n.x, n.y * n.y, n.x * n.y, 0.0].map(|v| (train.power().min(1.0) * v) as f32);
        }
        focus
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
                    self.own,
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
/// `own`: how many of the waves are the scene's.
pub fn raw_gain(waves: &[[f32; 4]], own: usize, x: Vec2, depth: f32) -> f32 {
    let mut h = [0.0_f32; 3];
    let mut bend = 0.0_f32;
    for (i, &[kx, kz, power, phase]) in waves.iter().enumerate() {
        let fade = (2.0 - depth * power * 0.25).clamp(0.0, 1.0);
        let s = (kx * x.x + kz * x.y + phase + bend).sin();
        if i >= own {
            bend = 0.9 * s + 0.35 * bend;
        }
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
                .map(|n| {
                    raw_gain(&waves, 0, Vec2::new((n % 100) as f32 * 0.37, (n / 100) as f32 * 0.41), depth)
                })
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
        let a = raw_gain(&here, 0, x, 3.0);
        let b = raw_gain(&there, 0, x - Vec2::new(10.0, -4.0), 3.0);
        // Phases differ by f32 rounding of a product near 100.
        assert!((a - b).abs() < 1e-2, "{a} {b}");
        assert_ne!(here, caustics.at(DVec3::ZERO, 1.1));
    }

    #[test]
    fn the_surface_and_the_caustics_have_the_scenes_trains_where_every_module_has_them() {
        use crate::world::{
            scene::{format::SceneFile, wave_tables::WavesTable},
            waves::Waves,
        };
        let waves = Some(WavesTable { wind: 6.0, direction: 30.0, trains: 30 });
        let file = SceneFile { waves, ..SceneFile::default() };
        let trains = Waves::new(&file, 5).expect("a sound sea");
        let environment = Environment { waves: trains.at(0.0), ..sample::environment() };
        let (eye, time) = (DVec3::new(12.0, -2.0, -7.0), 1000.0);
        // What the modules get in their step, at the eye.
        let stepped = trains.at(time);
        let phase_of = |wave: &abi::Wave| {
            let k =
                DVec2::new(wave.direction[0].into(), wave.direction[1].into()) * f64::from(wave.wave_number);
            (k, (k.dot(DVec2::new(eye.x, eye.z)) + f64::from(wave.phase)).rem_euclid(std::f64::consts::TAU))
        };
        let own = |shown: &[f32; 4]| {
            let k = DVec2::new(shown[0].into(), shown[1].into());
            stepped.iter().map(phase_of).find(|(vector, _)| vector.distance(k) < 1e-5).map(|(_, phase)| phase)
        };
        let mut seen = 0;
        let caustics = Caustics::new(&environment);
        for shown in Surface::new(&environment).at(eye, time).iter().chain(&caustics.at(eye, time)) {
            let Some(phase) = own(shown) else { continue };
            seen += 1;
            // A frequency of f32 near 5 rad/s, wrong by 2e-7, over 1000 s.
            let apart = (phase - f64::from(shown[3])).abs();
            assert!(apart.min(std::f64::consts::TAU - apart) < 1e-3, "{phase} and {}", shown[3]);
        }
        assert_eq!(seen, OWN_SURFACE_WAVES + caustics.own());
        assert!(caustics.own() > 0, "the wind's waves focus light");
    }

    #[test]
    fn a_still_sea_has_a_breeze_on_its_surface() {
        let surface = Surface::new(&sample::environment()).at(DVec3::ZERO, 0.0);
        // Mean square slope of a light breeze (Cox and Munk 1954: 0.003 + 0.005 a metre a second of wind).
        let square: f32 =
            surface.iter().map(|[x, z, amplitude, _]| 0.5 * (x * x + z * z) * amplitude * amplitude).sum();
        assert!((0.008..0.035).contains(&square), "{square}");
    }
}
