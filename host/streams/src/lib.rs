//! What one instance emitted in one step, owned by the host, and the [`check`] that it passes before anything
//! uses it. [`STREAMS`] is the table of streams that everything here follows. Beside it stands what sea and
//! renderer share: the [`frame`] that a step left behind, the [`environment`] that a scene fixes, and the ids
//! by which modules know one another's objects ([`identity`]).
//!
//! Compiled fast in every profile: it looks at every element of every step.

pub mod check;
pub mod environment;
pub mod frame;
mod glance;
pub mod identity;
pub mod meshes;
pub mod retained;
mod table;
pub mod textures;

use std::{collections::TryReserveError, ffi::c_void};

pub use table::{Outputs, STREAMS, Stream, Visit};

/// What memory holds that nobody has written yet, where a plugin must not rely on it.
pub const SOIL: u8 = 0x5a;

/// One stream's memory, whatever its element.
pub trait Lane {
    /// Bytes of an element.
    fn element_size(&self) -> usize;
    /// Makes room for `count` elements, and a fence behind it, until [`Lane::truncate`]. What is in the room
    /// is arbitrary.
    fn resize(&mut self, count: usize) -> Result<(), TryReserveError>;
    /// Where the elements are.
    fn start(&mut self) -> *mut c_void;
    /// Keeps the first `count`.
    fn truncate(&mut self, count: usize);
    /// Fills the elements with nonsense.
    fn soil(&mut self);
    /// Is the fence behind the room for `count` elements as it was?
    fn is_fenced(&self, count: usize) -> bool;
}

/// Bytes of the fence at least: who writes a few elements too many hits these, and no memory of others.
const FENCE: usize = 1024;
/// What stands in them.
const FENCE_BYTE: u8 = 0xc5;

impl<T: bytemuck::Pod> Lane for Vec<T> {
    fn element_size(&self) -> usize {
        size_of::<T>()
    }

    fn resize(&mut self, count: usize) -> Result<(), TryReserveError> {
        let length = count + FENCE.div_ceil(size_of::<T>());
        self.try_reserve(length.saturating_sub(self.len()))?;
        Vec::resize(self, length, T::zeroed());
        bytemuck::cast_slice_mut::<T, u8>(&mut self[count..]).fill(FENCE_BYTE);
        Ok(())
    }

    fn start(&mut self) -> *mut c_void {
        self.as_mut_ptr().cast()
    }

    fn truncate(&mut self, count: usize) {
        Vec::truncate(self, count);
    }

    fn soil(&mut self) {
        bytemuck::cast_slice_mut::<T, u8>(self).fill(SOIL);
    }

    fn is_fenced(&self, count: usize) -> bool {
        let fence = self.get(count..).unwrap_or_default();
        bytemuck::cast_slice::<T, u8>(fence).iter().all(|byte| *byte == FENCE_BYTE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_element_too_many_hits_the_fence_and_none_is_no_fault() {
        let mut objects: Vec<reef_abi::Object> = Vec::new();
        for count in [0, 1, 7, 3] {
            Lane::resize(&mut objects, count).unwrap();
            assert!(objects.is_fenced(count));
            objects[count].id = 1;
            assert!(!objects.is_fenced(count));
        }
        Lane::truncate(&mut objects, 2);
        assert!(objects.len() == 2 && objects.is_fenced(2));
    }
}
