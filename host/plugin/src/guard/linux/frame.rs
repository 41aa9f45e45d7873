//! The record of a guarded call: where to go when it is left, and why it was.

use std::mem::ManuallyDrop;

use super::{super::fault::Cause, describe, stack};
use crate::{
    guard::{Fate, Fault, Watch, limits, limits::option},
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
        let Some(seen) = self.seen else {
            return Fault { cause: Cause::Signal("an unknown signal".into()), place: None, job: None };
        };
        let cause = if seen.runaway {
            let limits = limits();
            let limit = if fate.watch() == Watch::Step { limits.step } else { limits.other };
            Cause::Runaway { limit, option: option() }
        } else if stack::overflowed(seen.signal, seen.address) {
            Cause::Signal(format!("SIGSEGV: its stack is full (address {:#x})", seen.address))
        } else {
            Cause::Signal(describe::signal(seen.signal, seen.code, seen.address))
        };
        Fault { cause, place: describe::place(seen.pc), job: None }
    }
}
