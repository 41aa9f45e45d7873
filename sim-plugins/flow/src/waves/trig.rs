//! Sine and cosine of an angle in half turns, and two to a power that is not positive: what an orbit needs
//! and no more. An angle in half turns is reduced by an exact subtraction, and the sign of an odd half turn
//! is the same for both functions: there are no quadrants to tell apart.

use fearless_simd::{Simd, prelude::*};

use crate::simd::{Lanes, mul_add, neg_mul_add};

/// sin(π r) / r and cos(π r) / (¼ − r²) in r², for |r| ≤ ½: interpolated at Chebyshev's nodes.
const SIN: [f32; 5] = [core::f32::consts::PI, -5.167_710_3, 2.550_077_4, -0.598_290_4, 0.077_655_91];
const COS: [f32; 5] = [4.0, -3.739_208, 1.277_990_8, -0.228_745_09, 0.024_167_106];

/// 1.5 · 2²³: added to a number of less than 2²² it leaves the nearest whole number in the lowest bits.
const MAGIC: f32 = 12_582_912.0;

/// Sine and cosine of π times each lane. Absolute error ≤ 1.5e-7 for |x| < 2²²; what a large angle has
/// already lost by being an f32 (2⁻²⁴ of it) comes on top. Beyond that the sign is arbitrary; what is finite
/// stays within ±1.
#[inline(always)]
pub fn sin_cos_half_turns<S: Simd, V: Lanes<S>>(half_turns: V) -> (V, V) {
    let simd = half_turns.token();
    let n = half_turns.round_ties_even();
    let r = half_turns - n;
    let z = r * r;
    let s = mul_add(V::splat(simd, SIN[4]), z, V::splat(simd, SIN[3]));
    let c = mul_add(V::splat(simd, COS[4]), z, V::splat(simd, COS[3]));
    let s = mul_add(s, z, V::splat(simd, SIN[2]));
    let c = mul_add(c, z, V::splat(simd, COS[2]));
    let s = mul_add(s, z, V::splat(simd, SIN[1]));
    let c = mul_add(c, z, V::splat(simd, COS[1]));
    let s = mul_add(s, z, V::splat(simd, SIN[0]));
    let c = mul_add(c, z, V::splat(simd, COS[0]));
    // From r, not from its rounded square: an exact zero, and full precision beside it.
    let c = c * neg_mul_add(r, r, V::splat(simd, 0.25));
    let odd = (n + V::splat(simd, MAGIC)).bitcast::<V::Int>() << 31;
    let sine = ((s * r).bitcast::<V::Int>() ^ odd).bitcast();
    let cosine = (c.bitcast::<V::Int>() ^ odd).bitcast();
    (sine, cosine)
}

/// 2^r for |r| ≤ ½, with 1 at 0.
const EXP2: [f32; 6] =
    [core::f32::consts::LN_2, 0.240_226_5, 0.055_503_57, 0.009_618_083, 0.001_339_086_3, 0.000_154_531_63];

/// 2 to the power of each lane, none of which is above 0. Relative error ≤ 2e-7; what lies below −125 is
/// taken as −125 (2e-38), so that the result is never zero.
#[inline(always)]
pub fn exp2_down<S: Simd, V: Lanes<S>>(power: V) -> V {
    let simd = power.token();
    let power = power.max(V::splat(simd, -125.0));
    let shifted = power + V::splat(simd, MAGIC);
    let r = power - (shifted - V::splat(simd, MAGIC));
    let p = mul_add(V::splat(simd, EXP2[5]), r, V::splat(simd, EXP2[4]));
    let p = mul_add(p, r, V::splat(simd, EXP2[3]));
    let p = mul_add(p, r, V::splat(simd, EXP2[2]));
    let p = mul_add(p, r, V::splat(simd, EXP2[1]));
    let p = mul_add(p, r, V::splat(simd, EXP2[0]));
    let p = mul_add(p, r, V::splat(simd, 1.0));
    // The whole part, shifted into the exponent; what else the shift moves there falls off its end.
    let exponent = shifted.bitcast::<V::Int>() << 23;
    (p.bitcast::<V::Int>() + exponent).bitcast()
}

#[cfg(test)]
mod tests {
    use core::f64::consts::PI;

    use fearless_simd::f32x8;

    use super::*;
    use crate::Level;

    fn eight(level: Level, values: [f32; 8]) -> [[f32; 8]; 3] {
        crate::dispatch!(level, simd => {
            let x = f32x8::simd_from(simd, values);
            let (s, c) = sin_cos_half_turns(x);
            [s.into(), c.into(), exp2_down(x).into()]
        })
    }

    fn groups(values: impl Iterator<Item = f32>) -> Vec<[f32; 8]> {
        let values: Vec<f32> = values.collect();
        values.chunks_exact(8).map(|c| c.try_into().expect("eight")).collect()
    }

    /// Angles over three half turns to both sides, and some that are far away.
    fn half_turns() -> impl Iterator<Item = f32> {
        let near = (-150_000..150_000).map(|i| i as f32 * 1e-5);
        near.chain((0..80_000).map(|i| i as f32 * 0.137 - 5000.0))
    }

    #[test]
    fn sine_and_cosine_of_half_turns_stay_within_1_5e_7_of_f64() {
        let mut worst: f64 = 0.0;
        for group in groups(half_turns()) {
            let [s, c, _] = eight(Level::best(), group);
            for i in 0..8 {
                // Whole turns off in f64: exact.
                let turns = f64::from(group[i]) / 2.0;
                let (sine, cosine) = ((turns - turns.round()) * 2.0 * PI).sin_cos();
                worst = worst.max((f64::from(s[i]) - sine).abs()).max((f64::from(c[i]) - cosine).abs());
            }
        }
        println!("worst {worst:e}");
        assert!(worst <= 1.5e-7, "{worst:e}");
    }

    #[test]
    fn whole_and_half_numbers_of_half_turns_are_exact_and_far_away_all_is_finite() {
        let [s, c, _] = eight(Level::best(), [0.0, 1.0, -1.0, 2.0, 0.5, -0.5, 4096.5, 4097.5]);
        assert_eq!(&s[..4], [0.0; 4]);
        assert_eq!(&c[4..], [0.0; 4]);
        let far = [5e6, -1e7, 3e8, 1e10, 1e15, -1e30, f32::MAX, f32::MIN];
        let [s, c, _] = eight(Level::best(), far);
        assert!(s.iter().chain(&c).all(|v| v.abs() <= 1.000_001), "{s:?} {c:?}");
    }

    #[test]
    fn powers_of_two_stay_within_2e_7_of_f64_and_above_zero() {
        let mut worst: f64 = 0.0;
        for group in groups((0..500_000).map(|i| -125.0 * (i as f32 / 500_000.0).powi(2))) {
            let [_, _, e] = eight(Level::best(), group);
            for i in 0..8 {
                worst = worst.max((f64::from(e[i]) / f64::from(group[i]).exp2() - 1.0).abs());
            }
        }
        println!("worst {worst:e}");
        assert!(worst <= 2e-7, "{worst:e}");
        let far = eight(Level::best(), [-1e30, f32::NEG_INFINITY, -126.0, -125.0, -0.0, 0.0, -1.0, -2.0])[2];
        let least = 2.0_f32.powi(-125);
        assert_eq!(far, [least, least, least, least, 1.0, 1.0, 0.5, 0.25]);
    }

    #[test]
    fn every_level_gives_the_same_bytes() {
        for group in groups(half_turns().step_by(7)) {
            let down = group.map(|x| -x.abs());
            let bits =
                |level| [eight(level, group), eight(level, down)].map(|e| e.map(|v| v.map(f32::to_bits)));
            let scalar = bits(Level::scalar());
            for level in Level::all() {
                // Powers of positive numbers are nobody's business.
                let got = bits(level);
                assert_eq!(got[0][..2], scalar[0][..2], "{} at {group:?}", level.name());
                assert_eq!(got[1], scalar[1], "{} at {down:?}", level.name());
            }
        }
    }
}
