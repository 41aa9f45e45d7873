//! The ends of a generation's threads, where destructors of its library's thread-locals run: no guarded call
//! is there that a fault could be led back to, so a thread whose end is at fault stays where it is, for ever,
//! and says why.

use std::{
    cell::UnsafeCell,
    os::unix::thread::JoinHandleExt,
    ptr,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread::JoinHandle,
    time::{Duration, SystemTime, UNIX_EPOCH},
};

use super::frame::Seen;
use crate::{
    guard::{Fate, Fault, Watch},
    marker::{self, Place},
};

/// How long a thread's end is waited for until the next look at whether one is at fault.
const PAUSE: Duration = Duration::from_millis(2);

unsafe extern "C" {
    fn pthread_timedjoin_np(
        thread: libc::pthread_t,
        value: *mut *mut libc::c_void,
        until: *const libc::timespec,
    ) -> i32;
}

/// What the first thread did whose end was at fault.
#[derive(Debug, Default)]
pub(crate) struct Stranded {
    claimed: AtomicBool,
    written: AtomicBool,
    seen: UnsafeCell<Option<Seen>>,
}

// SAFETY: `seen` is written by the one thread that claimed it, and read after `written` says so.
unsafe impl Sync for Stranded {}

impl Stranded {
    /// May be called from a signal handler.
    fn note(&self, seen: Seen) {
        if !self.claimed.swap(true, Ordering::AcqRel) {
            // SAFETY: claimed: nobody else writes, and nobody reads yet.
            unsafe { *self.seen.get() = Some(seen) };
            self.written.store(true, Ordering::Release);
        }
    }

    fn seen(&self) -> Option<Seen> {
        // SAFETY: written, and never again.
        self.written.load(Ordering::Acquire).then(|| unsafe { *self.seen.get() }).flatten()
    }
}

/// From here on, what this thread does is its end: its thread-locals' destructors. `fate` lives until the
/// thread is joined.
pub(super) fn begin(fate: &Fate) {
    marker::enter(Place::Ending(fate.generation()), ptr::from_ref(fate).cast_mut().cast());
}

/// Notes what the end of this thread was at fault with, and stays here for ever. May be called from a signal
/// handler.
///
/// # Safety
/// The fate that [`begin`] got, which lives.
pub(super) unsafe fn strand(fate: *const Fate, seen: Seen) -> ! {
    // SAFETY: the caller's promise.
    unsafe { (*fate).stranded.note(seen) };
    loop {
        // SAFETY: waits for a signal, and then for the next.
        unsafe { libc::pause() };
    }
}

/// Joins a thread, where it ends within [`PAUSE`].
fn joins_soon(thread: libc::pthread_t) -> bool {
    let until = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default() + PAUSE;
    let until = libc::timespec {
        tv_sec: until.as_secs() as libc::time_t,
        tv_nsec: libc::c_long::from(until.subsec_nanos().cast_signed()),
    };
    // SAFETY: a thread that nobody else joins, and that is not joined again once this says that it was.
    unsafe { pthread_timedjoin_np(thread, ptr::null_mut(), &until) != libc::ETIMEDOUT }
}

/// Waits until these threads of the generation are over. On a fault at the end of one of them, it and those
/// that are not over are left to themselves.
pub(crate) fn join(fate: &Arc<Fate>, threads: Vec<JoinHandle<()>>) -> Result<(), Fault> {
    if threads.is_empty() {
        return Ok(());
    }
    let mut threads: Vec<_> = threads.into_iter().map(JoinHandleExt::into_pthread_t).collect();
    let joined = fate.watched(Watch::End, || {
        while let Some(thread) = threads.last() {
            if joins_soon(*thread) {
                threads.pop();
            } else if let Some(seen) = fate.stranded.seen() {
                return Err(seen.fault(fate));
            }
        }
        Ok(())
    });
    match &joined {
        Ok(()) => fate.threads().clear(),
        // Threads that go on for ever use it.
        Err(_) => std::mem::forget(fate.clone()),
    }
    joined
}
