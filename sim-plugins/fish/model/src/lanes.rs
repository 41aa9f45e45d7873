//! What the kernels need beside the lanes that all models share.

use fearless_simd::{Select, Simd, f32x8, mask32x8, prelude::*};

pub(crate) use reef_flow::lanes::{
    Lane, Vector, WIDTH, add, add_scaled, cross, dot, load, load3, scale, store, store3, sub, sub_scaled,
};

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
