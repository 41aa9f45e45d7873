//! Sine, cosine and exponential, eight lanes wide, the same bytes at every level. The coefficients are
//! least-maximum fits on the reduced ranges; the tests hold them against f64. And a step that has no corners.

use fearless_simd::{Select, Simd, prelude::*};

use crate::simd::{Lanes, clamp, mul_add, neg_mul_add};

/// π/2 in three parts, the first two short enough that a product with a small integer is exact or nearly so.
const HALF_PI: [f32; 3] = [1.570_796_4, -4.371_139e-8, -1.715_124_5e-15];
const SIN: [f32; 3] = [-1.666_665_5e-1, 8.332_161e-3, -1.951_529_6e-4];
const COS: [f32; 3] = [4.166_664_6e-2, -1.388_731_6e-3, 2.443_315_7e-5];

/// From 0 up to `from` to 1 from `to` on, without a corner: 3u² − 2u³ between them.
#[inline]
pub fn smoothstep(from: f64, to: f64, x: f64) -> f64 {
    let u = ((x - from) / (to - from)).clamp(0.0, 1.0);
    u * u * (3.0 - 2.0 * u)
}

/// What is beyond has no quadrant that an f32 can count [rad]: 2²² quarter turns.
const FARTHEST: f32 = 6_588_397.0;

/// Sine and cosine of each lane [rad]. Absolute error ≤ 1e-7 for |x| ≤ 8192; beyond that (and for ∞) the
/// result stays within ±1, but loses meaning: who has larger phases reduces them in f64 first
/// ([`reduce_phase`]).
#[inline(always)]
pub fn sin_cos<S: Simd, V: Lanes<S>>(x: V) -> (V, V) {
    let simd = x.token();
    let x = clamp(x, V::splat(simd, -FARTHEST), V::splat(simd, FARTHEST));
    // The quadrant, and what is left of the angle: within ±π/4.
    let n = (x * V::splat(simd, core::f32::consts::FRAC_2_PI)).round_ties_even();
    let mut r = neg_mul_add(n, V::splat(simd, HALF_PI[0]), x);
    r = neg_mul_add(n, V::splat(simd, HALF_PI[1]), r);
    r = neg_mul_add(n, V::splat(simd, HALF_PI[2]), r);
    let r2 = r * r;
    let s = mul_add(V::splat(simd, SIN[2]), r2, V::splat(simd, SIN[1]));
    let s = mul_add(s, r2, V::splat(simd, SIN[0]));
    let s = mul_add(s * r2, r, r);
    let c = mul_add(V::splat(simd, COS[2]), r2, V::splat(simd, COS[1]));
    let c = mul_add(c, r2, V::splat(simd, COS[0]));
    let c = mul_add(c * r2, r2, mul_add(V::splat(simd, -0.5), r2, V::splat(simd, 1.0)));
    // Quadrants 1 and 3 swap the two; signs turn in quadrants 2, 3 (sine) and 1, 2 (cosine).
    let quadrant: V::Int = n.to_int();
    let one = V::Int::splat(simd, 1);
    let odd = (quadrant & one).simd_eq(one);
    let sine_sign: V = ((quadrant << 30) & V::Int::splat(simd, i32::MIN)).bitcast();
    let cosine_sign: V = (((quadrant + one) << 30) & V::Int::splat(simd, i32::MIN)).bitcast();
    let sine = flip(odd.select(c, s), sine_sign);
    let cosine = flip(odd.select(s, c), cosine_sign);
    (sine, cosine)
}

/// Turns the sign where `sign` holds only a sign bit.
#[inline(always)]
fn flip<S: Simd, V: Lanes<S>>(value: V, sign: V) -> V {
    (value.bitcast::<V::Int>() ^ sign.bitcast::<V::Int>()).bitcast()
}

/// Sine of each lane [rad]; see [`sin_cos`].
#[inline(always)]
pub fn sin<S: Simd, V: Lanes<S>>(x: V) -> V {
    sin_cos(x).0
}

const LN2: [f32; 2] = [6.931_457_5e-1, 1.428_606_8e-6];
const EXP: [f32; 5] = [1.666_666_6e-1, 4.166_579_6e-2, 8.333_452e-3, 1.398_2e-3, 1.987_569_1e-4];

/// e to the power of each lane. Relative error ≤ 2e-7 for −87 ≤ x ≤ 88; what lies outside is taken at the
/// range's ends, so that the result stays finite and above zero.
#[inline(always)]
pub fn exp<S: Simd, V: Lanes<S>>(x: V) -> V {
    let simd = x.token();
    let x = clamp(x, V::splat(simd, -87.0), V::splat(simd, 88.0));
    let n = (x * V::splat(simd, core::f32::consts::LOG2_E)).round_ties_even();
    let r = neg_mul_add(n, V::splat(simd, LN2[0]), x);
    let r = neg_mul_add(n, V::splat(simd, LN2[1]), r);
    let p = mul_add(V::splat(simd, EXP[4]), r, V::splat(simd, EXP[3]));
    let p = mul_add(p, r, V::splat(simd, EXP[2]));
    let p = mul_add(p, r, V::splat(simd, EXP[1]));
    let p = mul_add(p, r, V::splat(simd, EXP[0]));
    let p = mul_add(p, r, V::splat(simd, 0.5));
    let p = mul_add(p * r, r, r) + V::splat(simd, 1.0);
    let n: V::Int = n.to_int();
    // 2^127 · 2 for the top of the range: the exponent is added in two halves.
    let half = n >> 1;
    let bias = V::Int::splat(simd, 127);
    let a: V = ((half + bias) << 23).bitcast();
    let b: V = ((n - half + bias) << 23).bitcast();
    p * a * b
}

/// A phase [rad] reduced to [0, 2π) in f64, where it may be as large as a day of simulated time makes it.
pub fn reduce_phase(phase: f64) -> f64 {
    let reduced = phase.rem_euclid(core::f64::consts::TAU);
    // A tiny negative phase rounds up to 2π itself.
    if reduced < core::f64::consts::TAU { reduced } else { 0.0 }
}

/// Cosine and sine of an f64 [rad], the same bytes on every machine.
pub fn cos_sin_f64(x: f64) -> (f64, f64) {
    let way = glam::DVec2::from_angle(reduce_phase(x));
    (way.x, way.y)
}

/// Sine of an f64 [rad], the same bytes on every machine.
pub fn sin_f64(x: f64) -> f64 {
    cos_sin_f64(x).1
}

#[cfg(test)]
mod tests {
    use super::*;
    use fearless_simd::f32x8;

    use crate::Level;

    fn eight(level: Level, values: [f32; 8]) -> [[f32; 8]; 3] {
        crate::dispatch!(level, simd => {
            let x = f32x8::simd_from(simd, values);
            let (s, c) = sin_cos(x);
            [s.into(), c.into(), exp(x).into()]
        })
    }

    /// Points over ±`range`, denser near zero.
    fn points(range: f64) -> impl Iterator<Item = f32> {
        (0..40_000).map(move |i| {
            let t = f64::from(i) / 20_000.0 - 1.0;
            (range * t * t * t) as f32
        })
    }

    fn groups(values: impl Iterator<Item = f32>) -> Vec<[f32; 8]> {
        let values: Vec<f32> = values.collect();
        values.chunks_exact(8).map(|c| c.try_into().expect("eight")).collect()
    }

    #[test]
    fn sine_and_cosine_stay_within_1e_7_of_f64() {
        // 1e-7: the figure that the crate promises; one and a half units in the last place of a value near 1.
        for group in groups(points(8192.0).chain(points(4.0))) {
            let [s, c, _] = eight(Level::best(), group);
            for i in 0..8 {
                let x = f64::from(group[i]);
                assert!((f64::from(s[i]) - x.sin()).abs() <= 1e-7, "sin {x}: {} {}", s[i], x.sin());
                assert!((f64::from(c[i]) - x.cos()).abs() <= 1e-7, "cos {x}: {} {}", c[i], x.cos());
            }
        }
    }

    #[test]
    fn sine_and_cosine_of_anything_are_within_one() {
        for level in Level::all() {
            for x in [6.5e6, 6_588_397.0, 6_588_397.5, 7e6, 1e7, 1e12, 1e30, f32::INFINITY] {
                let [s, c, _] = eight(level, [x, -x, 1.01 * x, -1.01 * x, 3.0 * x, -3.0 * x, x, -x]);
                assert!(
                    s.iter().chain(&c).all(|v| v.abs() <= 1.0 + 1e-6),
                    "{}, {x}: {s:?} {c:?}",
                    level.name()
                );
            }
        }
    }

    #[test]
    fn exponential_stays_within_2e_7_of_f64() {
        for group in groups(points(87.0)) {
            let [_, _, e] = eight(Level::best(), group);
            for i in 0..8 {
                let truth = f64::from(group[i]).exp();
                assert!((f64::from(e[i]) / truth - 1.0).abs() <= 2e-7, "exp {}: {} {truth}", group[i], e[i]);
            }
        }
    }

    #[test]
    fn exponential_of_zero_is_one_and_of_anything_is_finite_and_positive() {
        let group = [0.0, -0.0, 1e30, -1e30, f32::INFINITY, f32::NEG_INFINITY, 88.5, -87.5];
        let [_, _, e] = eight(Level::best(), group);
        assert_eq!(e[0], 1.0);
        assert_eq!(e[1], 1.0);
        assert!(e.iter().all(|v| v.is_finite() && *v > 0.0), "{e:?}");
    }

    #[test]
    fn every_level_gives_the_same_bytes() {
        for group in groups(points(500.0)) {
            let reference = eight(Level::scalar(), group).map(|v| v.map(f32::to_bits));
            for level in Level::all() {
                let got = eight(level, group).map(|v| v.map(f32::to_bits));
                assert_eq!(got, reference, "{} at {group:?}", level.name());
            }
        }
    }

    #[test]
    fn phases_are_reduced_in_f64() {
        use core::f64::consts::TAU;
        for turns in [0.0, 1.0, -1.0, 1e6, -1e6] {
            let reduced = reduce_phase(0.75 + turns * TAU);
            // 1e6 turns carry an error of 1e6 · 2π · 2^-53.
            assert!((reduced - 0.75).abs() < 2e-9, "{turns}: {reduced}");
        }
        assert!((0.0..TAU).contains(&reduce_phase(-1e-30)));
        assert!((sin_f64(1.25e5) - 1.25e5_f64.sin()).abs() < 1e-10);
    }
}
