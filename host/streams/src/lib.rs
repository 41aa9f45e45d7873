//! What one instance emitted in one step, owned by the host, and the [`check`] that it passes before anything uses it.
//!
//! A package of its own because it is compiled fast in every profile: it looks at every element of every step.

pub mod check;
pub mod environment;
pub mod frame;
mod glance;
pub mod identity;
pub mod meshes;
pub mod retained;
pub mod textures;

use std::{collections::TryReserveError, ffi::c_void, sync::Arc};

use reef_abi as abi;

use meshes::MeshList;
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
    /// Meshes that joints move.
    pub skinned: Vec<abi::Skinned>,
    /// Joints of all of them, relative to their object's origin.
    pub joints: Vec<abi::Joint>,
    /// Meshes whose vertices are made anew.
    pub mesh_draws: Vec<abi::MeshDraw>,
    /// Vertices of all of them, relative to their object's origin.
    pub draw_vertices: Vec<abi::DrawVertex>,
    /// Sprites, relative to their object's origin, in no order that means anything.
    pub billboards: Vec<abi::Billboard>,
    /// What the instance had made with `texture_create` at the end of the step.
    pub textures: TextureList,
    /// What it had made with `mesh_create`.
    pub meshes: MeshList,
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
    /// Meshes that joints move.
    pub const SKINNED: u64 = 1 << 20;
    /// Joints of all of them.
    pub const JOINTS: u64 = 1 << 24;
    /// Meshes whose vertices are made anew.
    pub const MESH_DRAWS: u64 = 1 << 16;
    /// Vertices of all of them.
    pub const DRAW_VERTICES: u64 = 1 << 23;
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
        abi::STREAM_BILLBOARD => "billboard",
        abi::STREAM_MESH_DRAW => "mesh draw",
        abi::STREAM_DRAW_VERTEX => "draw vertex",
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
