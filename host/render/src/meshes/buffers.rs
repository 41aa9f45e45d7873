//! What the mesh passes write, and the draws read.

use ash::vk;
use reef_gpu::{Buffer, BufferDesc, Cmd, Data, Gpu, Memory, Pipeline, Result, TEXEL_BYTES};

use super::records::{GpuInstance, GpuPart, MeshCounts, VERTEX_WORDS, command};

/// Indices of one picture at most.
pub(super) const MOST_INDICES: u64 = 24_000_000;

/// Bytes of a vertex.
const VERTEX: u64 = VERTEX_WORDS as u64 * 4;
/// Bytes of a moved joint, as `mesh_pose.comp` writes it.
const JOINT: u64 = 48;
/// Bytes of an instance's parts.
const PARTS: u64 = 2 * size_of::<GpuPart>() as u64;

/// How much of one picture the device can bind: shaders see the buffers as storage, and as texels. What is
/// more is left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Most {
    pub(crate) vertices: u64,
    pub(crate) instances: u64,
    pub(crate) joints: u64,
}

impl Most {
    /// Of a device with these limits.
    pub(super) fn of(limits: &vk::PhysicalDeviceLimits) -> Self {
        let bytes = u64::from(limits.max_storage_buffer_range);
        let texels = u64::from(limits.max_texel_buffer_elements);
        let of_texels = |size: u64| texels / (size / TEXEL_BYTES);
        let of_both = |size: u64| (bytes / size).min(of_texels(size));
        Self {
            vertices: of_both(VERTEX),
            instances: of_both(PARTS).min(of_texels(size_of::<GpuInstance>() as u64)),
            joints: of_texels(JOINT),
        }
    }
}

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
    /// Draws what the scan put into a bin.
    pub(super) fn draw_bin(&self, cmd: &mut Cmd<'_, '_>, pipeline: &Pipeline, bin: usize) -> Result<()> {
        cmd.pipeline(pipeline)?;
        cmd.vertices(0, &self.vertex)?;
        cmd.indices(&self.index, vk::IndexType::UINT32)?;
        let length = size_of::<vk::DrawIndexedIndirectCommand>() as u64;
        cmd.draw_indexed_indirect(Data::Part(&self.draw, command(bin), length), 1)
    }

    /// Whether there is room.
    pub(super) fn fit(&self, wanted: &Wanted) -> bool {
        let Wanted { instances, joints, vertices, indices } = self.room;
        instances >= wanted.instances
            && joints >= wanted.joints
            && vertices >= wanted.vertices
            && indices >= wanted.indices
    }

    /// Makes them, a little greater than asked for.
    pub(super) fn new(gpu: &Gpu, wanted: &Wanted, most: &Most) -> Result<Self> {
        let room = |wanted: u64, least: u64, most: u64| wanted.next_power_of_two().max(least).min(most);
        let instances = room(wanted.instances, 64, most.instances);
        let joints = room(wanted.joints, 64, most.joints);
        let vertices = room(wanted.vertices, 4096, most.vertices);
        let indices = room(wanted.indices, 4096, MOST_INDICES);
        let buffer = |name, size, usage| {
            let usage = usage | vk::BufferUsageFlags::STORAGE_BUFFER;
            Buffer::new(gpu, &BufferDesc { name, size, usage, memory: Memory::Device })
        };
        use vk::BufferUsageFlags as U;
        let texels = U::UNIFORM_TEXEL_BUFFER | U::STORAGE_TEXEL_BUFFER;
        Ok(Self {
            room: Wanted { instances, joints, vertices, indices },
            parts: buffer("mesh parts", instances * PARTS, texels)?,
            order: buffer("mesh order", 2 * instances * 4, U::empty())?,
            palette: buffer("mesh joints", joints * JOINT, texels)?,
            vertex: buffer("mesh vertices", vertices * VERTEX, texels | U::VERTEX_BUFFER)?,
            index: buffer("mesh indices", indices * 4, U::INDEX_BUFFER)?,
            draw: buffer("mesh draws", size_of::<MeshCounts>() as u64, U::INDIRECT_BUFFER)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_has_no_more_than_a_device_binds() {
        let limits = |max_storage_buffer_range, max_texel_buffer_elements| vk::PhysicalDeviceLimits {
            max_storage_buffer_range,
            max_texel_buffer_elements,
            ..vk::PhysicalDeviceLimits::default()
        };
        // The least that Vulkan promises; few bytes; more bytes than texels, as great devices have them.
        for (bytes, texels) in [(1 << 27, 1 << 16), (1 << 20, 1 << 27), (u32::MAX, 1 << 27)] {
            let most = Most::of(&limits(bytes, texels));
            let (bytes, texels) = (u64::from(bytes), u64::from(texels));
            let fits = |most: &Most| {
                let storage = [most.vertices * VERTEX, most.instances * PARTS];
                // Of an instance five texels are uploaded.
                storage.iter().all(|size| *size <= bytes)
                    && storage.iter().all(|size| size / TEXEL_BYTES <= texels)
                    && most.joints * 3 <= texels
                    && most.instances * 5 <= texels
            };
            assert!(fits(&most), "{most:?}");
            for more in [
                Most { vertices: most.vertices + 1, ..most },
                Most { instances: most.instances + 1, ..most },
                Most { joints: most.joints + 1, ..most },
            ] {
                assert!(!fits(&more), "{most:?}: there is room for {more:?}");
            }
        }
    }
}
