//! Which instruction set a kernel runs on: the contract's `REEF_SIMD_*` levels, mapped to tokens in this one
//! place.
//!
//! The program is built for baseline x86-64; [`dispatch!`] compiles its expression once a level and picks one
//! at run time, so a test or the step input can force any level that the machine has. All levels give the
//! same bytes: kernels use [`mul_add`] (one rounding everywhere; in software below AVX2, and slow there),
//! `sqrt` and `/`, which are exact, and no estimates.

use fearless_simd::{Simd, f32x4, f32x8, f32x16, f64x2, i32x4, i32x8, i32x16, i64x2, prelude::*};

/// An instruction set that this machine has.
#[derive(Clone, Copy, Debug)]
pub enum Level {
    /// No more than the machine's architecture promises: SSE2 on x86-64, no vectors elsewhere. On every
    /// machine.
    Scalar(Baseline),
    /// x86-64-v2.
    #[cfg(target_arch = "x86_64")]
    Sse42(fearless_simd::x86::Sse4_2),
    /// x86-64-v3: AVX2 and FMA.
    #[cfg(target_arch = "x86_64")]
    Avx2(fearless_simd::x86::Avx2),
    /// AVX-512 as of Ice Lake and Zen 4.
    #[cfg(target_arch = "x86_64")]
    Avx512(fearless_simd::x86::Avx512),
    /// 64-bit ARM.
    #[cfg(target_arch = "aarch64")]
    Neon(fearless_simd::aarch64::Neon),
}

/// The token of the instructions that every machine of this architecture has.
///
/// On x86-64 that is SSE2 and not the library's fallback: kernels on plain arrays gave the same bytes, no
/// faster, and took five times as long to compile.
#[cfg(target_arch = "x86_64")]
pub type Baseline = fearless_simd::x86::Sse2;
/// The token of the instructions that every machine of this architecture has.
#[cfg(not(target_arch = "x86_64"))]
pub type Baseline = fearless_simd::Fallback;

impl Level {
    /// The baseline.
    pub fn scalar() -> Self {
        #[cfg(target_arch = "x86_64")]
        #[allow(unsafe_code, reason = "the one token that needs no run-time check")]
        // SAFETY: SSE2 and FXSR are part of x86-64 itself.
        let token = unsafe { Baseline::assume_supported() };
        #[cfg(not(target_arch = "x86_64"))]
        let token = Baseline::new();
        Self::Scalar(token)
    }

    /// The widest that this machine has.
    pub fn best() -> Self {
        Self::at_most(u32::MAX)
    }

    /// The widest that this machine has and that does not pass `level`, one of `REEF_SIMD_*`
    /// (reef_step.simd_level).
    pub fn at_most(level: u32) -> Self {
        let machine = fearless_simd::Level::new();
        #[cfg(target_arch = "x86_64")]
        {
            if level >= reef_abi::SIMD_AVX512
                && let Some(token) = machine.as_avx512()
            {
                return Self::Avx512(token);
            }
            if level >= reef_abi::SIMD_AVX2
                && let Some(token) = machine.as_avx2()
            {
                return Self::Avx2(token);
            }
            if level >= reef_abi::SIMD_SSE4_2
                && let Some(token) = machine.as_sse4_2()
            {
                return Self::Sse42(token);
            }
        }
        #[cfg(target_arch = "aarch64")]
        if level >= reef_abi::SIMD_SSE4_2
            && let Some(token) = machine.as_neon()
        {
            return Self::Neon(token);
        }
        let _ = (machine, level);
        Self::scalar()
    }

    /// Every level that this machine has, narrowest first.
    pub fn all() -> Vec<Self> {
        let mut levels: Vec<Self> = Vec::new();
        for code in [reef_abi::SIMD_SCALAR, reef_abi::SIMD_SSE4_2, reef_abi::SIMD_AVX2, reef_abi::SIMD_AVX512]
        {
            let level = Self::at_most(code);
            if levels.last().is_none_or(|last| last.code() < level.code()) {
                levels.push(level);
            }
        }
        levels
    }

    /// The contract's number, one of `REEF_SIMD_*`.
    pub fn code(self) -> u32 {
        match self {
            Self::Scalar(_) => reef_abi::SIMD_SCALAR,
            #[cfg(target_arch = "x86_64")]
            Self::Sse42(_) => reef_abi::SIMD_SSE4_2,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(_) => reef_abi::SIMD_AVX2,
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(_) => reef_abi::SIMD_AVX512,
            #[cfg(target_arch = "aarch64")]
            Self::Neon(_) => reef_abi::SIMD_SSE4_2,
        }
    }

    /// For people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Scalar(_) => "scalar",
            #[cfg(target_arch = "x86_64")]
            Self::Sse42(_) => "SSE4.2",
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(_) => "AVX2 + FMA",
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(_) => "AVX-512",
            #[cfg(target_arch = "aarch64")]
            Self::Neon(_) => "NEON",
        }
    }
}

/// Runs an expression with the vector instructions of a [`Level`]:
/// `dispatch!(level, simd => kernel(simd, …))`.
///
/// The expression is compiled once a level; `simd` is the token that vector types are made with. What it
/// calls must be `#[inline(always)]`, or it falls back to the baseline's instructions. It runs in a closure:
/// no `return`, no `?`.
#[macro_export]
macro_rules! dispatch {
    ($level:expr, $simd:ident => $op:expr) => {
        match $level {
            $crate::simd::Level::Scalar(token) => $crate::dispatch!(@with token, $simd => $op),
            #[cfg(target_arch = "x86_64")]
            $crate::simd::Level::Sse42(token) => $crate::dispatch!(@with token, $simd => $op),
            #[cfg(target_arch = "x86_64")]
            $crate::simd::Level::Avx2(token) => $crate::dispatch!(@with token, $simd => $op),
            #[cfg(target_arch = "x86_64")]
            $crate::simd::Level::Avx512(token) => $crate::dispatch!(@with token, $simd => $op),
            #[cfg(target_arch = "aarch64")]
            $crate::simd::Level::Neon(token) => $crate::dispatch!(@with token, $simd => $op),
        }
    };
    (@with $token:ident, $simd:ident => $op:expr) => {{
        let $simd = $token;
        $crate::fearless_simd::Simd::vectorize(
            $token,
            #[inline(always)]
            || $op,
        )
    }};
}

/// Four, eight or sixteen lanes of f32. Sixteen are two registers below AVX-512: twice the independent work
/// for a kernel whose equations wait for one another.
pub trait Lanes<S: Simd>: SimdFloat<S, Element = f32> {
    /// As many lanes of i32.
    type Int: SimdInt<S, Element = i32, Mask = Self::Mask, ByteVector = Self::ByteVector>
        + SimdCvtTruncate<Self>;

    /// `self · b + c`, rounded once, where the level has no instruction for it.
    fn soft_mul_add(self, b: Self, c: Self) -> Self;

    /// The nearest number to each whole one.
    fn from_int(whole: Self::Int) -> Self;
}

impl<S: Simd> Lanes<S> for f32x4<S> {
    type Int = i32x4<S>;

    #[inline(always)]
    fn soft_mul_add(self, b: Self, c: Self) -> Self {
        let ([a, b, c], mut rows) = ([self, b, c], [[0.0; 8]; 3]);
        a.store_slice(&mut rows[0][..4]);
        b.store_slice(&mut rows[1][..4]);
        c.store_slice(&mut rows[2][..4]);
        f32x4::from_slice(self.simd, &soft_mul_add(&rows[0], &rows[1], &rows[2])[..4])
    }

    #[inline(always)]
    fn from_int(whole: Self::Int) -> Self {
        whole.to_float()
    }
}

impl<S: Simd> Lanes<S> for f32x8<S> {
    type Int = i32x8<S>;

    #[inline(always)]
    fn soft_mul_add(self, b: Self, c: Self) -> Self {
        f32x8::simd_from(self.simd, soft_mul_add(&self.into(), &b.into(), &c.into()))
    }

    #[inline(always)]
    fn from_int(whole: Self::Int) -> Self {
        whole.to_float()
    }
}

impl<S: Simd> Lanes<S> for f32x16<S> {
    type Int = i32x16<S>;

    #[inline(always)]
    fn soft_mul_add(self, b: Self, c: Self) -> Self {
        let ((a0, a1), (b0, b1), (c0, c1)) = (self.split(), b.split(), c.split());
        a0.soft_mul_add(b0, c0).combine(a1.soft_mul_add(b1, c1))
    }

    #[inline(always)]
    fn from_int(whole: Self::Int) -> Self {
        whole.to_float()
    }
}

/// `a · b + c` with one rounding, at every level.
#[inline(always)]
pub fn mul_add<S: Simd, V: Lanes<S>>(a: V, b: V, c: V) -> V {
    if fuses(a.token()) { a.mul_add(b, c) } else { a.soft_mul_add(b, c) }
}

/// `c − a · b` with one rounding, at every level.
#[inline(always)]
pub fn neg_mul_add<S: Simd, V: Lanes<S>>(a: V, b: V, c: V) -> V {
    mul_add(-a, b, c)
}

/// Whether the level's instructions fuse a multiply-add. Known while compiling: no branch is left.
#[inline(always)]
fn fuses<S: Simd>(simd: S) -> bool {
    match simd.level() {
        #[cfg(target_arch = "x86_64")]
        fearless_simd::Level::Avx2(_) | fearless_simd::Level::Avx512(_) => true,
        #[cfg(target_arch = "aarch64")]
        fearless_simd::Level::Neon(_) => true,
        _ => false,
    }
}

/// A fused multiply-add where the processor has none. One function for all kernels: inlined, its instructions
/// would be most of what a kernel compiles to.
#[inline(never)]
fn soft_mul_add(a: &[f32; 8], b: &[f32; 8], c: &[f32; 8]) -> [f32; 8] {
    let Level::Scalar(simd) = Level::scalar() else { unreachable!("the baseline is the baseline") };
    let half = |from: usize| {
        let four = |all: &[f32; 8]| f32x4::from_slice(simd, &all[from..from + 4]);
        twice_rounded(four(a), four(b), four(c))
    };
    match (half(0), half(4)) {
        (Some(low), Some(high)) => low.combine(high).into(),
        _ => core::array::from_fn(|i| soft_mul_add_1(a[i], b[i], c[i])),
    }
}

/// `a · b + c` rounded to f64 and then to f32; None where that may differ from a single rounding: where an
/// f64 lies halfway between two f32, or where f32 thins out towards zero.
///
/// The product of two f32 is exact in f64, so only the sum is rounded there. Where the f64 is not halfway
/// between two f32, the exact sum lies on the same side of the halfway as it does.
#[inline(always)]
fn twice_rounded<S: Simd>(a: f32x4<S>, b: f32x4<S>, c: f32x4<S>) -> Option<f32x4<S>> {
    // An f64 has 29 bits more than an f32; halfway is the first of them alone.
    const MORE: i64 = (1 << 29) - 1;
    const HALFWAY: i64 = 1 << 28;
    // Twice the least normal f32: what is rounded up to it is thinned out, too.
    const THIN: f64 = 2.0 * f32::MIN_POSITIVE as f64;
    let ((a0, a1), (b0, b1), (c0, c1)) = (a.widen(), b.widen(), c.widen());
    let sums = (a0 * b0 + c0, a1 * b1 + c1);
    let halfway = |sum: f64x2<S>| (sum.bitcast::<i64x2<S>>() & MORE).simd_eq(HALFWAY);
    let thin = |sum: f64x2<S>| sum.abs().simd_lt(THIN) & !sum.simd_eq(0.0);
    let doubtful = halfway(sums.0) | halfway(sums.1) | thin(sums.0) | thin(sums.1);
    (!doubtful.any_true()).then(|| sums.0.narrow(sums.1))
}

/// The product of two f32 is exact in f64. Their sum with c is rounded to odd (toward the f64 neighbour whose
/// last bit is 1, unless it is exact), so that rounding it once more to f32 gives what a single rounding
/// would have given (Boldo and Melquiond 2008).
#[inline(always)]
fn soft_mul_add_1(a: f32, b: f32, c: f32) -> f32 {
    let product = f64::from(a) * f64::from(b);
    let c = f64::from(c);
    let sum = product + c;
    // What the sum lost (Knuth's TwoSum); NaN where something was not finite, and then nothing is corrected.
    let from_c = sum - product;
    let lost = (product - (sum - from_c)) + (c - from_c);
    let bits = sum.to_bits();
    let away = (lost > 0.0) == (sum > 0.0);
    let odd = if bits & 1 != 0 || lost == 0.0 || lost.is_nan() {
        bits
    } else if away {
        bits + 1
    } else {
        bits - 1
    };
    f64::from_bits(odd) as f32
}

/// Eight equal lanes.
#[inline(always)]
pub fn splat<S: Simd>(simd: S, value: f32) -> f32x8<S> {
    f32x8::splat(simd, value)
}

/// Eight equal vectors. Kernels write such things out: a closure, as `map` takes it, does not always inherit
/// the vector instructions of where it stands, and then costs a call an operation.
#[inline(always)]
pub fn splat3<S: Simd>(simd: S, [x, y, z]: [f32; 3]) -> [f32x8<S>; 3] {
    [splat(simd, x), splat(simd, y), splat(simd, z)]
}

/// Sixteen equal lanes.
#[inline(always)]
pub fn splat16<S: Simd>(simd: S, value: f32) -> f32x16<S> {
    f32x16::splat(simd, value)
}

/// Each lane between `low` and `high`.
#[inline(always)]
pub fn clamp<S: Simd, V: Lanes<S>>(value: V, low: V, high: V) -> V {
    value.max(low).min(high)
}

/// Asks for the memory of `values`, which will soon be read or written. Changes nothing but how long that
/// takes.
#[inline(always)]
pub fn prefetch<T>(values: &[T]) {
    for line in (0..size_of_val(values)).step_by(LINE) {
        ask(values.as_ptr().cast::<u8>().wrapping_add(line));
    }
}

/// A line of a processor's caches [bytes].
const LINE: usize = 64;

#[inline(always)]
fn ask(place: *const u8) {
    #[cfg(target_arch = "x86_64")]
    {
        use core::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        #[allow(unsafe_code, reason = "the one instruction that no safe function gives")]
        // SAFETY: a prefetch neither reads nor faults, whatever the address; SSE is part of x86-64 itself.
        unsafe {
            _mm_prefetch::<_MM_HINT_T0>(place.cast());
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = place;
}

/// Pieces of memory that will be needed after what is worked on now, asked for a little at a time: by itself
/// a processor looks no farther than the page that it is in, and all at once would be more requests than it
/// keeps.
#[derive(Clone, Copy, Debug, Default)]
pub struct Ahead {
    /// Address and lines of each piece.
    pieces: [(usize, usize); 8],
    count: usize,
    /// The piece under way, and its next line.
    at: (usize, usize),
    lines: usize,
    pace: usize,
}

impl Ahead {
    /// Nothing to ask for.
    pub fn none() -> Self {
        Self::default()
    }

    /// Adds a piece; of more than eight the last are left out.
    pub fn add<T>(&mut self, values: &[T]) {
        let lines = size_of_val(values).div_ceil(LINE);
        if let (Some(piece), true) = (self.pieces.get_mut(self.count), lines > 0) {
            *piece = (values.as_ptr().addr(), lines);
            self.count += 1;
            self.lines += lines;
        }
    }

    /// Spreads the pieces over so many calls of [`Self::ask`].
    pub fn spread(&mut self, calls: usize) {
        self.pace = self.lines.div_ceil(calls.max(1));
    }

    /// Asks for the next lines.
    #[inline(always)]
    pub fn ask(&mut self) {
        let mut left = self.pace;
        while left > 0 && self.at.0 < self.count {
            let ((address, lines), line) = (self.pieces[self.at.0], self.at.1);
            let now = left.min(lines - line);
            for line in line..line + now {
                ask(core::ptr::without_provenance(address + line * LINE));
            }
            left -= now;
            self.at = if line + now == lines { (self.at.0 + 1, 0) } else { (self.at.0, line + now) };
        }
    }
}

/// How far ahead [`blocks`] asks for memory, in blocks.
const AHEAD: usize = 3;

/// `values` in blocks of about a KiB, each asked for while those before it are worked on: by themselves,
/// processors do not look beyond the page that they are in.
pub fn blocks<T>(values: &[T]) -> impl Iterator<Item = &[T]> {
    let size = (1024 / size_of::<T>().max(1)).max(1);
    let mut ahead = values.chunks(size).skip(AHEAD);
    values.chunks(size).inspect(move |_| prefetch(ahead.next().unwrap_or_default()))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn fused(level: Level, a: f32, b: f32, c: f32) -> u32 {
        let eight: [f32; 8] = crate::dispatch!(level, simd => {
            mul_add(splat(simd, a), splat(simd, b), splat(simd, c)).into()
        });
        eight[0].to_bits()
    }

    #[test]
    fn a_product_that_ends_halfway_between_two_numbers_is_rounded_once() {
        // (1 + 2⁻¹²)² = 1 + 2⁻¹¹ + 2⁻²⁴: the last bit is half a unit of f32, and c decides where it goes.
        let a = 1.0 + 2.0_f32.powi(-12);
        let tiny = 2.0_f32.powi(-120);
        let down = 1.0 + 2.0_f32.powi(-11);
        for level in Level::all() {
            assert_eq!(fused(level, a, a, 0.0), down.to_bits(), "{}", level.name());
            assert_eq!(fused(level, a, a, -tiny), down.to_bits(), "{}", level.name());
            assert_eq!(fused(level, a, a, tiny), down.to_bits() + 1, "{}", level.name());
            assert_eq!(fused(level, 3.0, f32::INFINITY, 1.0), f32::INFINITY.to_bits());
            assert_eq!(fused(level, 0.0, 5.0, -0.0), 0.0_f32.to_bits());
            // 2⁻¹⁵⁰ · (1 − 2⁻⁴⁶): a little less than half of the least number, which f64 takes for half.
            let half = (2.0_f32.powi(-75) * (1.0 - f32::EPSILON), 2.0_f32.powi(-75) * (1.0 + f32::EPSILON));
            let odd = f32::MIN_POSITIVE.next_down();
            assert_eq!(fused(level, half.0, half.1, odd), odd.to_bits(), "{}", level.name());
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]
        #[test]
        fn the_soft_multiply_add_is_that_of_the_processor(a in any::<f32>(), b in any::<f32>(), near in any::<i32>(), c in any::<f32>()) {
            // Half of the cases have c near −a·b, where digits cancel.
            for c in [c, f32::from_bits((-(a * b)).to_bits().wrapping_add((near >> 24) as u32))] {
                if !c.is_finite() {
                    continue;
                }
                // std's is the C library's or the processor's, rounded once.
                let truth = a.mul_add(b, c);
                prop_assert_eq!(soft_mul_add_1(a, b, c).to_bits(), truth.to_bits(), "{} {} {}", a, b, c);
                // Beside lanes that are not in doubt, and whose sums are zero.
                let eight = soft_mul_add(&[a, 1.0, 0.0, 3.0, a, 2.0, 0.0, 5.0], &[b; 8], &[c, 0.5, 0.0, 1.0, c, -b, 0.0, 7.0]);
                for lane in [0, 4] {
                    prop_assert_eq!(eight[lane].to_bits(), truth.to_bits(), "{} {} {}", a, b, c);
                }
            }
        }
    }
}
