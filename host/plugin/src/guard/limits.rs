//! How long a plugin's code may take.

use std::{
    sync::atomic::{AtomicBool, AtomicU64, Ordering},
    time::Duration,
};

use super::Watch;

/// How long a call may take where nobody looks at a picture that stands still: a run that writes files has no
/// hurry.
const OFFLINE: Duration = Duration::from_secs(60);
/// How long a plugin may clean up at the most, whoever waits: the results are written by then.
const END: Duration = Duration::from_secs(2);
/// The option that says otherwise.
const OPTION: &str = "--patience SECONDS";

/// How long calls into plugins may take, measured on the busiest thread's processor time (so that a machine
/// with other work to do condemns nobody), or, for a call that waits, on an eighth of the clock.
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

impl Limits {
    /// Those of a run without a window: a minute for every call.
    pub fn offline() -> Self {
        Self { step: OFFLINE, other: OFFLINE, ..Self::default() }
    }

    /// That of a call.
    pub(crate) fn of(&self, watch: Watch) -> Duration {
        match watch {
            Watch::Step => self.step,
            Watch::Other => self.other,
            Watch::End => self.other.min(END),
        }
    }

    /// These limits for somebody who waits so long for a step, and no shorter than before for other calls.
    pub fn with_patience(self, patience: Duration) -> Self {
        Self { step: patience, other: self.other.max(patience), ..self }
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

static HAS_OPTION: AtomicBool = AtomicBool::new(false);

/// The command line of this process has [`OPTION`]: messages about condemned calls name it.
pub fn offer_patience() {
    HAS_OPTION.store(true, Ordering::Relaxed);
}

/// The option that lengthens a call's limit, where there is one.
pub(super) fn option(watch: Watch) -> Option<&'static str> {
    (HAS_OPTION.load(Ordering::Relaxed) && watch != Watch::End).then_some(OPTION)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_offline_run_waits_much_longer_and_patience_is_taken_at_its_word() {
        let (live, offline) = (Limits::default(), Limits::offline());
        assert!(offline.step >= 100 * live.step && offline.other >= 10 * live.other);
        for patience in [Duration::from_millis(300), Duration::from_secs(7200)] {
            for before in [live, offline] {
                let limits = before.with_patience(patience);
                assert_eq!(limits.step, patience);
                assert!(limits.other >= before.other && limits.other >= patience);
            }
        }
    }
}
