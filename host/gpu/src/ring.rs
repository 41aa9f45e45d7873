//! The upload ring of a frame: memory that the program writes and the device reads, taken anew every frame.

use std::sync::Arc;

use ash::vk;

use super::{
    buffer::{Buffer, BufferDesc, Memory, TEXEL_BYTES},
    context::Shared,
    error::{GpuError, Result},
};

/// First size of a frame's ring in bytes; it grows to what a frame needs.
const FIRST_BYTES: u64 = 1 << 20;

/// A piece of the ring, valid until the frame has ended. It can be bound as any kind of buffer.
#[derive(Clone, Copy, Debug)]
pub struct Upload {
    pub(crate) buffer: vk::Buffer,
    /// Of all texels of the buffer.
    pub(crate) texels: vk::BufferView,
    /// In bytes, from the buffer's beginning.
    pub offset: u64,
    /// In bytes.
    pub size: u64,
}

impl Upload {
    /// Its first texel: shaders see all texels of the ring's buffer.
    pub fn first_texel(&self) -> u32 {
        (self.offset / TEXEL_BYTES) as u32
    }
}

/// One frame's memory: chunks, of which those before the one that is being filled are full.
pub(crate) struct Ring {
    shared: Arc<Shared>,
    chunks: Vec<Buffer>,
    /// The chunk that is being filled.
    at: usize,
    /// Bytes of it that are.
    used: u64,
    /// Texels that the device sees at a time.
    most_texels: u32,
}

impl Ring {
    pub(crate) fn new(shared: &Arc<Shared>) -> Ring {
        Self::with_texels(shared, shared.info.limits.max_texel_buffer_elements)
    }

    /// Of a device that sees so many texels at a time.
    pub(crate) fn with_texels(shared: &Arc<Shared>, most_texels: u32) -> Ring {
        Ring { shared: shared.clone(), chunks: Vec::new(), at: 0, used: 0, most_texels }
    }

    /// The frame that used it has ended: everything is free again. After a frame that needed several chunks
    /// there is one that holds all, where the device sees so many texels; else they are filled anew.
    pub(crate) fn reset(&mut self) -> Result<()> {
        let total: u64 = self.chunks.iter().map(Buffer::size).sum();
        let whole = self.size(total, 0);
        if self.chunks.len() > 1 && whole >= total {
            self.chunks.clear();
            self.grow(whole)?;
        }
        (self.at, self.used) = (0, 0);
        Ok(())
    }

    /// Copies bytes to where the device reads them.
    pub(crate) fn push(&mut self, bytes: &[u8]) -> Result<Upload> {
        // A descriptor of no bytes is not allowed.
        let size = (bytes.len() as u64).max(4);
        let limits = &self.shared.info.limits;
        let alignment = limits
            .min_storage_buffer_offset_alignment
            .max(limits.min_uniform_buffer_offset_alignment)
            .max(limits.optimal_buffer_copy_offset_alignment)
            .max(16);
        let mut offset = self.used.next_multiple_of(alignment);
        while self.chunks.get(self.at).is_some_and(|chunk| size > chunk.size().saturating_sub(offset)) {
            (self.at, offset) = (self.at + 1, 0);
        }
        if self.at >= self.chunks.len() {
            let last = self.chunks.last().map_or(0, Buffer::size);
            self.grow(self.size(last.saturating_mul(2), size))?;
            offset = 0;
        }
        let chunk = self.chunks.get(self.at).ok_or_else(|| GpuError::Resource {
            name: "upload ring".to_owned(),
            reason: "it has no chunk".to_owned(),
        })?;
        chunk.write(offset, bytes)?;
        self.used = offset + size;
        Ok(Upload { buffer: chunk.raw(), texels: chunk.texels(), offset, size })
    }

    fn size(&self, wanted: u64, needed: u64) -> u64 {
        chunk_size(wanted, needed, self.most_texels)
    }

    fn grow(&mut self, size: u64) -> Result<()> {
        use vk::BufferUsageFlags as U;
        let usage = U::STORAGE_BUFFER
            | U::UNIFORM_BUFFER
            | U::UNIFORM_TEXEL_BUFFER
            | U::VERTEX_BUFFER
            | U::INDEX_BUFFER
            | U::INDIRECT_BUFFER
            | U::TRANSFER_SRC;
        let desc = BufferDesc { name: "upload ring", size, usage, memory: Memory::Upload };
        self.chunks.push(Buffer::with_shared(&self.shared, &desc)?);
        (self.at, self.used) = (self.chunks.len() - 1, 0);
        Ok(())
    }
}

/// Bytes of a chunk: about as many as are `wanted`, but no more texels than the device sees at a time, unless
/// what it is `needed` for is greater.
fn chunk_size(wanted: u64, needed: u64, most_texels: u32) -> u64 {
    let most = u64::from(most_texels) * TEXEL_BYTES;
    wanted.max(needed.next_power_of_two()).max(FIRST_BYTES).min(most).max(needed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chunk_is_seen_whole_unless_what_it_holds_is_too_great() {
        assert_eq!(chunk_size(0, 4, 1 << 27), FIRST_BYTES);
        assert_eq!(chunk_size(1 << 21, (1 << 21) + 4, 1 << 27), 1 << 22);
        // The least that Vulkan promises: a megabyte.
        assert_eq!(chunk_size(1 << 24, 1000, 1 << 16), 1 << 20);
        assert_eq!(chunk_size(0, (1 << 20) + 16, 1 << 16), (1 << 20) + 16);
    }
}
