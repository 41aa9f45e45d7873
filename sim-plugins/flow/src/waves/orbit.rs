//! Wave trains ready for a kernel, and the kernels: the orbit of water under them, and the surface.

use core::f64::consts::{LOG2_E, PI};

use fearless_simd::Simd;
use reef_abi as abi;

use super::{
    dispersion::exp,
    trig::{exp2_down, sin_cos_half_turns},
};
use crate::simd::{Lanes, mul_add};

/// Below this e^(−k h) a train is taken as one over endless depth: eq. (2) as printed. What that leaves out,
/// r e^(−k (y + 2h)), is greatest at the bed, and a millionth of r there.
const DEEP: f64 = 1e-6;
/// Up to this k h the hyperbolic functions are polynomials, which lose no digits where the vertical axis
/// nearly vanishes.
const SHALLOW: f64 = 0.5;

/// How C and S are computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Regime {
    /// C = S = e^(k y).
    Deep,
    /// C, S = (e^(k y) ± e^(−k (y + 2h))) / (1 − e^(−2 k h)): no overflow for any k h.
    Finite,
    /// C, S = cosh, sinh of k (y + h) over sinh(k h), by polynomials.
    Shallow,
}

/// One train. What is constant over all points is multiplied out here.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Packed {
    regime: Regime,
    /// Wave vector [half turns/m], x and z.
    half_turns: [f32; 2],
    /// ψ at the origin [half turns], within ±1.
    phase: f32,
    /// k log₂e [1/m]; for [`Regime::Shallow`] k [1/m].
    decay: f32,
    /// e^(−2 k h).
    bed: f32,
    /// r times what C and S share: along x and z, and upward [m].
    across: [f32; 2],
    up: f32,
    /// The same times ω [m/s].
    pub(super) across_speed: [f32; 2],
    pub(super) up_speed: f32,
    /// −ω² [1/s²].
    pull: f32,
    /// r, and r k cos θ, r k sin θ: the surface.
    height: f32,
    slope: [f32; 2],
}

/// The wave trains that act on one object, relative to its origin. Refilling it allocates nothing once it has
/// grown to its greatest size.
#[derive(Clone, Debug, Default)]
pub struct Trains {
    trains: Vec<Packed>,
    /// h [m]
    depth: f32,
    /// World y of the origin [m].
    level: f32,
}

impl Trains {
    /// A still sea.
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes the step's trains in their order, over the depth [m] (reef_water.depth), relative to `origin`
    /// [m]. What is not finite or has no amplitude or no length raises nothing, and neither does anything
    /// where the depth is not above 0 (the host refuses such earlier).
    pub fn fill(&mut self, waves: &[abi::Wave], depth: f64, origin: [f64; 3]) {
        self.trains.clear();
        self.depth = depth as f32;
        self.level = origin[1] as f32;
        if depth > 0.0 && origin.iter().all(|x| x.is_finite()) {
            let acting = waves.iter().filter(|wave| acts(wave));
            self.trains.extend(acting.filter_map(|wave| pack(wave, depth, origin)));
        }
    }

    /// Makes room for so many trains, so that no [`Trains::fill`] needs memory later.
    pub fn make_room(&mut self, trains: usize) {
        self.trains.reserve(trains.saturating_sub(self.trains.len()));
    }

    /// How many trains there are.
    pub fn len(&self) -> usize {
        self.trains.len()
    }

    /// Whether the sea is still.
    pub fn is_empty(&self) -> bool {
        self.trains.is_empty()
    }
}

/// Whether a train moves anything and can be evaluated without a NaN.
pub(super) fn acts(wave: &abi::Wave) -> bool {
    let [x, z] = wave.direction;
    let numbers = [wave.amplitude, wave.wave_number, wave.frequency, wave.phase, x, z];
    numbers.iter().all(|v| v.is_finite()) && wave.amplitude > 0.0 && wave.wave_number > 0.0
}

pub(super) fn pack(wave: &abi::Wave, depth: f64, origin: [f64; 3]) -> Option<Packed> {
    let [r, k, omega, phase] = [wave.amplitude, wave.wave_number, wave.frequency, wave.phase].map(f64::from);
    let [x, z] = wave.direction.map(f64::from);
    let kh = k * depth;
    let bed = exp(-2.0 * kh);
    let (regime, share, decay) = if kh <= SHALLOW {
        let square = kh * kh;
        let sinh = kh * (1.0 + square / 6.0 * (1.0 + square / 20.0 * (1.0 + square / 42.0)));
        (Regime::Shallow, 1.0 / sinh, k)
    } else if bed.sqrt() < DEEP {
        (Regime::Deep, 1.0, k * LOG2_E)
    } else {
        (Regime::Finite, 1.0 / (1.0 - bed), k * LOG2_E)
    };
    let half_turns = (phase + k * (x * origin[0] + z * origin[2])) / PI;
    let across = [r * share * x, r * share * z];
    let packed = Packed {
        regime,
        half_turns: [(k * x / PI) as f32, (k * z / PI) as f32],
        phase: (half_turns - 2.0 * (0.5 * half_turns).round()) as f32,
        decay: decay as f32,
        bed: bed as f32,
        across: [across[0] as f32, across[1] as f32],
        up: (r * share) as f32,
        across_speed: [(omega * across[0]) as f32, (omega * across[1]) as f32],
        up_speed: (omega * r * share) as f32,
        pull: (-omega * omega) as f32,
        height: r as f32,
        slope: [(r * k * x) as f32, (r * k * z) as f32],
    };
    packed.is_finite().then_some(packed)
}

impl Packed {
    /// Water of a hair's depth may give a train an axis that no f32 holds.
    fn is_finite(&self) -> bool {
        let ([tx, tz], [ax, az], [vx, vz], [sx, sz]) =
            (self.half_turns, self.across, self.across_speed, self.slope);
        let all = [tx, tz, ax, az, vx, vz, sx, sz, self.phase, self.decay, self.up, self.up_speed, self.pull];
        all.iter().all(|v| v.is_finite())
    }
}

/// What the waves do to water whose orbit has a given centre. What a kernel does not read costs it nothing:
/// these functions are compiled into it.
#[derive(Clone, Copy, Debug)]
pub struct Orbit<V> {
    /// Off the centre [m].
    pub displacement: [V; 3],
    /// [m/s]
    pub velocity: [V; 3],
    /// [m/s²]
    pub acceleration: [V; 3],
}

/// The surface over a point of the still one, by linear theory.
#[derive(Clone, Copy, Debug)]
pub struct Surface<V> {
    /// η over still water [m].
    pub height: V,
    /// Unit, upward.
    pub normal: [V; 3],
}

/// The orbit under the first `count` trains (all: `usize::MAX`; see [`super::Selection`]) around the centres
/// `p` [m, relative to the origin], eight or sixteen of them. Centres above still water or below the bed move
/// as those at it.
///
/// Trains are summed in the order of the list: the bytes are the same at every level and for every width.
#[inline(always)]
pub fn orbit<S: Simd, V: Lanes<S>>(simd: S, trains: &Trains, count: usize, [x, y, z]: [V; 3]) -> Orbit<V> {
    let zero = V::splat(simd, 0.0);
    let depth = V::splat(simd, trains.depth);
    let y = (y + V::splat(simd, trains.level)).max(-depth).min(zero);
    let mut sum = Orbit { displacement: [zero; 3], velocity: [zero; 3], acceleration: [zero; 3] };
    for train in &trains.trains[..count.min(trains.trains.len())] {
        let (s, c) = phase(simd, train, x, z);
        // Each regime for itself: where both axes are the same, two products are saved.
        match train.regime {
            Regime::Deep => {
                let e = exp2_down(V::splat(simd, train.decay) * y);
                let (s, c) = (s * e, c * e);
                add(simd, &mut sum, train, [c, s], [s, c]);
            }
            Regime::Finite | Regime::Shallow => {
                let (wide, high) = axes(simd, train, y, depth);
                add(simd, &mut sum, train, [c * wide, s * high], [s * wide, c * high]);
            }
        }
    }
    sum
}

/// Height and normal of the surface over the points (x, z) [m, relative to the origin].
#[inline(always)]
pub fn surface<S: Simd, V: Lanes<S>>(simd: S, trains: &Trains, count: usize, [x, z]: [V; 2]) -> Surface<V> {
    let zero = V::splat(simd, 0.0);
    let (mut height, mut slope) = (zero, [zero; 2]);
    for train in &trains.trains[..count.min(trains.trains.len())] {
        let (s, c) = phase(simd, train, x, z);
        height = mul_add(V::splat(simd, train.height), s, height);
        slope = [
            mul_add(V::splat(simd, train.slope[0]), c, slope[0]),
            mul_add(V::splat(simd, train.slope[1]), c, slope[1]),
        ];
    }
    let one = V::splat(simd, 1.0);
    let length = mul_add(slope[0], slope[0], mul_add(slope[1], slope[1], one)).sqrt();
    let up = one / length;
    Surface { height, normal: [-slope[0] * up, up, -slope[1] * up] }
}

/// C and S without what [`Packed::across`] and [`Packed::up`] have of them, at the height `y` (−h … 0).
#[inline(always)]
pub(super) fn axes<S: Simd, V: Lanes<S>>(simd: S, train: &Packed, y: V, depth: V) -> (V, V) {
    let decay = V::splat(simd, train.decay);
    match train.regime {
        Regime::Deep => {
            let e = exp2_down(decay * y);
            (e, e)
        }
        Regime::Finite => {
            let e = exp2_down(decay * y);
            // Not below e^(−k h), so the quotient cannot overflow.
            let back = V::splat(simd, train.bed) / e;
            (e + back, e - back)
        }
        Regime::Shallow => cosh_sinh(simd, decay * (y + depth)),
    }
}

/// sin ψ and cos ψ.
#[inline(always)]
fn phase<S: Simd, V: Lanes<S>>(simd: S, train: &Packed, x: V, z: V) -> (V, V) {
    let half_turns = mul_add(V::splat(simd, train.half_turns[1]), z, V::splat(simd, train.phase));
    sin_cos_half_turns(mul_add(V::splat(simd, train.half_turns[0]), x, half_turns))
}

/// Adds a train: `place` and `motion` are along the heading and upward, without r and the trigonometry's
/// signs.
#[inline(always)]
fn add<S: Simd, V: Lanes<S>>(simd: S, sum: &mut Orbit<V>, train: &Packed, place: [V; 2], motion: [V; 2]) {
    let [ax, az] = [V::splat(simd, train.across[0]), V::splat(simd, train.across[1])];
    let up = V::splat(simd, train.up);
    let d = &mut sum.displacement;
    *d = [mul_add(ax, place[0], d[0]), mul_add(up, place[1], d[1]), mul_add(az, place[0], d[2])];
    let [sx, sz] = [V::splat(simd, train.across_speed[0]), V::splat(simd, train.across_speed[1])];
    let down = V::splat(simd, -train.up_speed);
    let v = &mut sum.velocity;
    *v = [mul_add(sx, motion[0], v[0]), mul_add(down, motion[1], v[1]), mul_add(sz, motion[0], v[2])];
    // −ω² times this train's displacement.
    let pull = V::splat(simd, train.pull);
    let [across, rise] = [pull * place[0], pull * place[1]];
    let a = &mut sum.acceleration;
    *a = [mul_add(ax, across, a[0]), mul_add(up, rise, a[1]), mul_add(az, across, a[2])];
}

/// cosh u and sinh u for 0 ≤ u ≤ ½, to 1e-7: their series.
#[inline(always)]
fn cosh_sinh<S: Simd, V: Lanes<S>>(simd: S, u: V) -> (V, V) {
    let u2 = u * u;
    let one = V::splat(simd, 1.0);
    let c = mul_add(V::splat(simd, 1.0 / 720.0), u2, V::splat(simd, 1.0 / 24.0));
    let c = mul_add(mul_add(c, u2, V::splat(simd, 0.5)), u2, one);
    let s = mul_add(V::splat(simd, 1.0 / 5040.0), u2, V::splat(simd, 1.0 / 120.0));
    let s = mul_add(mul_add(s, u2, V::splat(simd, 1.0 / 6.0)), u2, one);
    (c, s * u)
}
