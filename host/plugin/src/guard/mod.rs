//! Guards around a plugin's code: a call that ends in a signal (a bad pointer, an illegal instruction, an
//! abort, a full stack) or does not end at all is left, and the host goes on without that library.
//!
//! A guarded call saves the registers that a call preserves and leads the signal handler back to them.
//! Whether a signal is the plugin's fault follows from the thread's [`marker`](super::marker), never from the
//! program counter; signals of the host itself go where they went before. What a left call held — memory,
//! locks of the library — stays as it was: its generation is never called again, nor unloaded.
//!
//! Guards exist on Linux, on x86-64 and AArch64. Elsewhere calls go straight through.

mod fate;
mod fault;
mod limits;

#[cfg(all(target_os = "linux", any(target_arch = "x86_64", target_arch = "aarch64")))]
#[path = "linux/mod.rs"]
mod machine;
#[cfg(not(all(target_os = "linux", any(target_arch = "x86_64", target_arch = "aarch64"))))]
#[path = "absent.rs"]
mod machine;

/// Signals that a plugin's code may cause.
#[cfg(target_os = "linux")]
pub(crate) const FAULTS: [i32; 7] =
    [libc::SIGSEGV, libc::SIGBUS, libc::SIGILL, libc::SIGFPE, libc::SIGABRT, libc::SIGTRAP, libc::SIGSYS];

pub(crate) use fate::{Fate, Watch};
pub(crate) use fault::Fault;
#[cfg(target_os = "linux")]
pub use fault::Part;
pub use limits::{Limits, limits, offer_patience, set_limits};
#[cfg(target_os = "linux")]
pub use machine::ever_taken;
pub(crate) use machine::{
    Called, Resident, Text, guarded, join, leave, leave_foreign, probe_read, probe_write, put_back,
    put_back_jobs, put_in_place, require_stack,
};
pub use machine::{KEEPS_STATES, Noted, forget_state, keep_state};
