//! Where a thread is: in the host, in a plugin's code, or in a host service that a plugin called. Whose fault a crash is
//! follows from this, not from the program counter (which is in libc for a bad memcpy).

use std::sync::atomic::{AtomicU32, AtomicU64, Ordering, compiler_fence};

/// Where this thread is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Place {
    /// In the host.
    Host,
    /// In the code of the generation with this number.
    Plugin(u64),
    /// In a service of the host, called by that generation.
    Service(u64),
}

impl Place {
    const fn to_bits(self) -> u64 {
        match self {
            Self::Host => 0,
            Self::Plugin(generation) => generation << 2 | 1,
            Self::Service(generation) => generation << 2 | 2,
        }
    }

    const fn from_bits(bits: u64) -> Self {
        match bits & 3 {
            1 => Self::Plugin(bits >> 2),
            2 => Self::Service(bits >> 2),
            _ => Self::Host,
        }
    }
}

/// No job runs on this thread.
const NO_JOB: u32 = u32::MAX;

thread_local! {
    // Single words, without initialiser or destructor: signal handlers read them.
    static PLACE: AtomicU64 = const { AtomicU64::new(Place::Host.to_bits()) };
    /// The worker index while a job of `parallel_for` runs on this thread.
    static JOB: AtomicU32 = const { AtomicU32::new(NO_JOB) };
}

/// Where this thread is now. May be called from a signal handler.
pub(crate) fn place() -> Place {
    Place::from_bits(PLACE.with(|place| place.load(Ordering::Relaxed)))
}

/// From here on the thread is there: nothing of the code around moves over this line.
pub(crate) fn set_place(place: Place) {
    compiler_fence(Ordering::SeqCst);
    PLACE.with(|now| now.store(place.to_bits(), Ordering::Relaxed));
    compiler_fence(Ordering::SeqCst);
}

/// All that the marker says, to be restored when a call is left from anywhere.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Whole {
    place: u64,
    job: u32,
}

/// All that the marker says now.
pub(crate) fn whole() -> Whole {
    Whole {
        place: PLACE.with(|place| place.load(Ordering::Relaxed)),
        job: JOB.with(|job| job.load(Ordering::Relaxed)),
    }
}

/// It says this again.
pub(crate) fn restore(whole: Whole) {
    compiler_fence(Ordering::SeqCst);
    PLACE.with(|place| place.store(whole.place, Ordering::Relaxed));
    JOB.with(|job| job.store(whole.job, Ordering::Relaxed));
    compiler_fence(Ordering::SeqCst);
}

/// Runs a service of the host for the plugin that called it.
pub(crate) fn in_service<R>(generation: u64, call: impl FnOnce() -> R) -> R {
    let before = place();
    set_place(Place::Service(generation));
    let result = call();
    set_place(before);
    result
}

/// The worker whose job runs on this thread.
pub(crate) fn current_job() -> Option<u32> {
    let worker = JOB.with(|job| job.load(Ordering::Relaxed));
    (worker != NO_JOB).then_some(worker)
}

/// Runs a job as `worker`.
pub(crate) fn in_job<R>(worker: u32, job: impl FnOnce() -> R) -> R {
    let before = JOB.with(|now| {
        let before = now.load(Ordering::Relaxed);
        now.store(worker, Ordering::Relaxed);
        before
    });
    let result = job();
    JOB.with(|now| now.store(before, Ordering::Relaxed));
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_one_word() {
        for place in [Place::Host, Place::Plugin(7), Place::Service(1 << 40)] {
            assert_eq!(Place::from_bits(place.to_bits()), place);
        }
    }

    #[test]
    fn places_nest_and_come_back() {
        let before = whole();
        set_place(Place::Plugin(3));
        in_service(3, || assert_eq!(place(), Place::Service(3)));
        assert_eq!(place(), Place::Plugin(3));
        restore(before);
        assert_eq!((place(), current_job()), (Place::Host, None));
        in_job(2, || assert_eq!(current_job(), Some(2)));
    }
}
