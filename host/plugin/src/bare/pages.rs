//! Memory that a plugin may read during one call: written before it, not to be written by the plugin, and
//! gone afterwards.

use std::{ffi::c_void, io, ptr};

use reef_abi as abi;

use super::super::{
    input::StepInput,
    instance::{Instance, StepReport},
};

/// Pages of our own.
#[derive(Debug)]
pub struct Pages {
    start: *mut u8,
    size: usize,
    used: usize,
}

// SAFETY: plain memory that only this value hands out.
unsafe impl Send for Pages {}

impl Pages {
    /// Room for `bytes`.
    pub fn new(bytes: usize) -> io::Result<Self> {
        let size = bytes.max(1).next_multiple_of(1 << 16);
        // SAFETY: fresh memory, which is checked below.
        let start = unsafe {
            let flags = libc::MAP_PRIVATE | libc::MAP_ANONYMOUS;
            libc::mmap(ptr::null_mut(), size, libc::PROT_READ | libc::PROT_WRITE, flags, -1, 0)
        };
        if start == libc::MAP_FAILED {
            return Err(io::Error::last_os_error());
        }
        Ok(Self { start: start.cast(), size, used: 0 })
    }

    /// Copies values in; NULL for none, or where there is no room.
    pub fn place<T: Copy>(&mut self, values: &[T]) -> *const T {
        let at = self.used.next_multiple_of(align_of::<T>().max(8));
        let bytes = size_of_val(values);
        if bytes == 0 || at + bytes > self.size {
            return ptr::null();
        }
        self.used = at + bytes;
        // SAFETY: inside the pages, aligned (they begin at a page), and nobody else has this part.
        unsafe {
            let place = self.start.add(at).cast::<T>();
            ptr::copy_nonoverlapping(values.as_ptr(), place, values.len());
            place
        }
    }

    /// From now on they can be read only.
    pub fn read_only(&self) {
        self.protect(libc::PROT_READ);
    }

    /// From now on whoever touches them faults.
    pub fn take_away(&self) {
        self.protect(libc::PROT_NONE);
    }

    /// For the next use.
    fn give_back(&mut self) {
        self.protect(libc::PROT_READ | libc::PROT_WRITE);
        self.used = 0;
    }

    fn protect(&self, protection: i32) {
        // SAFETY: pages of our own, to which no reference is held across this call.
        unsafe { libc::mprotect(self.start.cast::<c_void>(), self.size, protection) };
    }
}

/// What a plugin may not do with its input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Withheld {
    /// Write to it.
    Writing,
    /// Look at it after the step.
    Afterwards,
}

impl Pages {
    /// A text, which is there until the pages are taken away.
    pub fn text(&mut self, text: &str) -> &str {
        let place = self.place(text.as_bytes());
        if place.is_null() {
            return "";
        }
        // SAFETY: a copy of the text, which nobody writes to as long as `self` is borrowed.
        unsafe { std::str::from_utf8_unchecked(std::slice::from_raw_parts(place, text.len())) }
    }
}

impl Drop for Pages {
    fn drop(&mut self) {
        // SAFETY: mapped in `new`, and nobody uses it any more.
        unsafe { libc::munmap(self.start.cast(), self.size) };
    }
}

impl Instance {
    /// Steps with an input that lies in `pages`, of which the plugin cannot do what is withheld.
    pub fn step_from(
        &mut self,
        pages: &mut Pages,
        input: &StepInput<'_>,
        events: &[abi::Event],
        withheld: Withheld,
    ) -> StepReport {
        pages.give_back();
        let camera = pages.place(&[*input.camera]);
        let water = pages.place(&[*input.water]);
        let flow = pages.place(input.flow);
        let waves = pages.place(input.waves);
        let actors = pages.place(input.actors);
        let obstacles = pages.place(input.obstacles);
        let placed_events = pages.place(events);
        let heightfield = match input.raw_heightfield() {
            None => ptr::null(),
            Some(field) => {
                let heights = pages.place(input.heightfield.map_or(&[][..], |field| field.heights));
                pages.place(&[abi::Heightfield { heights, ..field }])
            }
        };
        let raw = input.raw(None, events);
        let step = pages.place(&[abi::Step {
            camera,
            water,
            heightfield,
            flow,
            waves,
            actors,
            obstacles,
            events: placed_events,
            ..raw
        }]);
        let step = Placed(step);
        if withheld == Withheld::Writing {
            pages.read_only();
        }
        let report = self.step_with(input, events, move |call, ctx, _, output| {
            let Placed(input) = { step };
            // SAFETY: the instance's function on its control thread; the input lies in pages that live longer
            // than the call.
            unsafe { call(ctx, input, output) }
        });
        if withheld == Withheld::Afterwards {
            pages.take_away();
        }
        report
    }
}

/// An input in pages, on its way to the control thread.
struct Placed(*const abi::Step);

// SAFETY: the pages live, and stay as they are, until the call returned.
unsafe impl Send for Placed {}
