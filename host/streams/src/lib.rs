//! What one instance emitted in one step, owned by the host, and the [`check`] that it passes before anything uses it.
//! [`STREAMS`] is the table of streams that everything here follows.
//! Beside it stands what sea and renderer share: the [`frame`] that a step left behind, the [`environment`] that a scene
//! fixes, and the ids by which modules know one another's objects ([`identity`]).
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

pub use table::{Outputs, Retained, STREAMS, Stream, Visit};

/// What memory holds that nobody has written yet, where a plugin must not rely on it.
pub const SOIL: u8 = 0x5a;

/// One stream's memory, whatever its element.
pub trait Lane {
    /// Bytes of an element.
    fn element_size(&self) -> usize;
    /// Makes room for `count` elements. Elements that were there keep their content; new ones are zero.
    fn resize(&mut self, count: usize) -> Result<(), TryReserveError>;
    /// Where the elements are.
    fn start(&mut self) -> *mut c_void;
    /// Keeps the first `count`.
    fn truncate(&mut self, count: usize);
    /// Fills the elements with nonsense.
    fn soil(&mut self);
}

impl<T: bytemuck::Pod> Lane for Vec<T> {
    fn element_size(&self) -> usize {
        size_of::<T>()
    }

    fn resize(&mut self, count: usize) -> Result<(), TryReserveError> {
        self.try_reserve(count.saturating_sub(self.len()))?;
        Vec::resize(self, count, T::zeroed());
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
}
