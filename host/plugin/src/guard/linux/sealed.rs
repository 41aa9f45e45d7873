//! Bytes for the last words of a program whose memory a plugin has written over: in pages of their own, which
//! nobody can write to.

use std::{
    ptr::{self, NonNull},
    slice,
    sync::atomic::{AtomicBool, AtomicPtr, Ordering},
};

/// Parts that pages may have.
const PARTS: usize = 4;

/// What the pages begin with; the parts follow.
#[repr(C)]
pub(super) struct Head {
    /// Length of all pages [bytes].
    whole: usize,
    /// Where each part ends, from the pages' beginning [bytes].
    ends: [usize; PARTS],
}

/// Pages that can be read only. They stay until they are given back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Sealed(NonNull<Head>);

// SAFETY: memory that nobody writes; who gives it back vouches for all readers.
unsafe impl Send for Sealed {}

impl Sealed {
    /// Pages with these parts. None: the system has none to give.
    pub(super) fn new(parts: &[&[u8]]) -> Option<Self> {
        let mut ends = [size_of::<Head>(); PARTS];
        let mut end = size_of::<Head>();
        for (number, known) in ends.iter_mut().enumerate() {
            end += parts.get(number).map_or(0, |part| part.len());
            *known = end;
        }
        // SAFETY: fresh memory of our own, as long as what is copied there, before it becomes read-only.
        unsafe {
            let flags = libc::MAP_PRIVATE | libc::MAP_ANONYMOUS;
            let start = libc::mmap(ptr::null_mut(), end, libc::PROT_READ | libc::PROT_WRITE, flags, -1, 0);
            if start == libc::MAP_FAILED {
                return None;
            }
            start.cast::<Head>().write(Head { whole: end, ends });
            let mut at = start.cast::<u8>().add(size_of::<Head>());
            for part in parts.iter().take(PARTS) {
                ptr::copy_nonoverlapping(part.as_ptr(), at, part.len());
                at = at.add(part.len());
            }
            // Where the system refuses, they can be written, as all other memory can.
            libc::mprotect(start, end, libc::PROT_READ);
            NonNull::new(start.cast()).map(Self)
        }
    }

    /// Pages that were kept as an address.
    ///
    /// # Safety
    /// NULL, or what [`Sealed::as_ptr`] gave, of pages that are there.
    pub(super) unsafe fn from_ptr(pages: *mut Head) -> Option<Self> {
        NonNull::new(pages).map(Self)
    }

    /// Their address.
    pub(super) fn as_ptr(self) -> *mut Head {
        self.0.as_ptr()
    }

    /// A part; it is there until the pages are given back.
    pub(super) fn part(&self, number: usize) -> &[u8] {
        // SAFETY: written in `new`, with parts from end to end.
        unsafe {
            let ends = &(*self.0.as_ptr()).ends;
            let start = number.checked_sub(1).map_or(size_of::<Head>(), |before| ends[before]);
            slice::from_raw_parts(self.0.as_ptr().cast::<u8>().add(start), ends[number] - start)
        }
    }

    /// Gives the pages back.
    ///
    /// # Safety
    /// Nobody looks at them any more.
    unsafe fn give_back(self) {
        // SAFETY: mapped in `new` with this length; the caller's promise.
        unsafe { libc::munmap(self.0.as_ptr().cast(), (*self.0.as_ptr()).whole) };
    }
}

/// Pages that threads set and a signal handler looks at, or none.
pub(super) struct Shown {
    pages: AtomicPtr<Head>,
    seen: AtomicBool,
}

impl Shown {
    pub(super) const fn new() -> Self {
        Self { pages: AtomicPtr::new(ptr::null_mut()), seen: AtomicBool::new(false) }
    }

    /// Other pages in the place of those before, which are given back where no handler has looked.
    pub(super) fn replace(&self, pages: Option<Sealed>) {
        let before = self.pages.swap(pages.map_or(ptr::null_mut(), |it| it.0.as_ptr()), Ordering::SeqCst);
        if let Some(before) = NonNull::new(before).map(Sealed)
            && !self.seen.load(Ordering::SeqCst)
        {
            // SAFETY: they were taken out once, and a handler that looks says so first.
            unsafe { before.give_back() };
        }
    }

    /// The present ones. For a signal handler: a program whose handler has looked is about to end.
    pub(super) fn look(&self) -> Option<Sealed> {
        self.seen.store(true, Ordering::SeqCst);
        NonNull::new(self.pages.load(Ordering::SeqCst)).map(Sealed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_as_they_were_sealed_also_none_and_long_ones() {
        let long = vec![7; 100_000];
        let sealed = Sealed::new(&[b"ab", b"", &long]).expect("pages");
        assert_eq!([0, 1, 2, 3].map(|part| sealed.part(part)), [b"ab", &[][..], &long, &[][..]]);
    }

    #[test]
    fn nobody_writes_to_what_is_sealed() {
        let sealed = Sealed::new(&[b"text"]).expect("pages");
        let maps = std::fs::read_to_string("/proc/self/maps").expect("maps");
        let start = format!("{:x}-", sealed.0.as_ptr() as usize);
        let line = maps.lines().find(|line| line.trim_start_matches('0').starts_with(&start));
        assert!(line.is_some_and(|line| line.contains(" r--p ")), "{line:?}");
    }

    #[test]
    fn what_a_handler_saw_stays() {
        let shown = Shown::new();
        assert_eq!(Shown::new().look(), None);
        shown.replace(Sealed::new(&[b"first"]));
        shown.replace(Sealed::new(&[b"second"]));
        let seen = shown.look().expect("pages");
        shown.replace(None);
        assert_eq!(seen.part(0), b"second");
    }
}
