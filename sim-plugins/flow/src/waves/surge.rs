//! The waves over a whole plant from one look at the trains: orbital velocity and its gradient at one place.
//!
//! What stands on the ground and sways has many nodes close together. Under a train that is much longer than
//! a plant is tall they all feel nearly the same, and what differs is linear in the place: v(p) = v(p₀) + G
//! (p − p₀), with
//!
//! - along the heading: v = r ω C sin ψ, upward: −r ω S cos ψ (see [`crate::waves`])
//! - G = ∇v from the same sines and cosines, since C′ = k S and S′ = k C. Water that does not turn has
//!   G = Gᵀ: six numbers.
//!
//! Over a plant that reaches q/k from p₀ this errs by e^q − 1 − q of the speed at p₀ at most: 2 % where a
//! train is fifteen times as long as the plant is high (q = 0.2), 15 % where it is six times as long. From
//! three times (q = 1) to one and a half (q = 2) a train fades out: it would push the top the other way than
//! the foot, and swings faster than a plant follows. That depends on plant and train alone, so nothing pops.
//!
//! ψ is worked out from world positions in f64, so a plant far from the middle of the world feels the same as
//! one there. A lane is one place, and no lane depends on another.

use core::f64::consts::PI;

use fearless_simd::{Select, Simd, f32x8, f32x16, prelude::*};
use reef_abi::Wave;

use super::{
    Selection,
    orbit::{Packed, acts, axes, pack},
    trig::sin_cos_half_turns,
};
use crate::{
    Level,
    simd::{Lanes, mul_add},
};

/// Places side by side.
pub const LANES: usize = 16;
/// One number of each of sixteen places.
pub type Sixteen = [f32; LANES];

/// q = k · radius up to which a train acts wholly, and from which on it does not: see above.
const SHORT: [f32; 2] = [1.0, 2.0];
/// 1.5 · 2⁵²: added to a number of less than 2⁵¹ it leaves the nearest whole one.
const MAGIC: f64 = 6_755_399_441_055_744.0;

/// One train. What is constant over all places is multiplied out here.
#[derive(Clone, Copy, Debug)]
struct Train {
    packed: Packed,
    /// Wave vector [half turns/m], x and z.
    half_turns: [f64; 2],
    /// ψ in the middle of the world [half turns].
    phase: f64,
    /// k [rad/m].
    wave_number: f32,
    /// What [`Surges::gradient`] gets of it, without axes and trigonometry [1/s].
    slope: [f32; 6],
}

/// One step's trains as plants take them. Refilling it allocates nothing once it has grown to its greatest
/// size.
#[derive(Clone, Debug, Default)]
pub struct Swell {
    trains: Vec<Train>,
    depth: f32,
}

impl Swell {
    /// Takes a step's trains over the depth [m], in the order in which they are counted (see
    /// [`super::Choice::in_order`]). What is not finite or has no amplitude or no length moves nothing.
    pub fn fill<'a>(&mut self, waves: impl Iterator<Item = &'a Wave>, depth: f64) {
        self.trains.clear();
        self.depth = depth as f32;
        if depth > 0.0 {
            self.trains.extend(waves.filter(|wave| acts(wave)).filter_map(|wave| Train::of(wave, depth)));
        }
    }

    /// Whether nothing moves.
    pub fn is_still(&self) -> bool {
        self.trains.is_empty()
    }
}

impl Train {
    fn of(wave: &Wave, depth: f64) -> Option<Self> {
        let packed = pack(wave, depth, [0.0; 3])?;
        let k = f64::from(wave.wave_number);
        let [x, z] = wave.direction.map(f64::from);
        let steep = k * f64::from(packed.up_speed);
        let slope = [x * x, -1.0, z * z, x, x * z, z].map(|share| (share * steep) as f32);
        let train = Self {
            packed,
            half_turns: [k * x / PI, k * z / PI],
            phase: f64::from(wave.phase) / PI,
            wave_number: wave.wave_number,
            slope,
        };
        slope.iter().all(|v| v.is_finite()).then_some(train)
    }
}

/// Sixteen places at which plants feel the waves.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
pub struct Places {
    at: [[f64; LANES]; 3],
    radius: Sixteen,
    to_origin: [Sixteen; 3],
}

impl Places {
    /// Puts a place into a lane: p₀ [m, world], how far the plant reaches from there [m], and what its own
    /// positions are relative to [m, world].
    pub fn set(&mut self, lane: usize, at: [f64; 3], radius: f64, origin: [f64; 3]) {
        for axis in 0..3 {
            self.at[axis][lane] = at[axis];
            self.to_origin[axis][lane] = (origin[axis] - at[axis]) as f32;
        }
        self.radius[lane] = radius as f32;
    }
}

/// What the waves do at sixteen places, to first order.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(align(64))]
pub struct Surges {
    /// At the plant's origin [m/s].
    velocity: [Sixteen; 3],
    /// ∂v_x/∂x, ∂v_y/∂y, ∂v_z/∂z, ∂v_x/∂y, ∂v_x/∂z, ∂v_y/∂z [1/s].
    gradient: [Sixteen; 6],
    /// ‖G‖ at most [1/s].
    steepness: Sixteen,
}

impl Surges {
    /// The same one in all lanes.
    pub fn all(from: &Self, lane: usize) -> Self {
        Self {
            velocity: core::array::from_fn(|axis| [from.velocity[axis][lane]; LANES]),
            gradient: core::array::from_fn(|at| [from.gradient[at][lane]; LANES]),
            steepness: [from.steepness[lane]; LANES],
        }
    }

    /// Takes another's lane into one of its own.
    pub fn take(&mut self, lane: usize, from: &Self, other: usize) {
        for (own, from) in self.velocity.iter_mut().zip(&from.velocity) {
            own[lane] = from[other];
        }
        for (own, from) in self.gradient.iter_mut().zip(&from.gradient) {
            own[lane] = from[other];
        }
        self.steepness[lane] = from.steepness[other];
    }

    /// Velocity of the water [m/s] at `p` [m, relative to the plant's origin] in each lane.
    #[inline(always)]
    pub fn velocity<S: Simd>(&self, simd: S, [x, y, z]: [f32x16<S>; 3]) -> [f32x16<S>; 3] {
        let load = |sixteen: &Sixteen| f32x16::simd_from(simd, *sixteen);
        let [xx, yy, zz, xy, xz, yz] = [
            load(&self.gradient[0]),
            load(&self.gradient[1]),
            load(&self.gradient[2]),
            load(&self.gradient[3]),
            load(&self.gradient[4]),
            load(&self.gradient[5]),
        ];
        [
            mul_add(xx, x, mul_add(xy, y, mul_add(xz, z, load(&self.velocity[0])))),
            mul_add(xy, x, mul_add(yy, y, mul_add(yz, z, load(&self.velocity[1])))),
            mul_add(xz, x, mul_add(yz, y, mul_add(zz, z, load(&self.velocity[2])))),
        ]
    }

    /// ‖∇v‖ [1/s] at most, of each lane: what [`crate::steepness`] is of the flow.
    #[inline(always)]
    pub fn steepness<S: Simd>(&self, simd: S) -> f32x16<S> {
        f32x16::simd_from(simd, self.steepness)
    }

    /// Velocity [m/s] in one lane, in f64: for those who draw it.
    pub fn velocity_of(&self, lane: usize, p: [f64; 3]) -> [f64; 3] {
        let [xx, yy, zz, xy, xz, yz] = self.gradient.map(|number| f64::from(number[lane]));
        let rows = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
        core::array::from_fn(|axis| {
            let [x, y, z] = rows[axis];
            f64::from(self.velocity[axis][lane]) + x * p[0] + y * p[1] + z * p[2]
        })
    }
}

/// Who looks at the plants: trains whose work nobody sees from there are left out.
#[derive(Clone, Copy, Debug)]
pub struct Seen<'a> {
    /// How many trains matter, for the order that [`Swell::fill`] got.
    pub selection: &'a Selection,
    /// The eye [m, world].
    pub eye: [f64; 3],
}

/// What the waves, times `factor`, do at many places. The same bytes at every level, for each place whatever
/// the others are.
pub fn surges(
    level: Level,
    swell: &Swell,
    seen: Option<Seen<'_>>,
    factor: f32,
    places: &[Places],
    out: &mut [Surges],
) {
    for (places, out) in places.iter().zip(out) {
        crate::dispatch!(level, simd => {
            // Sixteen lanes are two registers below AVX-512, too many for what this kernel keeps.
            if matches!(simd.level(), fearless_simd::Level::Avx512(_)) {
                part::<_, f32x16<_>, 16>(simd, swell, seen, factor, places, 0, out);
            } else {
                part::<_, f32x8<_>, 8>(simd, swell, seen, factor, places, 0, out);
                part::<_, f32x8<_>, 8>(simd, swell, seen, factor, places, 8, out);
            }
        });
    }
}

/// As many lanes as a vector has, from `first` on.
#[inline(always)]
fn part<S: Simd, V: Lanes<S>, const WIDTH: usize>(
    simd: S,
    swell: &Swell,
    seen: Option<Seen<'_>>,
    factor: f32,
    places: &Places,
    first: usize,
    out: &mut Surges,
) {
    let here = first..first + WIDTH;
    let (zero, one) = (V::splat(simd, 0.0), V::splat(simd, 1.0));
    let radius = V::from_slice(simd, &places.radius[here.clone()]);
    let mut heights = [0.0; WIDTH];
    for (height, y) in heights.iter_mut().zip(&places.at[1][here.clone()]) {
        *height = *y as f32;
    }
    let y = V::from_slice(simd, &heights);
    let mut count = swell.trains.len();
    let mut limits = V::splat(simd, f32::MAX);
    if let Some(seen) = seen {
        let counts: [f32; WIDTH] = counts::<S, V, WIDTH>(simd, &seen, places, first, y + radius);
        limits = V::from_slice(simd, &counts);
        // Beyond a lane's own count nothing is added to it, so how far the others go is nobody's business.
        count = count.min(counts.iter().fold(0.0_f32, |a, b| a.max(*b)) as usize);
    }
    let depth = V::splat(simd, swell.depth);
    let y = y.max(-depth).min(zero);
    let (mut velocity, mut gradient) = ([zero; 3], [zero; 6]);
    for (number, train) in swell.trains[..count].iter().enumerate() {
        let short = (V::splat(simd, SHORT[1]) - radius * V::splat(simd, train.wave_number))
            * V::splat(simd, 1.0 / (SHORT[1] - SHORT[0]));
        let short = short.max(zero).min(one);
        let share = short * short * mul_add(short, V::splat(simd, -2.0), V::splat(simd, 3.0));
        let share = limits.simd_gt(V::splat(simd, number as f32)).select(share, zero);
        let (s, c) = sin_cos_half_turns(V::from_slice(simd, &phases::<WIDTH>(train, places, first)));
        let (wide, high) = axes(simd, &train.packed, y, depth);
        let (s, c) = (s * share, c * share);
        let (along, up) = (s * wide, c * high);
        let [ax, az] = train.packed.across_speed;
        velocity = [
            mul_add(V::splat(simd, ax), along, velocity[0]),
            mul_add(V::splat(simd, -train.packed.up_speed), up, velocity[1]),
            mul_add(V::splat(simd, az), along, velocity[2]),
        ];
        let (stretch, shear) = (c * wide, s * high);
        let slope = train.slope;
        gradient = [
            mul_add(V::splat(simd, slope[0]), stretch, gradient[0]),
            mul_add(V::splat(simd, slope[1]), stretch, gradient[1]),
            mul_add(V::splat(simd, slope[2]), stretch, gradient[2]),
            mul_add(V::splat(simd, slope[3]), shear, gradient[3]),
            mul_add(V::splat(simd, slope[4]), stretch, gradient[4]),
            mul_add(V::splat(simd, slope[5]), shear, gradient[5]),
        ];
    }
    let factor = V::splat(simd, factor);
    for (number, at) in gradient.iter_mut().zip(&mut out.gradient) {
        *number *= factor;
        number.store_slice(&mut at[here.clone()]);
    }
    let [xx, yy, zz, xy, xz, yz] = gradient;
    let off = |axis: usize| V::from_slice(simd, &places.to_origin[axis][here.clone()]);
    let (x, y, z) = (off(0), off(1), off(2));
    let at_origin = [
        mul_add(xx, x, mul_add(xy, y, mul_add(xz, z, velocity[0] * factor))),
        mul_add(xy, x, mul_add(yy, y, mul_add(yz, z, velocity[1] * factor))),
        mul_add(xz, x, mul_add(yz, y, mul_add(zz, z, velocity[2] * factor))),
    ];
    for (number, at) in at_origin.iter().zip(&mut out.velocity) {
        number.store_slice(&mut at[here.clone()]);
    }
    let aside = mul_add(xy, xy, mul_add(xz, xz, yz * yz));
    let steepness = mul_add(xx, xx, mul_add(yy, yy, mul_add(zz, zz, aside + aside))).sqrt();
    steepness.store_slice(&mut out.steepness[here]);
}

/// ψ at some places [half turns], within ±1.
#[inline(always)]
fn phases<const WIDTH: usize>(train: &Train, places: &Places, first: usize) -> [f32; WIDTH] {
    let here = first..first + WIDTH;
    let (x, z) = (&places.at[0][here.clone()], &places.at[2][here]);
    let mut phases = [0.0; WIDTH];
    for lane in 0..WIDTH {
        let turns = train.half_turns[0] * x[lane] + train.half_turns[1] * z[lane] + train.phase;
        let whole = (0.5 * turns + MAGIC) - MAGIC;
        phases[lane] = (turns - 2.0 * whole) as f32;
    }
    phases
}

/// How many trains matter at some places whose tops are at the heights `top` [m, world].
#[inline(always)]
fn counts<S: Simd, V: Lanes<S>, const WIDTH: usize>(
    simd: S,
    seen: &Seen<'_>,
    places: &Places,
    first: usize,
    top: V,
) -> [f32; WIDTH] {
    let mut distances = [0.0; WIDTH];
    for (lane, distance) in distances.iter_mut().enumerate() {
        let d: [f64; 3] = core::array::from_fn(|axis| places.at[axis][first + lane] - seen.eye[axis]);
        *distance = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt() as f32;
    }
    // From its nearest side on, in whatever part of the picture: what turns into view does not change.
    let radius = V::from_slice(simd, &places.radius[first..first + WIDTH]);
    let distance = (V::from_slice(simd, &distances) - radius).max(V::splat(simd, 0.0));
    let corner = V::splat(simd, 1.0 / seen.selection.corner());
    let mut cells = [0; WIDTH];
    seen.selection.cell(simd, top, distance, distance * corner).store_slice(&mut cells);
    let mut counts = [0.0; WIDTH];
    for (count, cell) in counts.iter_mut().zip(cells) {
        *count = f32::from(seen.selection.of(cell));
    }
    counts
}
