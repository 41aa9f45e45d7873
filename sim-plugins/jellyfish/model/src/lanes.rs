//! The scalar of a grid, f32 or f64, and eight of them side by side.

use fearless_simd::{Simd, SimdFloat, f32x8, f64x8};

/// Lanes of a vector, at every instruction set.
pub(crate) const WIDTH: usize = 8;

/// The scalar of a grid. Its operations are exactly repeatable: the same bits at every instruction set.
pub trait Real:
    Copy + Default + Send + Sync + fearless_simd::SimdFloatElement + reef_sdk::Scalar + 'static
{
    /// Eight of them.
    type Wide<S: Simd>: SimdFloat<S, Element = Self>;

    /// a · b + c, the same bits at every instruction set.
    fn mul_add<S: Simd>(a: Self::Wide<S>, b: Self::Wide<S>, c: Self::Wide<S>) -> Self::Wide<S>;

    /// a · b + c for one number, rounded as [`Real::mul_add`] rounds.
    fn mul_add_one(a: Self, b: Self, c: Self) -> Self;

    /// The nearest number.
    fn of(value: f64) -> Self;

    /// As f64, exactly.
    fn wide(self) -> f64;
}

impl Real for f32 {
    type Wide<S: Simd> = f32x8<S>;

    #[inline(always)]
    fn mul_add<S: Simd>(a: f32x8<S>, b: f32x8<S>, c: f32x8<S>) -> f32x8<S> {
        reef_flow::simd::mul_add(a, b, c)
    }

    #[inline(always)]
    fn mul_add_one(a: Self, b: Self, c: Self) -> Self {
        a.mul_add(b, c)
    }

    #[inline(always)]
    fn of(value: f64) -> Self {
        value as Self
    }

    #[inline(always)]
    fn wide(self) -> f64 {
        f64::from(self)
    }
}

impl Real for f64 {
    type Wide<S: Simd> = f64x8<S>;

    /// Rounded twice: below AVX2 no processor fuses it, and what is slow in software is not asked for.
    #[inline(always)]
    fn mul_add<S: Simd>(a: f64x8<S>, b: f64x8<S>, c: f64x8<S>) -> f64x8<S> {
        a * b + c
    }

    #[inline(always)]
    fn mul_add_one(a: Self, b: Self, c: Self) -> Self {
        a * b + c
    }

    #[inline(always)]
    fn of(value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn wide(self) -> f64 {
        self
    }
}
