//! Counts memory allocations while somebody asks: a step should make none once it is warm.
//!
//! The program `reef` installs [`Counting`]. It sees what the host and plugins that are linked into the
//! program allocate; a library that was loaded brings an allocator of its own.

#![allow(
    unsafe_code,
    reason = "a global allocator is unsafe to implement; it hands everything to the system's"
)]

use std::{
    alloc::{GlobalAlloc, Layout, System},
    sync::atomic::{AtomicBool, AtomicU64, Ordering},
};

static ASKED: AtomicBool = AtomicBool::new(false);
static INSTALLED: AtomicBool = AtomicBool::new(false);
static COUNT: AtomicU64 = AtomicU64::new(0);

/// The system's allocator, with a counter that runs only during [`count`].
#[derive(Debug)]
pub struct Counting;

impl Counting {
    fn note() {
        if ASKED.load(Ordering::Relaxed) {
            COUNT.fetch_add(1, Ordering::Relaxed);
        }
    }
}

// SAFETY: every call goes to the system's allocator unchanged; counting allocates nothing.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        Self::note();
        // SAFETY: the caller's promise.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        Self::note();
        // SAFETY: the caller's promise.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        Self::note();
        // SAFETY: the caller's promise.
        unsafe { System.realloc(pointer, layout, size) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's promise.
        unsafe { System.dealloc(pointer, layout) }
    }
}

/// Allocations of all threads while `work` runs; None where the program did not install the counter.
pub fn count(work: impl FnOnce()) -> Option<u64> {
    if !installed() {
        return None;
    }
    let before = COUNT.load(Ordering::Relaxed);
    ASKED.store(true, Ordering::SeqCst);
    work();
    ASKED.store(false, Ordering::SeqCst);
    Some(COUNT.load(Ordering::Relaxed) - before)
}

/// Whether an allocation is seen: tried once.
fn installed() -> bool {
    if INSTALLED.load(Ordering::Relaxed) {
        return true;
    }
    let before = COUNT.load(Ordering::Relaxed);
    ASKED.store(true, Ordering::SeqCst);
    drop(std::hint::black_box(Box::new(before)));
    ASKED.store(false, Ordering::SeqCst);
    let seen = COUNT.load(Ordering::Relaxed) > before;
    INSTALLED.store(seen, Ordering::Relaxed);
    seen
}
