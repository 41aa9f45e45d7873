//! What the mesh passes write, and the draws read.

use ash::vk;
use reef_gpu::{Buffer, BufferDesc, Gpu, Memory, Result};

use super::records::{DrawCounts, GpuPart, VERTEX_WORDS};

/// Indices of one picture at most.
pub(super) const MOST_INDICES: u64 = 24_000_000;

/// How much a picture needs.
pub(super) struct Wanted {
    pub(super) instances: u64,
    pub(super) joints: u64,
    pub(super) vertices: u64,
    pub(super) indices: u64,
}

/// The buffers, with room for so much.
pub(super) struct Buffers {
    room: Wanted,
    pub(super) parts: Buffer,
    pub(super) order: Buffer,
    pub(super) palette: Buffer,
    pub(super) vertex: Buffer,
    pub(super) index: Buffer,
    pub(super) draw: Buffer,
}

impl Buffers {
    /// Whether there is room.
    pub(super) fn fit(&self, wanted: &Wanted) -> bool {
        let Wanted { instances, joints, vertices, indices } = self.room;
        instances >= wanted.instances
            && joints >= wanted.joints
            && vertices >= wanted.vertices
            && indices >= wanted.indices
    }

    /// Makes them, a little greater than asked for.
    pub(super) fn new(gpu: &Gpu, wanted: &Wanted, most_vertices: u64) -> Result<Self> {
        let instances = wanted.instances.next_power_of_two().max(64);
        let joints = wanted.joints.next_power_of_two().max(64);
        let vertices = wanted.vertices.next_power_of_two().clamp(4096.min(most_vertices), most_vertices);
        let indices = wanted.indices.next_power_of_two().clamp(4096, MOST_INDICES);
        let buffer = |name, size, usage| {
            let usage = usage | vk::BufferUsageFlags::STORAGE_BUFFER;
            Buffer::new(gpu, &BufferDesc { name, size, usage, memory: Memory::Device })
        };
        use vk::BufferUsageFlags as U;
        let texels = U::UNIFORM_TEXEL_BUFFER | U::STORAGE_TEXEL_BUFFER;
        Ok(Self {
            room: Wanted { instances, joints, vertices, indices },
            parts: buffer("mesh parts", 2 * instances * size_of::<GpuPart>() as u64, texels)?,
            order: buffer("mesh order", 2 * instances * 4, U::empty())?,
            palette: buffer("mesh joints", joints * 48, texels)?,
            vertex: buffer("mesh vertices", vertices * VERTEX_WORDS as u64 * 4, texels | U::VERTEX_BUFFER)?,
            index: buffer("mesh indices", indices * 4, U::INDEX_BUFFER)?,
            draw: buffer("mesh draws", size_of::<DrawCounts>() as u64, U::INDIRECT_BUFFER)?,
        })
    }
}
