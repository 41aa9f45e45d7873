//! Where a thread is: in the host, in a plugin's code, or in a host service that a plugin called. Whose fault
//! a crash is follows from this, not from the program counter (which is in libc for a bad memcpy).

use std::{
    cell::UnsafeCell,
    ptr,
    sync::atomic::{Ordering, compiler_fence},
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
    /// At the end of a thread of that generation, where destructors of thread-locals run.
    Ending(u64),
}

impl Place {
    #[inline(always)]
    const fn to_bits(self) -> u64 {
        match self {
            Self::Host => 0,
            Self::Plugin(generation) => generation << 2 | 1,
            Self::Service(generation) => generation << 2 | 2,
            Self::Ending(generation) => generation << 2 | 3,
        }
    }

    const fn from_bits(bits: u64) -> Self {
        match bits & 3 {
            1 => Self::Plugin(bits >> 2),
            2 => Self::Service(bits >> 2),
            3 => Self::Ending(bits >> 2),
            _ => Self::Host,
        }
    }
}

/// No job runs on this thread.
const NO_JOB: u32 = u32::MAX;

/// What is known of one thread. Plain words, without initialiser or destructor, which this thread alone reads
/// and writes: signal handlers on it see what stands before the last fence.
#[derive(Clone, Copy, Debug)]
struct Here {
    place: u64,
    /// The worker index while a job of `parallel_for` runs.
    job: u32,
    /// The record of the innermost guarded call, or NULL; at a thread's end, the fate of its generation.
    frame: *mut (),
}

thread_local! {
    // All in one: a guarded call looks for it once.
    static HERE: UnsafeCell<Here> = const {
        UnsafeCell::new(Here { place: Place::Host.to_bits(), job: NO_JOB, frame: ptr::null_mut() })
    };
}

/// This thread's words. They have no destructor: valid as long as the thread.
#[inline(always)]
fn here() -> *mut Here {
    HERE.with(UnsafeCell::get)
}

/// Where this thread is now. May be called from a signal handler.
pub(crate) fn place() -> Place {
    // SAFETY: this thread's own words; nobody holds a reference to them.
    Place::from_bits(unsafe { (*here()).place })
}

/// The record of this thread's innermost guarded call, or NULL. May be called from a signal handler.
pub(crate) fn frame() -> *mut () {
    // SAFETY: as above.
    unsafe { (*here()).frame }
}

/// From here on the thread is there: nothing of the code around moves over this line.
pub(crate) fn set_place(place: Place) {
    compiler_fence(Ordering::SeqCst);
    // SAFETY: as above.
    unsafe { (*here()).place = place.to_bits() };
    compiler_fence(Ordering::SeqCst);
}

/// This thread's marker while a guarded call runs: where it is, and what it said before.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Entered {
    here: *mut Here,
    before: Here,
}

/// A guarded call begins: signals find its record from here on.
#[inline(always)]
pub(crate) fn enter(place: Place, frame: *mut ()) -> Entered {
    let here = here();
    // SAFETY: as above.
    let before = unsafe { *here };
    compiler_fence(Ordering::SeqCst);
    // SAFETY: as above.
    unsafe { (*here).frame = frame };
    compiler_fence(Ordering::SeqCst);
    // SAFETY: as above.
    unsafe { (*here).place = place.to_bits() };
    compiler_fence(Ordering::SeqCst);
    Entered { here, before }
}

/// The guarded call is over, however it ended: the marker says what it said before.
#[inline(always)]
pub(crate) fn restore(entered: Entered) {
    let Entered { here, before } = entered;
    compiler_fence(Ordering::SeqCst);
    // SAFETY: as above; a call comes back on the thread that it began on.
    unsafe { (*here).place = before.place };
    compiler_fence(Ordering::SeqCst);
    // SAFETY: as above.
    unsafe { *here = before };
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
    // SAFETY: as above.
    let worker = unsafe { (*here()).job };
    (worker != NO_JOB).then_some(worker)
}

/// Runs a job as `worker`.
pub(crate) fn in_job<R>(worker: u32, job: impl FnOnce() -> R) -> R {
    // SAFETY: as above.
    let before = std::mem::replace(unsafe { &mut (*here()).job }, worker);
    let result = job();
    // SAFETY: as above.
    unsafe { (*here()).job = before };
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_one_word() {
        for place in [Place::Host, Place::Plugin(7), Place::Service(1 << 40), Place::Ending(5)] {
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
