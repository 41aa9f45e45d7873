//! Where a thread is: in the host, in a plugin's code, or in a host service that a plugin called. Whose fault a crash is
//! follows from this, not from the program counter (which is in libc for a bad memcpy).

use std::{
    ptr,
    sync::atomic::{AtomicPtr, AtomicU32, AtomicU64, Ordering, compiler_fence},
};

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

/// What is known of one thread. Single words, without initialiser or destructor: signal handlers read them.
struct Here {
    place: AtomicU64,
    /// The worker index while a job of `parallel_for` runs.
    job: AtomicU32,
    /// The record of the innermost guarded call, or NULL.
    frame: AtomicPtr<()>,
}

thread_local! {
    // All in one: a guarded call looks for it twice, not once a word.
    static HERE: Here = const {
        Here {
            place: AtomicU64::new(Place::Host.to_bits()),
            job: AtomicU32::new(NO_JOB),
            frame: AtomicPtr::new(ptr::null_mut()),
        }
    };
}

/// Where this thread is now. May be called from a signal handler.
pub(crate) fn place() -> Place {
    Place::from_bits(HERE.with(|here| here.place.load(Ordering::Relaxed)))
}

/// The record of this thread's innermost guarded call, or NULL. May be called from a signal handler.
pub(crate) fn frame() -> *mut () {
    HERE.with(|here| here.frame.load(Ordering::Relaxed))
}

/// From here on the thread is there: nothing of the code around moves over this line.
pub(crate) fn set_place(place: Place) {
    compiler_fence(Ordering::SeqCst);
    HERE.with(|here| here.place.store(place.to_bits(), Ordering::Relaxed));
    compiler_fence(Ordering::SeqCst);
}

/// All that the marker says, to be restored when a call is left from anywhere.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Whole {
    place: u64,
    job: u32,
    frame: *mut (),
}

/// A guarded call begins: signals find its record from here on. Returns what the marker said before.
#[inline]
pub(crate) fn enter(place: Place, frame: *mut ()) -> Whole {
    compiler_fence(Ordering::SeqCst);
    let before = HERE.with(|here| {
        let before = Whole {
            place: here.place.load(Ordering::Relaxed),
            job: here.job.load(Ordering::Relaxed),
            frame: here.frame.load(Ordering::Relaxed),
        };
        here.frame.store(frame, Ordering::Relaxed);
        compiler_fence(Ordering::SeqCst);
        here.place.store(place.to_bits(), Ordering::Relaxed);
        before
    });
    compiler_fence(Ordering::SeqCst);
    before
}

/// It says this again.
#[inline]
pub(crate) fn restore(whole: Whole) {
    compiler_fence(Ordering::SeqCst);
    HERE.with(|here| {
        here.place.store(whole.place, Ordering::Relaxed);
        here.job.store(whole.job, Ordering::Relaxed);
        compiler_fence(Ordering::SeqCst);
        here.frame.store(whole.frame, Ordering::Relaxed);
    });
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
    let worker = HERE.with(|here| here.job.load(Ordering::Relaxed));
    (worker != NO_JOB).then_some(worker)
}

/// Runs a job as `worker`.
pub(crate) fn in_job<R>(worker: u32, job: impl FnOnce() -> R) -> R {
    let before = HERE.with(|here| {
        let before = here.job.load(Ordering::Relaxed);
        here.job.store(worker, Ordering::Relaxed);
        before
    });
    let result = job();
    HERE.with(|here| here.job.store(before, Ordering::Relaxed));
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
        let mut record = 0_u8;
        let record = ptr::from_mut(&mut record).cast();
        let before = enter(Place::Plugin(3), record);
        in_service(3, || assert_eq!(place(), Place::Service(3)));
        assert_eq!((place(), frame()), (Place::Plugin(3), record));
        restore(before);
        assert_eq!((place(), current_job(), frame()), (Place::Host, None, ptr::null_mut()));
        in_job(2, || assert_eq!(current_job(), Some(2)));
    }
}
