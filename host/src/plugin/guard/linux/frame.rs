//! The record of a guarded call: where to go when it is left, and why it was.

use std::{
    ptr,
    sync::atomic::{AtomicPtr, Ordering, compiler_fence},
};

use super::{super::fault::Cause, describe, stack};
use crate::plugin::guard::{Fate, Fault, Watch, limits};

/// What the signal handler leaves.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    pub(super) signal: i32,
    pub(super) code: i32,
    pub(super) address: usize,
    /// Program counter.
    pub(super) pc: usize,
    /// The watchdog stopped it.
    pub(super) runaway: bool,
}

/// A guarded call, on its thread's stack.
#[repr(C)]
#[derive(Debug)]
pub(super) struct Frame {
    /// Stack pointer, written by `call::enter`, which knows its offset.
    pub(super) sp: usize,
    /// Where `call::enter` goes on when it is left, as above.
    pub(super) pc: usize,
    pub(super) fate: *const Fate,
    outer: *mut Frame,
    pub(super) seen: Option<Seen>,
    relayed: Option<Box<Fault>>,
}

thread_local! {
    /// The innermost guarded call of this thread.
    static CURRENT: AtomicPtr<Frame> = const { AtomicPtr::new(ptr::null_mut()) };
}

impl Frame {
    pub(super) fn new(fate: &Fate) -> Self {
        Self { sp: 0, pc: 0, fate, outer: ptr::null_mut(), seen: None, relayed: None }
    }

    /// From now on, signals on this thread find it.
    pub(super) fn enter(&mut self) -> *mut Self {
        let frame = ptr::from_mut(self);
        CURRENT.with(|current| {
            self.outer = current.load(Ordering::Relaxed);
            current.store(frame, Ordering::Relaxed);
        });
        compiler_fence(Ordering::SeqCst);
        frame
    }

    /// The outer one counts again.
    ///
    /// # Safety
    /// The frame was entered on this thread and lives.
    pub(super) unsafe fn exit(frame: *mut Self) {
        compiler_fence(Ordering::SeqCst);
        // SAFETY: the caller's promise.
        let outer = unsafe { (*frame).outer };
        CURRENT.with(|current| current.store(outer, Ordering::Relaxed));
    }

    /// The innermost guarded call of this thread, or NULL. May be called from a signal handler: the thread-local has neither
    /// an initialiser nor a destructor.
    pub(super) fn current() -> *mut Self {
        CURRENT.with(|current| current.load(Ordering::Relaxed))
    }

    /// It will be left because of another thread's fault.
    pub(super) fn relay(&mut self, fault: Fault) {
        self.relayed = Some(Box::new(fault));
    }

    /// Why it was left.
    pub(super) fn fault(&mut self, fate: &Fate) -> Fault {
        if let Some(fault) = self.relayed.take() {
            return *fault;
        }
        let Some(seen) = self.seen else {
            return Fault { cause: Cause::Signal("an unknown signal".into()), place: None, job: None };
        };
        let cause = if seen.runaway {
            let limits = limits();
            let limit = if fate.watch() == Watch::Step { limits.step } else { limits.other };
            Cause::Runaway { limit }
        } else if stack::overflowed(seen.signal, seen.address) {
            Cause::Signal(format!("SIGSEGV: its stack is full (address {:#x})", seen.address))
        } else {
            Cause::Signal(describe::signal(seen.signal, seen.code, seen.address))
        };
        Fault { cause, place: describe::place(seen.pc), job: None }
    }
}
