//! The water that a plant feels: currents and the trains' orbits (§4.3.1). All that this model takes from the
//! sea goes through [`felt`], so that a change of how orbits are evaluated for plants is a change of this
//! file alone.

use fearless_simd::{Simd, f32x8};
use reef_flow::{
    Packed,
    simd::{Lanes, clamp, splat},
    velocity8,
    waves::{Trains, orbit},
};

/// What acts around one anchor, in one step.
#[derive(Clone, Copy, Debug)]
pub struct Water<'a> {
    /// Currents, relative to the anchor.
    pub currents: &'a Packed,
    /// Wave trains, relative to the anchor.
    pub trains: &'a Trains,
    /// How many of them matter there (§4.4.2).
    pub count: usize,
    /// Share of the orbits' motion that is felt; 1: all.
    pub share: f32,
}

/// What water does at eight points: waves alone, or waves and currents.
#[derive(Clone, Copy, Debug)]
pub struct Felt<V> {
    /// Of orbits, and of currents where they are in it [m/s].
    pub velocity: [V; 3],
    /// Second time derivative of the orbits [m/s²].
    pub acceleration: [V; 3],
    /// How far the orbits raise the water [m]: at the surface, η.
    pub rise: V,
}

/// Greatest velocity [m/s] and acceleration [m/s²] along an axis that a plant feels: no sum of primitives
/// makes it infinite.
const FASTEST: f32 = 100.0;

/// Currents at eight points [m, relative to the anchor].
#[inline(always)]
pub(crate) fn current<S: Simd>(simd: S, water: &Water<'_>, p: [f32x8<S>; 3]) -> [f32x8<S>; 3] {
    velocity8(simd, water.currents, p[0], p[1], p[2])
}

/// Waves at eight points [m, relative to the anchor].
#[inline(always)]
pub(crate) fn swell<S: Simd>(simd: S, water: &Water<'_>, p: [f32x8<S>; 3]) -> Felt<f32x8<S>> {
    let zero = splat(simd, 0.0);
    if water.trains.is_empty() {
        return Felt { velocity: [zero; 3], acceleration: [zero; 3], rise: zero };
    }
    let orbit = orbit(simd, water.trains, water.count, p);
    let share = splat(simd, water.share);
    Felt {
        velocity: orbit.velocity.map(|v| share * v),
        acceleration: orbit.acceleration.map(|a| share * a),
        rise: share * orbit.displacement[1],
    }
}

/// The water where there are such currents and such waves.
#[inline(always)]
pub(crate) fn together<S: Simd>(simd: S, current: [f32x8<S>; 3], swell: &Felt<f32x8<S>>) -> Felt<f32x8<S>> {
    let (mut velocity, mut acceleration) = (current, swell.acceleration);
    for axis in 0..3 {
        velocity[axis] = bounded(simd, velocity[axis] + swell.velocity[axis]);
        acceleration[axis] = bounded(simd, acceleration[axis]);
    }
    Felt { velocity, acceleration, rise: swell.rise }
}

/// The water at eight points [m, relative to the anchor].
#[inline(always)]
pub fn felt<S: Simd>(simd: S, water: &Water<'_>, p: [f32x8<S>; 3]) -> Felt<f32x8<S>> {
    together(simd, current(simd, water, p), &swell(simd, water, p))
}

#[inline(always)]
fn bounded<S: Simd, V: Lanes<S>>(simd: S, v: V) -> V {
    clamp(v, V::splat(simd, -FASTEST), V::splat(simd, FASTEST))
}
