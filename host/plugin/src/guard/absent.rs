//! No guards on this machine: calls go straight through, and a fault of a plugin ends the program.

use std::{sync::Arc, thread::JoinHandle};

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

/// Nobody says last words here.
#[derive(Debug)]
pub struct Noted(());

impl Noted {
    /// Notes nothing.
    pub fn new(_: String) -> Self {
        Self(())
    }
}

/// Nobody writes a last state here.
pub const KEEPS_STATES: bool = false;

/// See [`KEEPS_STATES`].
pub fn keep_state(_: &std::path::Path, _: &str, _: &[u8]) {}

/// Nothing was kept.
pub fn forget_state() {}

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

/// What a thread's end was at fault with.
#[derive(Debug, Default)]
pub(crate) struct Stranded;

/// What a plugin's code took from the guards.
#[derive(Debug, Default)]
pub(crate) struct Taken;

/// What plugins took from the guards so far.
#[cfg(target_os = "linux")]
pub(crate) fn ever_taken(_: super::Part) -> Option<String> {
    None
}

/// A call is over.
pub(crate) fn put_back(_: &Fate) -> Option<String> {
    None
}

/// A call begins.
pub(crate) fn put_in_place() {}

/// Jobs are over.
pub(crate) fn put_back_jobs(_: &Fate) {}

/// Waits until these threads are over.
pub(crate) fn join(_: &Arc<Fate>, threads: Vec<JoinHandle<()>>) -> Result<(), Fault> {
    for thread in threads {
        // A thread that panicked has nobody left to tell.
        let _ = thread.join();
    }
    Ok(())
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

/// Whom a generation called last.
#[derive(Debug, Default)]
pub(crate) struct Called;

impl Called {
    /// The code of this plugin is about to run.
    pub(crate) fn enters(&self, _: &str) {}
}

/// A service was called with a context that is none.
pub(crate) fn leave_foreign(_: &'static str) {}

/// Touches memory of a plugin.
pub(crate) fn probe_read(_: *const u8, _: usize) {}

/// Touches memory of a plugin.
pub(crate) fn probe_write(_: *mut u8, _: usize) {}

/// Room on the stack for a service.
pub(crate) fn require_stack() {}

pub(super) fn watch(_: &Arc<Fate>) {}

pub(super) fn wake_watchdog() {}

pub(super) fn end_without_destructors() {}
