//! Eight objects side by side, one number of each in a lane, and small vectors of them: what the kernels of
//! models keep their state in.

use fearless_simd::{Simd, f32x8, prelude::*};

use crate::simd::{mul_add, neg_mul_add};

/// Objects of a pack.
pub const WIDTH: usize = 8;

/// One number of each of eight objects.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(align(32))]
pub struct Lane(pub [f32; WIDTH]);

impl Lane {
    /// The same number eight times.
    pub const fn all(value: f32) -> Self {
        Self([value; WIDTH])
    }
}

/// A vector of each of eight objects.
pub type Vector<S> = [f32x8<S>; 3];

/// Eight numbers into a register.
#[inline(always)]
pub fn load<S: Simd>(simd: S, lane: &Lane) -> f32x8<S> {
    f32x8::simd_from(simd, lane.0)
}

/// Eight numbers out of one.
#[inline(always)]
pub fn store<S: Simd>(lane: &mut Lane, value: f32x8<S>) {
    lane.0 = value.into();
}

/// Eight vectors into registers.
#[inline(always)]
pub fn load3<S: Simd>(simd: S, [x, y, z]: &[Lane; 3]) -> Vector<S> {
    [load(simd, x), load(simd, y), load(simd, z)]
}

/// Eight vectors out of them.
#[inline(always)]
pub fn store3<S: Simd>([x, y, z]: &mut [Lane; 3], value: Vector<S>) {
    store(x, value[0]);
    store(y, value[1]);
    store(z, value[2]);
}

/// Eight numbers of each of eight objects, object by object.
#[inline(always)]
pub fn transposed<S: Simd>(of: [f32x8<S>; WIDTH]) -> [f32x8<S>; WIDTH] {
    // Each time the six bits of a number's place are turned by one: three times swap row and lane.
    zipped(zipped(zipped(of)))
}

/// Written out: neither a closure nor a loop over arrays is always compiled with the level's instructions.
#[inline(always)]
fn zipped<S: Simd>([a, b, c, d, e, f, g, h]: [f32x8<S>; WIDTH]) -> [f32x8<S>; WIDTH] {
    [
        a.zip_low(e),
        a.zip_high(e),
        b.zip_low(f),
        b.zip_high(f),
        c.zip_low(g),
        c.zip_high(g),
        d.zip_low(h),
        d.zip_high(h),
    ]
}

/// a + b.
#[inline(always)]
pub fn add<S: Simd>(a: Vector<S>, b: Vector<S>) -> Vector<S> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// a − b.
#[inline(always)]
pub fn sub<S: Simd>(a: Vector<S>, b: Vector<S>) -> Vector<S> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// a · by.
#[inline(always)]
pub fn scale<S: Simd>(a: Vector<S>, by: f32x8<S>) -> Vector<S> {
    [a[0] * by, a[1] * by, a[2] * by]
}

/// a + b · by, fused.
#[inline(always)]
pub fn add_scaled<S: Simd>(a: Vector<S>, b: Vector<S>, by: f32x8<S>) -> Vector<S> {
    [mul_add(b[0], by, a[0]), mul_add(b[1], by, a[1]), mul_add(b[2], by, a[2])]
}

/// a − b · by, fused.
#[inline(always)]
pub fn sub_scaled<S: Simd>(a: Vector<S>, b: Vector<S>, by: f32x8<S>) -> Vector<S> {
    [neg_mul_add(b[0], by, a[0]), neg_mul_add(b[1], by, a[1]), neg_mul_add(b[2], by, a[2])]
}

/// a · b.
#[inline(always)]
pub fn dot<S: Simd>(a: Vector<S>, b: Vector<S>) -> f32x8<S> {
    mul_add(a[2], b[2], mul_add(a[1], b[1], a[0] * b[0]))
}

/// a × b.
#[inline(always)]
pub fn cross<S: Simd>(a: Vector<S>, b: Vector<S>) -> Vector<S> {
    [
        neg_mul_add(a[2], b[1], a[1] * b[2]),
        neg_mul_add(a[0], b[2], a[2] * b[0]),
        neg_mul_add(a[1], b[0], a[0] * b[1]),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Level;

    #[test]
    fn what_is_transposed_has_rows_for_lanes_at_every_level() {
        for level in Level::all() {
            let seen: [[f32; WIDTH]; WIDTH] = crate::dispatch!(level, simd => {
                let lanes = |i: usize| core::array::from_fn(|lane| (10 * i + lane) as f32);
                let row = |i: usize| f32x8::simd_from(simd, lanes(i));
                transposed(core::array::from_fn(row)).map(|row| row.into())
            });
            for (lane, row) in seen.iter().enumerate() {
                assert_eq!(*row, core::array::from_fn(|i| (10 * i + lane) as f32), "{}", level.name());
            }
        }
    }
}
