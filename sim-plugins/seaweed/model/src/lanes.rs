//! What the kernels need beside the lanes that all models share.

use fearless_simd::{Simd, f32x8, prelude::*};
use reef_flow::simd::mul_add;

pub(crate) use reef_flow::lanes::{
    Lane, Vector, WIDTH, add, add_scaled, cross, dot, load, load3, scale, store, store3, sub, sub_scaled,
};

#[inline(always)]
pub(crate) fn length<S: Simd>(a: Vector<S>) -> f32x8<S> {
    dot(a, a).sqrt()
}

/// 0 up to u = 0, 1 from u = 1 on, smooth in between; exactly 0 and 1 there.
#[inline(always)]
pub(crate) fn smooth<S: Simd>(simd: S, u: f32x8<S>) -> f32x8<S> {
    let u = u.max(f32x8::splat(simd, 0.0)).min(f32x8::splat(simd, 1.0));
    u * u * mul_add(u, f32x8::splat(simd, -2.0), f32x8::splat(simd, 3.0))
}

/// From `a` (share 0) to `b` (share 1), exactly at both ends.
#[inline(always)]
pub(crate) fn mix<S: Simd>(simd: S, a: f32x8<S>, b: f32x8<S>, share: f32x8<S>) -> f32x8<S> {
    let between = mul_add(share, b - a, a);
    let up_to_b = share.simd_ge(f32x8::splat(simd, 1.0)).select(b, between);
    share.simd_le(f32x8::splat(simd, 0.0)).select(a, up_to_b)
}
