//! Numbers that plugins read and nobody writes any more: in pages of their own, which the processor lets
//! nobody write to.

use std::ops::Deref;

/// Numbers in pages that can be read only, where the system has such pages.
#[derive(Debug)]
pub struct Frozen {
    numbers: Numbers,
}

#[cfg(unix)]
type Numbers = pages::Numbers;
#[cfg(not(unix))]
type Numbers = Vec<f32>;

impl Frozen {
    /// A copy of these.
    pub fn new(numbers: &[f32]) -> Self {
        #[cfg(unix)]
        let numbers = pages::Numbers::new(numbers);
        #[cfg(not(unix))]
        let numbers = numbers.to_vec();
        Self { numbers }
    }
}

impl Deref for Frozen {
    type Target = [f32];

    fn deref(&self) -> &[f32] {
        &self.numbers
    }
}

#[cfg(unix)]
mod pages {
    use std::{ffi::c_void, ops::Deref, ptr, slice};

    /// Numbers in pages of their own; where the system has none to give, in memory like any other.
    #[derive(Debug)]
    pub(super) enum Numbers {
        Pages { start: *mut c_void, count: usize },
        Plain(Vec<f32>),
    }

    // SAFETY: memory that only this value refers to and that nobody writes.
    unsafe impl Send for Numbers {}
    // SAFETY: as above.
    unsafe impl Sync for Numbers {}

    impl Numbers {
        pub(super) fn new(numbers: &[f32]) -> Self {
            let bytes = size_of_val(numbers);
            if bytes == 0 {
                return Self::Plain(Vec::new());
            }
            // SAFETY: fresh memory of our own, as large as what is copied there, before it becomes read-only.
            unsafe {
                let flags = libc::MAP_PRIVATE | libc::MAP_ANONYMOUS;
                let start =
                    libc::mmap(ptr::null_mut(), bytes, libc::PROT_READ | libc::PROT_WRITE, flags, -1, 0);
                if start == libc::MAP_FAILED {
                    return Self::Plain(numbers.to_vec());
                }
                ptr::copy_nonoverlapping(numbers.as_ptr(), start.cast::<f32>(), numbers.len());
                // Where the system refuses, the numbers can be written, as they could before.
                libc::mprotect(start, bytes, libc::PROT_READ);
                Self::Pages { start, count: numbers.len() }
            }
        }
    }

    impl Deref for Numbers {
        type Target = [f32];

        fn deref(&self) -> &[f32] {
            match self {
                // SAFETY: that many numbers were copied there; pages are aligned for them.
                Self::Pages { start, count } => unsafe { slice::from_raw_parts(start.cast(), *count) },
                Self::Plain(numbers) => numbers,
            }
        }
    }

    impl Drop for Numbers {
        fn drop(&mut self) {
            if let Self::Pages { start, count } = self {
                // SAFETY: mapped in `new` with this size; nobody refers to it any more.
                unsafe { libc::munmap(*start, *count * size_of::<f32>()) };
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_kept_as_they_are_also_none_and_many() {
        for count in [0, 1, 3, 5000] {
            let numbers: Vec<f32> = (0..count).map(|number| number as f32).collect();
            assert_eq!(*Frozen::new(&numbers), *numbers);
        }
    }
}
