//! What one instance emitted in one step, owned by the host, and the [`check`] that it passes before anything uses it.
//!
//! A package of its own because it is compiled fast in every profile: it looks at every element of every step.

pub mod check;
mod glance;
pub mod textures;

use std::{collections::TryReserveError, ffi::c_void, sync::Arc};

use reef_abi as abi;

use textures::TextureList;

/// The committed outputs of one instance in one step. Indices in the elements (object, material, first_node …) refer to
/// the vectors beside them and have been checked to lie inside them.
#[derive(Clone, Debug, Default)]
pub struct Outputs {
    /// Things in the sea: what all other elements belong to.
    pub objects: Vec<abi::Object>,
    /// Retained from the last step that committed it.
    pub materials: Arc<Vec<abi::Material>>,
    /// Node chains.
    pub fibres: Vec<abi::Fibre>,
    /// Nodes of all chains, relative to their object's origin.
    pub fibre_nodes: Vec<abi::FibreNode>,
    /// Sprites, relative to their object's origin, in no order that means anything.
    pub billboards: Vec<abi::Billboard>,
    /// What the instance had made with `texture_create` at the end of the step.
    pub textures: TextureList,
    /// What this instance does to the water.
    pub flows: Vec<abi::Flow>,
    /// What others may perceive.
    pub actors: Vec<abi::Actor>,
    /// Drawn as they are.
    pub debug_lines: Vec<abi::DebugLine>,
    /// Only when asked for.
    pub trace: Vec<abi::Trace>,
}

/// Most elements that one instance may emit in one step.
pub mod limit {
    /// Objects.
    pub const OBJECTS: u64 = 1 << 20;
    /// Materials.
    pub const MATERIALS: u64 = 1 << 12;
    /// Fibres.
    pub const FIBRES: u64 = 1 << 20;
    /// Nodes of all fibres.
    pub const FIBRE_NODES: u64 = 1 << 24;
    /// Sprites.
    pub const BILLBOARDS: u64 = 1 << 22;
    /// Flow primitives: everything in the sea pays for them.
    pub const FLOWS: u64 = 1 << 14;
    /// Actors.
    pub const ACTORS: u64 = 1 << 18;
    /// Debug lines.
    pub const DEBUG_LINES: u64 = 1 << 20;
    /// Trace points.
    pub const TRACES: u64 = 1 << 24;
}

/// Name of a stream, for messages.
pub fn stream_name(stream: u32) -> &'static str {
    match stream {
        abi::STREAM_OBJECT => "object",
        abi::STREAM_MATERIAL => "material",
        abi::STREAM_FIBRE => "fibre",
        abi::STREAM_FIBRE_NODE => "fibre node",
        abi::STREAM_SKINNED => "skinned",
        abi::STREAM_JOINT => "joint",
        abi::STREAM_POINT => "point",
        abi::STREAM_BILLBOARD => "billboard",
        abi::STREAM_MESH => "mesh",
        abi::STREAM_MESH_VERTEX => "mesh vertex",
        abi::STREAM_MESH_INDEX => "mesh index",
        abi::STREAM_FLOW => "flow",
        abi::STREAM_ACTOR => "actor",
        abi::STREAM_DEBUG_LINE => "debug line",
        abi::STREAM_TRACE => "trace",
        _ => "unknown",
    }
}

/// What memory holds that nobody has written yet, where a plugin must not rely on it.
pub const SOIL: u8 = 0x5a;

/// One stream's memory, whatever its element.
pub trait Lane {
    /// Bytes of an element.
    fn element_size(&self) -> usize;
    /// Makes room for `count` elements, and a fence behind it, until [`Lane::truncate`]. What is in the room is arbitrary.
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
        let mut objects: Vec<abi::Object> = Vec::new();
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
