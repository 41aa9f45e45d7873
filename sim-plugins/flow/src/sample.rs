//! Velocities at many points at once, for who brings no kernel of their own (reef_host.sample_flow).

use core::ops::Range;

use fearless_simd::{Simd, f32x8, prelude::*};

use crate::{
    Level, Packed,
    packed::{self, velocity8},
};

/// Positions [m, relative to the packed form's origin], one slice an axis.
#[derive(Clone, Copy, Debug)]
pub struct Points<'a> {
    /// x [m]
    pub x: &'a [f32],
    /// y [m]
    pub y: &'a [f32],
    /// z [m]
    pub z: &'a [f32],
}

/// Velocities [m/s], one slice an axis.
#[derive(Debug)]
pub struct Velocities<'a> {
    /// x [m/s]
    pub x: &'a mut [f32],
    /// y [m/s]
    pub y: &'a mut [f32],
    /// z [m/s]
    pub z: &'a mut [f32],
}

/// The velocity of the water at each point. Takes as many points as the shortest of the six slices has.
pub fn sample(level: Level, packed: &Packed, points: Points<'_>, out: Velocities<'_>) {
    crate::dispatch!(level, simd => sample_wide(simd, packed, points, out));
}

/// What sources and holes make of water at each point, or take away [1/s]. Takes as many points as the
/// shortest of the four slices has.
pub fn divergence(level: Level, packed: &Packed, points: Points<'_>, out: &mut [f32]) {
    crate::dispatch!(level, simd => divergence_wide(simd, packed, points, out));
}

#[inline(always)]
fn divergence_wide<S: Simd>(simd: S, packed: &Packed, points: Points<'_>, out: &mut [f32]) {
    let count = out.len().min(points.x.len()).min(points.y.len()).min(points.z.len());
    let mut first = 0;
    while first < count {
        let here = first..(first + 8).min(count);
        let [x, y, z] = eight_of(simd, &points, here.clone());
        store(out, here.clone(), packed::divergence(simd, packed, x, y, z));
        first = here.end;
    }
}

/// Up to eight points; lanes beyond them hold zero.
#[inline(always)]
fn eight_of<S: Simd>(simd: S, points: &Points<'_>, here: Range<usize>) -> [f32x8<S>; 3] {
    let lanes = |values: &[f32]| {
        let mut eight = [0.0; 8];
        eight[..here.len()].copy_from_slice(&values[here.clone()]);
        f32x8::simd_from(simd, eight)
    };
    [lanes(points.x), lanes(points.y), lanes(points.z)]
}

/// The lanes that stand for points, to their places.
#[inline(always)]
fn store<S: Simd>(to: &mut [f32], here: Range<usize>, values: f32x8<S>) {
    let eight: [f32; 8] = values.into();
    to[here.clone()].copy_from_slice(&eight[..here.len()]);
}

#[inline(always)]
fn sample_wide<S: Simd>(simd: S, packed: &Packed, points: Points<'_>, out: Velocities<'_>) {
    let lengths = [points.x.len(), points.y.len(), points.z.len(), out.x.len(), out.y.len(), out.z.len()];
    let count = lengths.into_iter().fold(usize::MAX, usize::min);
    let mut first = 0;
    while first < count {
        let here = first..(first + 8).min(count);
        let [x, y, z] = eight_of(simd, &points, here.clone());
        let [vx, vy, vz] = velocity8(simd, packed, x, y, z);
        store(out.x, here.clone(), vx);
        store(out.y, here.clone(), vy);
        store(out.z, here.clone(), vz);
        first = here.end;
    }
}
