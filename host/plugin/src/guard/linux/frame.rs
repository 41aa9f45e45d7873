//! The record of a guarded call: where to go when it is left, and why it was.

use std::mem::ManuallyDrop;

use super::{super::fault::Cause, describe, stack};
use crate::{
    guard::{Fate, Fault, limits, limits::option},
    marker,
};

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
    /// The function of the C library that it called to end the program or its thread; else it was a signal.
    pub(super) ended: Option<&'static str>,
}

impl Seen {
    /// A call of a function that ends the program or the thread.
    #[cfg(all(target_env = "gnu", not(target_feature = "crt-static")))]
    pub(super) fn ended(function: &'static str) -> Self {
        Self { signal: 0, code: 0, address: 0, pc: 0, runaway: false, ended: Some(function) }
    }

    /// In words.
    pub(super) fn fault(self, fate: &Fate) -> Fault {
        let cause = if let Some(function) = self.ended {
            Cause::Ended(function)
        } else if self.runaway {
            Cause::Runaway { limit: limits().of(fate.watch()), option: option(fate.watch()) }
        } else if stack::overflowed(self.signal, self.address) {
            Cause::Signal(format!("SIGSEGV: its stack is full (address {:#x})", self.address))
        } else {
            Cause::Signal(describe::signal(self.signal, self.code, self.address))
        };
        Fault { cause, place: describe::place(self.pc), job: None }
    }
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
    pub(super) seen: Option<Seen>,
    /// Taken when the call was left; a call that returns has none, and nothing to drop.
    relayed: ManuallyDrop<Option<Box<Fault>>>,
}

impl Frame {
    #[inline(always)]
    pub(super) fn new(fate: &Fate) -> Self {
        Self { sp: 0, pc: 0, fate, seen: None, relayed: ManuallyDrop::new(None) }
    }

    /// The innermost guarded call of this thread, or NULL. May be called from a signal handler.
    pub(super) fn current() -> *mut Self {
        marker::frame().cast()
    }

    /// It will be left because of another thread's fault.
    pub(super) fn relay(&mut self, fault: Fault) {
        self.relayed = ManuallyDrop::new(Some(Box::new(fault)));
    }

    /// Why it was left.
    pub(super) fn fault(&mut self, fate: &Fate) -> Fault {
        if let Some(fault) = self.relayed.take() {
            return *fault;
        }
        match self.seen {
            Some(seen) => seen.fault(fate),
            None => Fault { cause: Cause::Signal("an unknown signal".into()), place: None, job: None },
        }
    }
}
