//! Buffers.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use ash::vk;
use gpu_allocator::{
    MemoryLocation,
    vulkan::{Allocation, AllocationCreateDesc, AllocationScheme},
};

use super::{
    barriers::State,
    context::{Gpu, Shared},
    error::{Call, GpuError, Result},
    garbage::{Garbage, free},
};

/// Where a resource lies and who reaches it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Memory {
    /// On the device, reached by it alone.
    Device,
    /// Written by the program, read by the device.
    Upload,
    /// Written by the device, read by the program.
    Readback,
}

/// What a buffer is to be.
#[derive(Clone, Copy, Debug)]
pub struct BufferDesc<'a> {
    /// For messages and debuggers.
    pub name: &'a str,
    /// In bytes, at least 1.
    pub size: u64,
    /// What it is used as. Buffers on the device can be copied to and from besides.
    pub usage: vk::BufferUsageFlags,
    /// Where it lies.
    pub memory: Memory,
}

/// What a texel of a buffer is: four words. Every device reads and writes texels of this format.
pub const TEXEL: vk::Format = vk::Format::R32G32B32A32_UINT;
/// Bytes of a texel.
pub const TEXEL_BYTES: u64 = 16;

/// A buffer. Dropped while frames are in flight, it lives until they have ended.
pub struct Buffer {
    raw: vk::Buffer,
    /// Of its texels; null where it is not used so.
    texels: vk::BufferView,
    size: u64,
    name: String,
    memory: Memory,
    allocation: Option<Allocation>,
    state: Mutex<State>,
    id: u64,
    shared: Arc<Shared>,
}

impl Buffer {
    /// Makes a buffer; its content is undefined.
    pub fn new(gpu: &Gpu, desc: &BufferDesc<'_>) -> Result<Buffer> {
        Self::with_shared(&gpu.shared, desc)
    }

    pub(crate) fn with_shared(shared: &Arc<Shared>, desc: &BufferDesc<'_>) -> Result<Buffer> {
        let size = desc.size.max(1);
        let copies = vk::BufferUsageFlags::TRANSFER_SRC | vk::BufferUsageFlags::TRANSFER_DST;
        let info = vk::BufferCreateInfo::default().size(size).usage(desc.usage | copies);
        // SAFETY: the device lives.
        let raw = unsafe { shared.device.create_buffer(&info, None) }.call("vkCreateBuffer")?;
        // SAFETY: `raw` was made just now.
        let requirements = unsafe { shared.device.get_buffer_memory_requirements(raw) };
        let location = match desc.memory {
            Memory::Device => MemoryLocation::GpuOnly,
            Memory::Upload => MemoryLocation::CpuToGpu,
            Memory::Readback => MemoryLocation::GpuToCpu,
        };
        let allocation = allocate(
            shared,
            &AllocationCreateDesc {
                name: desc.name,
                requirements,
                location,
                linear: true,
                allocation_scheme: AllocationScheme::GpuAllocatorManaged,
            },
        );
        let allocation = match allocation {
            Ok(allocation) => allocation,
            Err(error) => {
                // SAFETY: nothing uses it.
                unsafe { shared.device.destroy_buffer(raw, None) };
                return Err(error);
            }
        };
        // SAFETY: the memory was made for this buffer's requirements, and is bound once.
        let bound =
            unsafe { shared.device.bind_buffer_memory(raw, allocation.memory(), allocation.offset()) };
        if let Err(error) = bound.call("vkBindBufferMemory") {
            // SAFETY: nothing uses it.
            unsafe { shared.device.destroy_buffer(raw, None) };
            free(shared, allocation);
            return Err(error);
        }
        let texels = match view_of(shared, raw, desc, size) {
            Ok(texels) => texels,
            Err(error) => {
                // SAFETY: nothing uses it.
                unsafe { shared.device.destroy_buffer(raw, None) };
                free(shared, allocation);
                return Err(error);
            }
        };
        shared.name(raw, desc.name);
        Ok(Buffer {
            raw,
            texels,
            size,
            name: desc.name.to_owned(),
            memory: desc.memory,
            allocation: Some(allocation),
            state: Mutex::new(State::NEW),
            id: shared.register("buffer", desc.name),
            shared: shared.clone(),
        })
    }

    /// Vulkan's handle.
    pub fn raw(&self) -> vk::Buffer {
        self.raw
    }

    /// The view of all of its texels; null where its usage has none.
    pub(crate) fn texels(&self) -> vk::BufferView {
        self.texels
    }

    /// In bytes.
    pub fn size(&self) -> u64 {
        self.size
    }

    /// Its name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// A number that no other resource of the context has.
    pub fn id(&self) -> u64 {
        self.id
    }

    /// Writes into a buffer of [`Memory::Upload`]. What the device is reading must not be written: take the
    /// frame's upload ring for what changes every frame.
    pub fn write(&self, offset: u64, bytes: &[u8]) -> Result<()> {
        let refuse = |reason: String| GpuError::Resource { name: self.name.clone(), reason };
        if self.memory != Memory::Upload {
            return Err(refuse("the program cannot write it directly".to_owned()));
        }
        let end = offset.checked_add(bytes.len() as u64);
        if end.is_none_or(|end| end > self.size) {
            return Err(refuse(format!("{} bytes at {offset} do not fit into {}", bytes.len(), self.size)));
        }
        let pointer = self.allocation.as_ref().and_then(Allocation::mapped_ptr);
        let pointer = pointer.ok_or_else(|| refuse("its memory is not mapped".to_owned()))?;
        // SAFETY: the allocation is mapped and coherent, at least `size` bytes long, and `bytes` does not
        // overlap it: no reference into mapped memory of this kind is ever given out.
        unsafe {
            std::ptr::copy_nonoverlapping(
                bytes.as_ptr(),
                pointer.as_ptr().cast::<u8>().add(offset as usize),
                bytes.len(),
            );
        }
        Ok(())
    }

    /// Copies out of a buffer of [`Memory::Readback`]. The frame that wrote it must have ended.
    pub fn read(&self) -> Result<Vec<u8>> {
        let mapped = (self.memory == Memory::Readback)
            .then(|| self.allocation.as_ref().and_then(Allocation::mapped_slice))
            .flatten();
        let mapped = mapped.ok_or_else(|| GpuError::Resource {
            name: self.name.clone(),
            reason: "the program cannot read it directly".to_owned(),
        })?;
        let size = usize::try_from(self.size).unwrap_or(usize::MAX).min(mapped.len());
        Ok(mapped[..size].to_vec())
    }

    pub(crate) fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        let lives = self.shared.unregister(self.id);
        if let (true, Some(allocation)) = (lives, self.allocation.take()) {
            self.shared.discard(Garbage::Buffer(self.raw, self.texels, allocation));
        }
    }
}

/// A view of a buffer's texels, as many as are whole; null where it is not used so, or where the device sees
/// fewer texels at a time: then whoever binds them is refused.
fn view_of(shared: &Shared, raw: vk::Buffer, desc: &BufferDesc<'_>, size: u64) -> Result<vk::BufferView> {
    use vk::BufferUsageFlags as U;
    let count = size / TEXEL_BYTES;
    let most = u64::from(shared.info.limits.max_texel_buffer_elements);
    let used = desc.usage.intersects(U::UNIFORM_TEXEL_BUFFER | U::STORAGE_TEXEL_BUFFER);
    if !used || count == 0 || count > most {
        return Ok(vk::BufferView::null());
    }
    let info = vk::BufferViewCreateInfo::default().buffer(raw).format(TEXEL).range(count * TEXEL_BYTES);
    // SAFETY: the buffer was made for texels, is bound to memory, and has so many bytes.
    unsafe { shared.device.create_buffer_view(&info, None) }.call("vkCreateBufferView")
}

/// Takes memory from the allocator.
pub(crate) fn allocate(shared: &Shared, desc: &AllocationCreateDesc<'_>) -> Result<Allocation> {
    let allocator = shared.allocator()?;
    let mut allocator = allocator.lock().unwrap_or_else(PoisonError::into_inner);
    allocator.allocate(desc).map_err(|error| GpuError::Memory {
        name: desc.name.to_owned(),
        bytes: desc.requirements.size,
        reason: error.to_string(),
    })
}
