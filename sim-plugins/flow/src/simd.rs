//! Which instruction set a kernel runs on: the contract's `REEF_SIMD_*` levels, mapped to tokens in this one place.
//!
//! The program is built for baseline x86-64; [`dispatch!`] compiles its expression once a level and picks one at run
//! time, so a test or the step input can force any level that the machine has. All levels give the same bytes: kernels
//! use [`mul_add`] (one rounding everywhere; in software below AVX2, and slow there), `sqrt` and `/`, which are exact,
//! and no estimates.

use fearless_simd::{Simd, f32x8, prelude::*};

/// An instruction set that this machine has.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub enum Level {
    /// No vector instructions asked for. On every machine.
    Scalar(fearless_simd::Fallback),
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

impl Level {
    /// No vector instructions.
    pub fn scalar() -> Self {
        Self::Scalar(fearless_simd::Fallback::new())
    }

    /// The widest that this machine has.
    pub fn best() -> Self {
        Self::at_most(u32::MAX)
    }

    /// The widest that this machine has and that does not pass `level`, one of `REEF_SIMD_*` (reef_step.simd_level).
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

/// Runs an expression with the vector instructions of a [`Level`]: `dispatch!(level, simd => kernel(simd, …))`.
///
/// The expression is compiled once a level; `simd` is the token that vector types are made with. What it calls must be
/// `#[inline(always)]`, or it falls back to the baseline's instructions. It runs in a closure: no `return`, no `?`.
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
            #[allow(unreachable_patterns, reason = "the enum may grow, this match is compiled elsewhere")]
            _ => {
                let token = $crate::fearless_simd::Fallback::new();
                $crate::dispatch!(@with token, $simd => $op)
            }
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

/// `a · b + c` with one rounding, at every level.
#[inline(always)]
pub fn mul_add<S: Simd>(a: f32x8<S>, b: f32x8<S>, c: f32x8<S>) -> f32x8<S> {
    a.mul_add_precise(b, c)
}

/// `c − a · b` with one rounding, at every level.
#[inline(always)]
pub fn neg_mul_add<S: Simd>(a: f32x8<S>, b: f32x8<S>, c: f32x8<S>) -> f32x8<S> {
    (-a).mul_add_precise(b, c)
}

/// Eight equal lanes.
#[inline(always)]
pub fn splat<S: Simd>(simd: S, value: f32) -> f32x8<S> {
    f32x8::splat(simd, value)
}

/// Each lane between `low` and `high`.
#[inline(always)]
pub fn clamp<S: Simd>(value: f32x8<S>, low: f32x8<S>, high: f32x8<S>) -> f32x8<S> {
    value.max(low).min(high)
}
