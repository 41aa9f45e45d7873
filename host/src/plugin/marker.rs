//! Where a thread is: in the host, in a plugin's code, or in a host service that a plugin called. Whose fault a crash is
//! follows from this, not from the program counter (which is in libc for a bad memcpy).

use std::cell::Cell;

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

thread_local! {
    static PLACE: Cell<Place> = const { Cell::new(Place::Host) };
    /// The worker index while a job of `parallel_for` runs on this thread.
    static JOB: Cell<Option<u32>> = const { Cell::new(None) };
}

/// Where this thread is now.
pub(crate) fn place() -> Place {
    PLACE.get()
}

/// Runs a plugin's code.
pub(crate) fn in_plugin<R>(generation: u64, call: impl FnOnce() -> R) -> R {
    let before = PLACE.replace(Place::Plugin(generation));
    let result = call();
    PLACE.set(before);
    result
}

/// Runs a service of the host for the plugin that called it.
pub(crate) fn in_service<R>(generation: u64, call: impl FnOnce() -> R) -> R {
    let before = PLACE.replace(Place::Service(generation));
    let result = call();
    PLACE.set(before);
    result
}

/// The worker whose job runs on this thread.
pub(crate) fn current_job() -> Option<u32> {
    JOB.get()
}

/// Runs a job as `worker`.
pub(crate) fn in_job<R>(worker: u32, job: impl FnOnce() -> R) -> R {
    let before = JOB.replace(Some(worker));
    let result = job();
    JOB.set(before);
    result
}
