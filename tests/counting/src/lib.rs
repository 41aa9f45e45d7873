//! The system's allocator with a counter, for tests that a step allocates nothing once it is warm:
//!
//! ```text
//! #[global_allocator]
//! static ALLOCATOR: reef_counting::Counting = reef_counting::Counting;
//! ```
//!
//! Such a test is a program of its own. A program without it counts nothing, so a test begins by seeing one
//! allocation.

use std::{
    alloc::{GlobalAlloc, Layout, System},
    cell::Cell,
    sync::atomic::{AtomicU64, Ordering},
};

thread_local! {
    static OF_THREAD: Cell<u64> = const { Cell::new(0) };
}
static OF_ALL: AtomicU64 = AtomicU64::new(0);

/// Allocations of this thread so far, those that make what is there larger among them.
pub fn of_this_thread() -> u64 {
    OF_THREAD.get()
}

/// Allocations of all threads so far.
pub fn of_all_threads() -> u64 {
    OF_ALL.load(Ordering::Relaxed)
}

/// The allocator.
#[derive(Debug)]
pub struct Counting;

impl Counting {
    fn note() {
        OF_THREAD.set(OF_THREAD.get() + 1);
        OF_ALL.fetch_add(1, Ordering::Relaxed);
    }
}

// SAFETY: passes everything on to the system's allocator; counting allocates nothing.
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
