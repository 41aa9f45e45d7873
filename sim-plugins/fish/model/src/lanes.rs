//! Eight fish side by side, and small vectors of them.

use fearless_simd::{Select, Simd, f32x8, mask32x8, prelude::*};
use reef_flow::simd::{mul_add, neg_mul_add};

/// Fish of a pack.
pub(crate) const WIDTH: usize = 8;

/// One number of each of eight fish.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(align(32))]
pub(crate) struct Lane(pub(crate) [f32; WIDTH]);

impl Lane {
    /// The same number eight times.
    pub(crate) const fn all(value: f32) -> Self {
        Self([value; WIDTH])
    }
}

/// A vector of each of eight fish.
pub(crate) type Vector<S> = [f32x8<S>; 3];

#[inline(always)]
pub(crate) fn load<S: Simd>(simd: S, lane: &Lane) -> f32x8<S> {
    f32x8::simd_from(simd, lane.0)
}

#[inline(always)]
pub(crate) fn store<S: Simd>(lane: &mut Lane, value: f32x8<S>) {
    lane.0 = value.into();
}

#[inline(always)]
pub(crate) fn load3<S: Simd>(simd: S, [x, y, z]: &[Lane; 3]) -> Vector<S> {
    [load(simd, x), load(simd, y), load(simd, z)]
}

#[inline(always)]
pub(crate) fn store3<S: Simd>([x, y, z]: &mut [Lane; 3], value: Vector<S>) {
    store(x, value[0]);
    store(y, value[1]);
    store(z, value[2]);
}

#[inline(always)]
pub(crate) fn add<S: Simd>(a: Vector<S>, b: Vector<S>) -> Vector<S> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline(always)]
pub(crate) fn sub<S: Simd>(a: Vector<S>, b: Vector<S>) -> Vector<S> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
pub(crate) fn scale<S: Simd>(a: Vector<S>, by: f32x8<S>) -> Vector<S> {
    [a[0] * by, a[1] * by, a[2] * by]
}

/// a + b · by.
#[inline(always)]
pub(crate) fn add_scaled<S: Simd>(a: Vector<S>, b: Vector<S>, by: f32x8<S>) -> Vector<S> {
    [mul_add(b[0], by, a[0]), mul_add(b[1], by, a[1]), mul_add(b[2], by, a[2])]
}

/// a − b · by.
#[inline(always)]
pub(crate) fn sub_scaled<S: Simd>(a: Vector<S>, b: Vector<S>, by: f32x8<S>) -> Vector<S> {
    [neg_mul_add(b[0], by, a[0]), neg_mul_add(b[1], by, a[1]), neg_mul_add(b[2], by, a[2])]
}

#[inline(always)]
pub(crate) fn dot<S: Simd>(a: Vector<S>, b: Vector<S>) -> f32x8<S> {
    mul_add(a[2], b[2], mul_add(a[1], b[1], a[0] * b[0]))
}

#[inline(always)]
pub(crate) fn cross<S: Simd>(a: Vector<S>, b: Vector<S>) -> Vector<S> {
    [
        neg_mul_add(a[2], b[1], a[1] * b[2]),
        neg_mul_add(a[0], b[2], a[2] * b[0]),
        neg_mul_add(a[1], b[0], a[0] * b[1]),
    ]
}

/// A vector of length 1 along each; where there is hardly any, `otherwise`.
#[inline(always)]
pub(crate) fn unit_or<S: Simd>(simd: S, v: Vector<S>, otherwise: Vector<S>) -> Vector<S> {
    let length = dot(v, v).sqrt();
    let inverse = f32x8::splat(simd, 1.0) / length;
    let there = length.simd_gt(f32x8::splat(simd, SHORTEST));
    select(there, scale(v, inverse), otherwise)
}

/// Below this length a vector has no direction.
const SHORTEST: f32 = 1e-12;

/// `a` where the mask is set, else `b`.
#[inline(always)]
pub(crate) fn select<S: Simd>(mask: mask32x8<S>, a: Vector<S>, b: Vector<S>) -> Vector<S> {
    [mask.select(a[0], b[0]), mask.select(a[1], b[1]), mask.select(a[2], b[2])]
}

/// No longer than `most`.
#[inline(always)]
pub(crate) fn at_most<S: Simd>(simd: S, v: Vector<S>, most: f32x8<S>) -> Vector<S> {
    let length = dot(v, v).sqrt().max(f32x8::splat(simd, SHORTEST));
    scale(v, (most / length).min(f32x8::splat(simd, 1.0)))
}

/// Up to eight numbers; lanes beyond them hold the first.
#[inline(always)]
pub(crate) fn eight_of<S: Simd>(simd: S, values: &[f32]) -> f32x8<S> {
    let mut eight = [values[0]; WIDTH];
    eight[..values.len()].copy_from_slice(values);
    f32x8::simd_from(simd, eight)
}
