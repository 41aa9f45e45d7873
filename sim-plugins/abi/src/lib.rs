//! The Rust mirror of `reef_sim.h`, item by item, without the prefix `reef_`.
//!
//! The header is the contract and holds the rules; this crate only spells it for Rust, section by section.
//! The tests of this package compile the header as C11 and C++11 and compare every size, offset and alignment
//! with what stands here.

#![allow(missing_docs, reason = "the header documents each item; what it says in comments stands here too")]

mod plugins;
mod services;
mod step;
mod streams;

pub use plugins::*;
pub use services::*;
pub use step::*;
pub use streams::*;

/// "REEFSIM\0", read as a little-endian integer.
pub const MAGIC: u64 = 0x004d495346454552;
pub const VERSION_MAJOR: u32 = 0;
pub const VERSION_MINOR: u32 = 2;
pub const VERSION: u32 = (VERSION_MAJOR << 16) | VERSION_MINOR;
/// FNV-1a (64 bits) over this file's bytes without its one line that defines REEF_HEADER_HASH. A test keeps
/// it true.
pub const HEADER_HASH: u64 = 0x3c6a79609c2da18d;
/// done; the outputs count
pub const OK: i32 = 0;
/// nothing changed since the last step: the last outputs stay, flow and actors included. After create(),
/// reset() and load_state() there are none yet: the first step emits
pub const SLEEP: i32 = 1;
/// this step is refused, the state is untouched; the last good outputs stay. Its events are not given again:
/// a parameter whose event was in it keeps its value from before
pub const DISCARD: i32 = 2;
/// the instance needs reset() or load_state()
pub const ERROR: i32 = -1;
/// the library is at fault (a caught panic, say)
pub const FATAL: i32 = -2;
/// not known to this host, or not taken by it; nothing came of the call, and the step goes on
pub const UNSUPPORTED: i32 = -3;
/// load_state: not readable; the instance is untouched
pub const BAD_STATE: i32 = -4;
/// a limit of the host is reached; the message names it
pub const NO_SPACE: i32 = -5;
/// create: the configuration is wrong; the message names the JSON path
pub const BAD_INPUT: i32 = -6;
pub const LOG_ERROR: u32 = 1;
pub const LOG_WARN: u32 = 2;
pub const LOG_INFO: u32 = 3;
pub const LOG_DEBUG: u32 = 4;
/// Instruction sets that a plugin may use in a step (reef_step.simd_level). All give the same bytes.
pub const SIMD_SCALAR: u32 = 0;
/// or NEON
pub const SIMD_SSE4_2: u32 = 1;
/// with FMA
pub const SIMD_AVX2: u32 = 2;
pub const SIMD_AVX512: u32 = 3;

/// FNV-1a, 64 bits: the hash of the header and of stable names.
pub const fn fnv1a_64(bytes: &[u8]) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let mut i = 0;
    while i < bytes.len() {
        hash = (hash ^ bytes[i] as u64).wrapping_mul(0x0000_0100_0000_01b3);
        i += 1;
    }
    hash
}

/// FNV-1a, 32 bits: a species' name as [`Actor::species`].
pub const fn fnv1a_32(bytes: &[u8]) -> u32 {
    let mut hash = 0x811c_9dc5_u32;
    let mut i = 0;
    while i < bytes.len() {
        hash = (hash ^ bytes[i] as u32).wrapping_mul(0x0100_0193);
        i += 1;
    }
    hash
}
