//! What a plugin's code can take from the guards: the signals' handlers, the thread's mask, the stack that
//! handlers run on. Looked at when a call is over, and put back.

use std::{
    fmt::Write,
    ptr,
    sync::atomic::{AtomicU32, Ordering},
};

use super::{
    describe,
    signals::{self, HANDLED},
    stack,
};
use crate::guard::{Fate, Part};

/// Bits behind those of the handlers.
const MASK: u32 = 1 << HANDLED.len();
const STACK: u32 = MASK << 1;

/// A set of what was taken: a bit a handler, in the order of [`HANDLED`], then `MASK` and `STACK`.
#[derive(Debug, Default)]
pub(crate) struct Taken(AtomicU32);

impl Taken {
    const fn nothing() -> Self {
        Self(AtomicU32::new(0))
    }

    fn add(&self, bits: u32) {
        if bits != 0 {
            self.0.fetch_or(bits, Ordering::Relaxed);
        }
    }
}

/// All that plugins took in this process.
static EVER: Taken = Taken::nothing();

/// What plugins took of this part of the guards so far, in words.
pub fn ever_taken(part: Part) -> Option<String> {
    let bits = match part {
        Part::Handlers => MASK - 1,
        Part::Thread => MASK | STACK,
    };
    words(EVER.0.load(Ordering::Relaxed) & bits)
}

/// A call is over: puts back what it took, on its thread and in the process. What is told for the first time,
/// in words.
pub(crate) fn put_back(fate: &Fate) -> Option<String> {
    let bits = handlers() | thread() | fate.taken.0.swap(0, Ordering::Relaxed);
    if bits == 0 {
        return None;
    }
    EVER.add(bits);
    words(bits & !fate.told.0.fetch_or(bits, Ordering::Relaxed))
}

/// A call is about to begin: what is not in place was taken by somebody else.
pub(crate) fn put_in_place() {
    handlers();
    thread();
}

/// Jobs are over: puts back what they took from this thread. The next call of the generation tells.
pub(crate) fn put_back_jobs(fate: &Fate) {
    fate.taken.add(thread());
}

/// Which handlers were not ours, and are again.
fn handlers() -> u32 {
    let taken = HANDLED.iter().enumerate().filter(|(_, signal)| !signals::is_ours(**signal));
    taken.fold(0, |bits, (at, signal)| {
        signals::put(*signal);
        bits | 1 << at
    })
}

/// What was not in place on this thread, and is again.
fn thread() -> u32 {
    let mut bits = 0;
    // SAFETY: the calling thread's mask, into a variable of ours; signals that exist.
    unsafe {
        let mut mask: libc::sigset_t = std::mem::zeroed();
        libc::pthread_sigmask(libc::SIG_BLOCK, ptr::null(), &mut mask);
        if HANDLED.iter().any(|signal| libc::sigismember(&mask, *signal) == 1) {
            libc::sigemptyset(&mut mask);
            for signal in HANDLED {
                libc::sigaddset(&mut mask, signal);
            }
            libc::pthread_sigmask(libc::SIG_UNBLOCK, &mask, ptr::null_mut());
            bits |= MASK;
        }
    }
    if !stack::handlers_stack_is_in_place() {
        bits |= STACK;
    }
    bits
}

fn words(bits: u32) -> Option<String> {
    if bits == 0 {
        return None;
    }
    let mut text = String::new();
    let mut add = |what: &str| {
        // Writing to a String cannot fail.
        let _ = write!(text, "{}{what}", if text.is_empty() { "" } else { ", and " });
    };
    for (at, signal) in HANDLED.iter().enumerate() {
        if bits & 1 << at != 0 {
            add(&format!("took the handler of {}", describe::name(*signal)));
        }
    }
    if bits & MASK != 0 {
        add("blocked signals of faults");
    }
    if bits & STACK != 0 {
        add("took the stack of the signals' handlers");
    }
    Some(text)
}
