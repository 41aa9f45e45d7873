//! No guards on this machine: calls go straight through, and a fault of a plugin ends the program.

use std::sync::Arc;

use super::{Fate, Fault};
use crate::marker::{self, Place};

/// A thread that runs a generation's code.
#[derive(Debug)]
pub(crate) struct Thread;

/// A thread's preparation for guarded calls.
#[derive(Debug)]
pub(crate) struct Resident;

impl Resident {
    /// Prepares the calling thread.
    pub(crate) fn new(_: &Arc<Fate>) -> Self {
        Self
    }
}

/// Executable memory of a library.
#[derive(Debug)]
pub(crate) struct Text;

impl Text {
    /// Of the library that an address belongs to.
    pub(crate) fn of(_: usize) -> Option<Self> {
        None
    }

    /// Makes it executable again.
    pub(crate) fn allow(&self) {}
}

/// Runs a plugin's code.
pub(crate) fn guarded<R>(fate: &Fate, call: impl FnOnce() -> R) -> Result<R, Fault> {
    let before = marker::enter(Place::Plugin(fate.generation()), std::ptr::null_mut());
    let result = call();
    marker::restore(before);
    Ok(result)
}

/// Leaves the guarded call that runs on this thread. Without guards there are no faults to leave with.
pub(crate) fn leave(_: Fault) -> ! {
    std::process::abort()
}

/// Touches memory of a plugin.
pub(crate) fn probe_read(_: *const u8, _: usize) {}

/// Touches memory of a plugin.
pub(crate) fn probe_write(_: *mut u8, _: usize) {}

/// Room on the stack for a service.
pub(crate) fn require_stack() {}

pub(super) fn watch(_: &Arc<Fate>) {}

pub(super) fn wake_watchdog() {}

pub(super) fn end_without_destructors() {}
