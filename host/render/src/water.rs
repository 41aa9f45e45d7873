//! The water's waves on the CPU's side: which trains focus the sun on the ground and how bright that is on
//! average, and which trains the surface is seen with from below.

use glam::{DVec2, DVec3, Vec2};
use reef_abi as abi;
use reef_streams::environment::Environment;

/// Wave trains that focus light, as many as the shaders know: first the long ones, then those that make the
/// net of lines.
pub const WAVES: usize = 8;
/// The long ones. At low quality they only bend the net.
const LONG: usize = WAVES / 2;
/// The scene's own of them, where it has so many. More, all of one wind, would draw streaks.
const OWN_LONG: usize = LONG / 2;
/// How far the long trains, the first half, shift light: as 6 m below the surface everywhere. Nearer to it
/// the net of the others would lie as even as it is.
pub(crate) const LONG_REACH: f32 = 1.5;
/// A k² of the weakest of the scene's own waves that counts [1/m]: at 10 m its crests are a tenth brighter.
const LEAST_POWER: f64 = 0.04;
/// Shortest of the scene's own waves that counts [m]: at low quality, vertices are a quarter of a metre
/// apart.
const SHORTEST: f64 = 0.8;
/// Gravity [m/s²].
const GRAVITY: f64 = 9.81;

/// A train of small waves: its length [m], its direction [rad], its focusing power A k² [1/m], its phase
/// [rad].
type Ripple = (f64, f64, f64, f64);

/// A breeze over the reef: lengths without a common measure. The first half makes the net: its trains cross
/// at 43 to 50 degrees, so that no way goes along all crests, and focus together at 2 to 5 m. The others bend
/// it.
const BREEZE: [Ripple; WAVES] = [
    (0.88, 0.35, 0.43, 0.0),
    (0.66, -1.26, 0.56, 2.1),
    (0.51, 1.15, 0.63, 4.4),
    (0.40, 2.74, 0.63, 1.3),
    (3.30, 0.90, 0.20, 3.7),
    (2.30, -0.80, 0.30, 0.8),
    (1.83, 1.90, 0.20, 5.2),
    (1.55, -2.20, 0.22, 2.9),
];

/// The breeze's waves go this much slower than such short waves do. At their true pace the lines of light
/// that they focus sweep a dozen pixels from one picture to the next, sixty times a second: that reads as
/// flicker, not as water.
const BREEZE_PACE: f64 = 0.5;

/// Trains of the visible surface that the shaders know.
pub const SURFACE_WAVES: usize = 12;
/// The scene's own of them, where it has so many; a breeze over them makes the rest.
const OWN_SURFACE_WAVES: usize = 5;

reef_gpu::record! {
    /// A train that focuses light, as the shaders take it.
    pub struct CausticTrain = "CausticTrain" {
        /// Wave vector, x and z [rad/m].
        pub vector: [f32; 2],
        /// A k² [1/m].
        pub power: f32,
        /// At the eye [rad], reduced in f64.
        pub phase: f32,
        /// What it adds to the Hessian of the surface's height where it is highest: xx, zz, xz [1/m], with
        /// the sign left out.
        pub hessian: [f32; 3],
        /// A [m].
        pub amplitude: f32,
    }
}

reef_gpu::record! {
    /// A train of the surface as it is seen, as the shaders take it.
    pub struct SurfaceTrain = "SurfaceTrain" {
        /// Wave vector, x and z [rad/m].
        pub vector: [f32; 2],
        /// [m].
        pub amplitude: f32,
        /// At the eye [rad], reduced in f64.
        pub phase: f32,
    }
}

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

    /// [m]
    fn length(&self) -> f64 {
        std::f64::consts::TAU / self.vector.length().max(1e-12)
    }

    /// A k: the steepest slope.
    fn slope(&self) -> f64 {
        self.amplitude * self.vector.length()
    }

    /// Phase at the eye [rad].
    fn phase_at(&self, eye: DVec3, time: f64) -> f32 {
        let phase = self.vector.dot(DVec2::new(eye.x, eye.z)) - self.frequency * time + self.phase;
        phase.rem_euclid(std::f64::consts::TAU) as f32
    }
}

/// The trains that the surface is seen with: the steepest of the scene's own, and a breeze over them. A few
/// of both come first, for those who take only some.
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

    /// As the shaders take them.
    pub fn at(&self, eye: DVec3, time: f64) -> [SurfaceTrain; SURFACE_WAVES] {
        let mut waves = [SurfaceTrain::default(); SURFACE_WAVES];
        for (out, train) in waves.iter_mut().zip(&self.trains) {
            *out = SurfaceTrain {
                vector: train.vector.as_vec2().to_array(),
                amplitude: train.amplitude as f32,
                phase: train.phase_at(eye, time),
            };
        }
        waves
    }
}

/// The trains of a scene that focus light, with the mean of their gain at four depths.
#[derive(Clone, Debug, PartialEq)]
pub struct Caustics {
    trains: Vec<Train>,
    mean_low: [f32; 4],
    mean_high: [f32; 4],
}

impl Caustics {
    /// The scene's own waves that focus light most, where that can be seen within some ten metres, filled up
    /// with a breeze, and a net of short waves over them.
    pub fn new(environment: &Environment) -> Self {
        let counts = |train: &Train| train.power() > LEAST_POWER && train.length() > SHORTEST;
        let mut trains: Vec<Train> = environment.waves.iter().map(Train::own).filter(counts).collect();
        trains.sort_by(|a, b| b.power().total_cmp(&a.power()));
        trains.truncate(OWN_LONG);
        trains.extend(Train::breeze().skip(LONG));
        trains.truncate(LONG);
        // The longest shift light farthest: those after them see it where it then is.
        trains.sort_by(|a, b| b.length().total_cmp(&a.length()));
        trains.extend(Train::breeze().take(LONG));
        let mut caustics = Self { trains, mean_low: [1.0; 4], mean_high: [1.0; 4] };
        caustics.mean_low = [1.0, 2.0, 4.0, 8.0].map(|depth| caustics.sample_mean(false, depth));
        caustics.mean_high = [1.0, 2.0, 4.0, 8.0].map(|depth| caustics.sample_mean(true, depth));
        caustics
    }

    /// Mean of the raw gain at 1, 2, 4 and 8 m.
    pub fn mean(&self, high: bool) -> [f32; 4] {
        if high { self.mean_high } else { self.mean_low }
    }

    /// The trains as the shaders take them.
    pub fn at(&self, eye: DVec3, time: f64) -> [CausticTrain; WAVES] {
        let mut waves = [CausticTrain::default(); WAVES];
        for (out, train) in waves.iter_mut().zip(&self.trains) {
            let n = train.vector.normalize_or_zero();
            let power = train.power().min(1.0);
            *out = CausticTrain {
                vector: train.vector.as_vec2().to_array(),
                power: power as f32,
                phase: train.phase_at(eye, time),
                hessian: [n.x * n.x * power, n.y * n.y * power, n.x * n.y * power].map(|v| v as f32),
                amplitude: (power / train.vector.length_squared().max(1e-12)) as f32,
            };
        }
        waves
    }

    /// Brightness of a shaft of light that enters the water at a place (x, z) [m], .3 to 1. A shaft is wider
    /// than the lines that the waves focus, so it feels only how these wax and wane: over 2 to 4 s.
    pub fn shaft(&self, place: DVec2, time: f64) -> f32 {
        let sum: f64 = self.trains[..LONG]
            .iter()
            .enumerate()
            .map(|(i, train)| {
                let frequency = std::f64::consts::TAU / (6.0 + 1.3 * i as f64);
                (train.vector.dot(place) - frequency * time + train.phase).sin()
            })
            .sum();
        (0.65 + 0.35 * (0.8 * sum).sin()) as f32
    }

    /// Mean of [`raw_gain`] over the plane, by a low-discrepancy sequence.
    fn sample_mean(&self, high: bool, depth: f32) -> f32 {
        const SAMPLES: u32 = 4096;
        let waves = self.at(DVec3::ZERO, 0.0);
        let sum: f32 = (0..SAMPLES)
            .map(|i| {
                // The plastic number's sequence covers 61 x 61 m evenly.
                let x = f64::from(i) * 0.754_877_666_246_692_8;
                let z = f64::from(i) * 0.569_840_290_998_053_3;
                let place = Vec2::new((x.fract() * 61.0) as f32, (z.fract() * 61.0) as f32);
                raw_gain(&waves, high, place, depth)
            })
            .sum();
        sum / SAMPLES as f32
    }
}

/// The twin of `caustic_pattern` in `shaders/caustics.glsl` before its mean is taken out, and at low quality
/// of `quick_caustics` in `shaders/ground_low.glsl`. `x`: where the straight ray entered the water.
pub fn raw_gain(waves: &[CausticTrain; WAVES], high: bool, mut x: Vec2, depth: f32) -> f32 {
    let quarter = 0.25 * depth;
    let reach = quarter.min(1.0) + 0.25 * (quarter - 1.0).max(0.0);
    let mut h = [0.0_f32; 3];
    for (i, &CausticTrain { vector, power, phase, .. }) in waves.iter().enumerate() {
        let k = Vec2::from(vector);
        let n = k.normalize_or_zero();
        let bend = (2.0 - quarter * power).clamp(0.0, 1.0) * reach * power;
        let a = k.dot(x) + phase;
        let cosine = a.cos();
        if high || i >= LONG {
            let s = bend * (a - bend * cosine).sin();
            h[0] -= s * n.x * n.x;
            h[1] -= s * n.y * n.y;
            h[2] -= s * n.x * n.y;
        }
        let shift = if i < LONG { LONG_REACH * power } else { bend };
        x -= n * (shift * cosine / k.length().max(1e-6));
    }
    let det = (1.0 + h[0]) * (1.0 + h[1]) - h[2] * h[2];
    (1.0 / (det.abs() + 0.15 + 0.16 * (quarter - 1.0).max(0.0))).clamp(0.3, 4.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample;

    /// The default sea's water: a light breeze from one side over a low swell.
    fn breezy() -> Environment {
        use reef_sea::{
            scene::{
                format::SceneFile,
                wave_tables::{WaveTable, WavesTable},
            },
            step::waves::Waves,
        };
        let waves = Some(WavesTable {
            wind: 2.4,
            direction: 14.0,
            trains: reef_flow::waves::spectrum::DEFAULT_TRAINS,
        });
        let wave = vec![WaveTable { amplitude: 0.04, wavelength: 30.0, direction: 14.0, phase: None }];
        let trains = Waves::new(&SceneFile { waves, wave, ..SceneFile::default() }, 20).expect("a sound sea");
        Environment { waves: trains.at(0.0), ..sample::environment() }
    }

    /// Gains over their mean on a square grid with so many places a side, so far apart [m].
    fn field(caustics: &Caustics, high: bool, depth: f32, side: usize, apart: f32) -> Vec<f32> {
        let waves = caustics.at(DVec3::new(3.0, -2.0, 7.0), 12.5);
        let mean = caustics.sample_mean(high, depth);
        (0..side * side)
            .map(|n| Vec2::new((n % side) as f32, (n / side) as f32) * apart)
            .map(|x| raw_gain(&waves, high, x, depth) / mean)
            .collect()
    }

    #[test]
    fn caustics_keep_the_mean_brightness_and_leave_most_of_the_ground_dim() {
        for environment in [sample::environment(), breezy()] {
            let caustics = Caustics::new(&environment);
            for (i, depth) in [1.0, 2.0, 4.0, 8.0].into_iter().enumerate() {
                for high in [false, true] {
                    let gains = field(&caustics, high, depth, 100, 0.39);
                    let shown = gains.iter().map(|g| 1.0 + (g - 1.0) * 0.8 * (-0.058 * depth).exp());
                    let mean = shown.clone().sum::<f32>() / gains.len() as f32;
                    // 4096 and 10 000 samples of a field whose standard deviation is about 0.6: 3 sigma of
                    // their difference.
                    assert!((mean - 1.0).abs() < 0.04, "mean {mean} at {depth} m");
                    assert_eq!(caustics.mean(high)[i], caustics.sample_mean(high, depth));
                    let bright = shown.filter(|g| *g > 1.5).count() as f32 / gains.len() as f32;
                    assert!(bright < 0.25, "{bright} of the ground is bright at {depth} m");
                }
            }
        }
    }

    #[test]
    fn caustics_are_a_net_without_a_grain_that_repeats_nowhere() {
        const SIDE: usize = 300;
        for environment in [sample::environment(), breezy()] {
            let caustics = Caustics::new(&environment);
            for (high, depth) in [(false, 2.5), (false, 4.7), (true, 2.5), (true, 4.7)] {
                let gains = field(&caustics, high, depth, SIDE, 0.05);
                let at = |x: usize, z: usize| gains[z * SIDE + x];
                // Over all ways, how much brighter or darker it gets along each: streaks have one along which
                // nothing changes.
                let mut tensor = [0.0_f64; 3];
                for z in 0..SIDE - 1 {
                    for x in 0..SIDE - 1 {
                        let [dx, dz] = [at(x + 1, z), at(x, z + 1)].map(|v| f64::from(v - at(x, z)));
                        tensor = [tensor[0] + dx * dx, tensor[1] + dz * dz, tensor[2] + dx * dz];
                    }
                }
                let half = 0.5 * (tensor[0] + tensor[1]);
                let apart = (0.5 * (tensor[0] - tensor[1])).hypot(tensor[2]);
                let least = (half - apart) / (half + apart);
                assert!(least > 0.35, "high {high}, {depth} m: a grain of {least}");
                // Half of the square over itself, shifted: 1 where it repeats.
                let mut most = 0.0_f64;
                for way in (0..=150_i32).step_by(3) {
                    for other in (-150..=150_i32).step_by(3).filter(|other| way.pow(2) + other.pow(2) > 900) {
                        most = most.max(likeness(&gains, SIDE, way, other));
                    }
                }
                assert!(most < 0.65, "high {high}, {depth} m: repeats by {most}");
            }
        }
    }

    /// Correlation of a square field with itself, shifted by so many columns and rows.
    fn likeness(field: &[f32], side: usize, columns: i32, rows: i32) -> f64 {
        let (mut sum, mut squares, mut n) = ([0.0_f64; 2], [0.0_f64; 3], 0.0);
        for z in (rows.min(0).unsigned_abs() as usize..side - rows.max(0) as usize).step_by(3) {
            for x in (0..side - columns as usize).step_by(3) {
                let a = f64::from(field[z * side + x]);
                let b = f64::from(field[(z as i32 + rows) as usize * side + x + columns as usize]);
                sum = [sum[0] + a, sum[1] + b];
                squares = [squares[0] + a * a, squares[1] + b * b, squares[2] + a * b];
                n += 1.0;
            }
        }
        let spread = |i: usize| (squares[i] / n - (sum[i] / n).powi(2)).max(1e-12).sqrt();
        (squares[2] / n - sum[0] * sum[1] / (n * n)) / (spread(0) * spread(1))
    }

    #[test]
    fn lines_of_light_are_thin_and_bright_above_and_wide_and_soft_below() {
        let caustics = Caustics::new(&breezy());
        for high in [false, true] {
            // Steepness of the light that is seen, and its brightest hundredth.
            let [near, far] = [3.0, 9.0].map(|depth| {
                let gains = field(&caustics, high, depth, 250, 0.02);
                let strength = 0.8 * (-0.058 * depth).exp();
                let steep = gains.windows(2).map(|w| (w[1] - w[0]).abs() * strength / 0.02).sum::<f32>();
                let mut sorted: Vec<f32> = gains.iter().map(|g| 1.0 + (g - 1.0) * strength).collect();
                sorted.sort_by(f32::total_cmp);
                [steep / gains.len() as f32, sorted[gains.len() * 99 / 100]]
            });
            assert!(near[1] > 2.2, "high {high}: {near:?} are bright");
            assert!(far[0] < 0.75 * near[0] && far[1] < near[1], "high {high}: {near:?} and {far:?}");
        }
    }

    #[test]
    fn a_shaft_brightens_and_dims_over_seconds_and_never_jumps() {
        let caustics = Caustics::new(&breezy());
        for i in 0..40 {
            let place = DVec2::from_angle(f64::from(i) * 2.4) * f64::from(i) * 0.3;
            let light: Vec<f32> = (0..1200).map(|n| caustics.shaft(place, f64::from(n) / 60.0)).collect();
            let step = light.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f32::max);
            // .35 · .8 · the sum of the four frequencies, a sixtieth of a second long.
            assert!(step < 0.0162, "{step} from one picture to the next");
            let range =
                |v: &[f32]| v.iter().copied().fold(0.0, f32::max) - v.iter().copied().fold(1.0, f32::min);
            assert!(range(&light) > 0.45, "{} in twenty seconds", range(&light));
            let fifth = light.windows(12).map(range).fold(0.0, f32::max);
            assert!(fifth < 0.18, "{fifth} in a fifth of a second");
        }
    }

    #[test]
    fn waves_move_with_time_and_their_phase_follows_the_eye() {
        let caustics = Caustics::new(&sample::environment());
        let here = caustics.at(DVec3::ZERO, 1.0);
        let there = caustics.at(DVec3::new(10.0, 0.0, -4.0), 1.0);
        let x = Vec2::new(10.3, -4.2);
        let a = raw_gain(&here, true, x, 3.0);
        let b = raw_gain(&there, true, x - Vec2::new(10.0, -4.0), 3.0);
        // Phases differ by f32 rounding of a product near 100.
        assert!((a - b).abs() < 1e-2, "{a} {b}");
        assert_ne!(here, caustics.at(DVec3::ZERO, 1.1));
    }

    #[test]
    fn the_surface_and_the_caustics_have_the_scenes_trains_where_every_module_has_them() {
        use reef_sea::{
            scene::{format::SceneFile, wave_tables::WavesTable},
            step::waves::Waves,
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
        let own = |vector: [f32; 2]| {
            let k = DVec2::from(vector.map(f64::from));
            stepped.iter().map(phase_of).find(|(vector, _)| vector.distance(k) < 1e-5).map(|(_, phase)| phase)
        };
        let mut seen = 0;
        let caustics = Caustics::new(&environment);
        let surface = Surface::new(&environment).at(eye, time).map(|train| (train.vector, train.phase));
        let focusing = caustics.at(eye, time).map(|train| (train.vector, train.phase));
        for (vector, shown) in surface.into_iter().chain(focusing) {
            let Some(phase) = own(vector) else { continue };
            seen += 1;
            // A frequency of f32 near 5 rad/s, wrong by 2e-7, over 1000 s.
            let apart = (phase - f64::from(shown)).abs();
            assert!(apart.min(std::f64::consts::TAU - apart) < 1e-3, "{phase} and {shown}");
        }
        assert!(seen > OWN_SURFACE_WAVES, "the wind's waves focus light, too: {seen}");
    }

    #[test]
    fn a_still_sea_has_a_breeze_on_its_surface() {
        let surface = Surface::new(&sample::environment()).at(DVec3::ZERO, 0.0);
        // Mean square slope of a light breeze (Cox and Munk 1954: 0.003 + 0.005 a metre a second of wind).
        let square: f32 = surface
            .iter()
            .map(|t| 0.5 * Vec2::from(t.vector).length_squared() * t.amplitude * t.amplitude)
            .sum();
        assert!((0.008..0.035).contains(&square), "{square}");
    }
}
