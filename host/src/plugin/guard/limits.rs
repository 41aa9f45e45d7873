//! How long a plugin's code may take.

use std::{
    sync::atomic::{AtomicU64, Ordering},
    time::Duration,
};

/// How long calls into plugins may take, measured on the busiest thread's processor time (so that a machine with other
/// work to do condemns nobody), or, for a call that waits, on an eighth of the clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// A step: after this its `should_stop` says so. Zero: no limit for any call.
    pub step: Duration,
    /// Everything else: open, create, save, load and the like may do more at once than a step.
    pub other: Duration,
    /// How long a call that was asked to stop may go on before it is stopped by force.
    pub grace: Duration,
}

impl Default for Limits {
    /// A quarter of a second for a step, two seconds for the rest; 150 ms to obey.
    fn default() -> Self {
        Self {
            step: Duration::from_millis(250),
            other: Duration::from_secs(2),
            grace: Duration::from_millis(150),
        }
    }
}

static STEP: AtomicU64 = AtomicU64::new(u64::MAX);
static OTHER: AtomicU64 = AtomicU64::new(u64::MAX);
static GRACE: AtomicU64 = AtomicU64::new(u64::MAX);

/// The limits of this process.
pub fn limits() -> Limits {
    let default = Limits::default();
    let read = |value: &AtomicU64, default| match value.load(Ordering::Relaxed) {
        u64::MAX => default,
        nanoseconds => Duration::from_nanos(nanoseconds),
    };
    Limits {
        step: read(&STEP, default.step),
        other: read(&OTHER, default.other),
        grace: read(&GRACE, default.grace),
    }
}

/// Other limits for this process, from now on.
pub fn set_limits(limits: Limits) {
    let write = |value: &AtomicU64, limit: Duration| {
        value.store(u64::try_from(limit.as_nanos()).unwrap_or(u64::MAX - 1), Ordering::Relaxed);
    };
    write(&STEP, limits.step);
    write(&OTHER, limits.other);
    write(&GRACE, limits.grace);
}
