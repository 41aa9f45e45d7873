//! What is brought to the device once, or fetched from it, while the program waits.

use ash::vk;
use bytemuck::AnyBitPattern;

use super::{
    barriers::State,
    buffer::{Buffer, BufferDesc, Memory},
    commands::{first_level, whole_picture},
    context::Gpu,
    error::{GpuError, Result},
    frames::run_once,
    image::Image,
};

impl Gpu {
    /// Makes a buffer on the device with this content.
    pub fn buffer_with<T: bytemuck::NoUninit>(
        &self,
        name: &str,
        usage: vk::BufferUsageFlags,
        content: &[T],
    ) -> Result<Buffer> {
        let bytes: &[u8] = bytemuck::cast_slice(content);
        let buffer =
            Buffer::new(self, &BufferDesc { name, size: bytes.len() as u64, usage, memory: Memory::Device })?;
        self.write_buffer(&buffer, 0, bytes)?;
        Ok(buffer)
    }

    /// Copies bytes into a buffer on the device, and waits.
    pub fn write_buffer(&self, buffer: &Buffer, offset: u64, bytes: &[u8]) -> Result<()> {
        if bytes.is_empty() {
            return Ok(());
        }
        let size = bytes.len() as u64;
        if offset.saturating_add(size) > buffer.size() {
            return Err(GpuError::Resource {
                name: buffer.name().to_owned(),
                reason: format!("{size} bytes at {offset} do not fit into {}", buffer.size()),
            });
        }
        let staging = self.staging(bytes)?;
        let region = vk::BufferCopy { src_offset: 0, dst_offset: offset, size };
        let device = &self.shared.device;
        run_once(&self.shared, |commands| {
            // SAFETY: the command buffer is being recorded; both buffers live until the function returns.
            unsafe { device.cmd_copy_buffer(commands, staging.raw(), buffer.raw(), &[region]) };
        })?;
        *buffer.state() = State::NEW;
        Ok(())
    }

    /// Fetches a buffer's content, and waits. It must have been made with [`Memory::Device`] or
    /// [`Memory::Readback`].
    pub fn read_buffer(&self, buffer: &Buffer) -> Result<Vec<u8>> {
        let size = buffer.size();
        let usage = vk::BufferUsageFlags::empty();
        let landing =
            Buffer::new(self, &BufferDesc { name: "read back", size, usage, memory: Memory::Readback })?;
        let device = &self.shared.device;
        run_once(&self.shared, |commands| {
            let region = vk::BufferCopy { src_offset: 0, dst_offset: 0, size };
            // SAFETY: the command buffer is being recorded; both buffers live until the function returns.
            unsafe { device.cmd_copy_buffer(commands, buffer.raw(), landing.raw(), &[region]) };
            host_barrier(device, commands);
        })?;
        *buffer.state() = State::NEW;
        landing.read()
    }

    /// The first records of a buffer, `most` of them where it has so many. Fetches and waits as
    /// [`Gpu::read_buffer`] does.
    pub fn read_records<T: AnyBitPattern>(&self, buffer: &Buffer, most: usize) -> Result<Vec<T>> {
        let bytes = self.read_buffer(buffer)?;
        Ok(bytes.chunks_exact(size_of::<T>()).take(most).map(bytemuck::pod_read_unaligned).collect())
    }

    /// Fills an image's first layer with pixels (rows packed, in the image's format), makes the smaller
    /// levels from it, and leaves it ready to be sampled. Needs TRANSFER_DST, and TRANSFER_SRC where there
    /// are several levels.
    pub fn write_image(&self, image: &Image, pixels: &[u8]) -> Result<()> {
        let (width, height) = image.size();
        if pixels.len() as u64 != u64::from(width) * u64::from(height) * pixel_bytes(image)? {
            return Err(GpuError::Resource {
                name: image.name().to_owned(),
                reason: format!("{} bytes are not {width}x{height} pixels", pixels.len()),
            });
        }
        let staging = self.staging(pixels)?;
        let device = &self.shared.device;
        let ready = vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL;
        run_once(&self.shared, |commands| {
            use vk::ImageLayout as L;
            move_levels(device, commands, image, 0..image.mips(), L::UNDEFINED, L::TRANSFER_DST_OPTIMAL);
            // SAFETY: the command buffer is being recorded; staging buffer and image live until the function
            // returns.
            unsafe {
                device.cmd_copy_buffer_to_image(
                    commands,
                    staging.raw(),
                    image.raw(),
                    L::TRANSFER_DST_OPTIMAL,
                    &[whole_picture(image)],
                );
            }
            for level in 1..image.mips() {
                let before = level - 1;
                move_levels(
                    device,
                    commands,
                    image,
                    before..level,
                    L::TRANSFER_DST_OPTIMAL,
                    L::TRANSFER_SRC_OPTIMAL,
                );
                let region = vk::ImageBlit {
                    src_subresource: vk::ImageSubresourceLayers { mip_level: before, ..first_level(image) },
                    src_offsets: level_area(image, before),
                    dst_subresource: vk::ImageSubresourceLayers { mip_level: level, ..first_level(image) },
                    dst_offsets: level_area(image, level),
                };
                // SAFETY: as above; the two levels are in these layouts.
                unsafe {
                    device.cmd_blit_image(
                        commands,
                        image.raw(),
                        L::TRANSFER_SRC_OPTIMAL,
                        image.raw(),
                        L::TRANSFER_DST_OPTIMAL,
                        &[region],
                        vk::Filter::LINEAR,
                    );
                }
            }
            let last = image.mips() - 1;
            if last > 0 {
                move_levels(device, commands, image, 0..last, L::TRANSFER_SRC_OPTIMAL, ready);
            }
            move_levels(device, commands, image, last..image.mips(), L::TRANSFER_DST_OPTIMAL, ready);
        })?;
        *image.state() = State::settled(ready);
        Ok(())
    }

    /// Fills all levels and layers of an image: the largest level's layers one after the other, then the next
    /// level's; rows packed, in the image's format. Leaves it ready to be sampled. Needs TRANSFER_DST.
    pub fn write_levels(&self, image: &Image, pixels: &[u8]) -> Result<()> {
        let (layers, texel) = (u64::from(image.layers()), pixel_bytes(image)?);
        let mut regions = Vec::new();
        let mut at = 0;
        for level in 0..image.mips() {
            let [_, end] = level_area(image, level);
            let (width, height) = (end.x.unsigned_abs(), end.y.unsigned_abs());
            regions.push(
                vk::BufferImageCopy::default()
                    .buffer_offset(at)
                    .image_subresource(vk::ImageSubresourceLayers {
                        mip_level: level,
                        layer_count: image.layers(),
                        ..first_level(image)
                    })
                    .image_extent(vk::Extent3D { width, height, depth: 1 }),
            );
            at += u64::from(width) * u64::from(height) * layers * texel;
        }
        if pixels.len() as u64 != at {
            return Err(GpuError::Resource {
                name: image.name().to_owned(),
                reason: format!("{} bytes are not the {at} of its levels and layers", pixels.len()),
            });
        }
        let staging = self.staging(pixels)?;
        let device = &self.shared.device;
        let ready = vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL;
        run_once(&self.shared, |commands| {
            use vk::ImageLayout as L;
            let all = 0..image.mips();
            move_levels(device, commands, image, all.clone(), L::UNDEFINED, L::TRANSFER_DST_OPTIMAL);
            // SAFETY: the command buffer is being recorded; staging buffer and image live until the function
            // returns.
            unsafe {
                device.cmd_copy_buffer_to_image(
                    commands,
                    staging.raw(),
                    image.raw(),
                    L::TRANSFER_DST_OPTIMAL,
                    &regions,
                );
            }
            move_levels(device, commands, image, all, L::TRANSFER_DST_OPTIMAL, ready);
        })?;
        *image.state() = State::settled(ready);
        Ok(())
    }

    fn staging(&self, bytes: &[u8]) -> Result<Buffer> {
        let usage = vk::BufferUsageFlags::TRANSFER_SRC;
        let staging = Buffer::new(
            self,
            &BufferDesc { name: "staging", size: bytes.len() as u64, usage, memory: Memory::Upload },
        )?;
        staging.write(0, bytes)?;
        Ok(staging)
    }
}

/// Bytes of a pixel of the formats that are read and written from the program.
pub(crate) fn pixel_bytes(image: &Image) -> Result<u64> {
    use vk::Format as F;
    match image.format() {
        F::R8_UNORM => Ok(1),
        F::R8G8_UNORM | F::R16_SFLOAT | F::D16_UNORM => Ok(2),
        F::R8G8B8A8_UNORM | F::R8G8B8A8_SRGB | F::B8G8R8A8_UNORM | F::B8G8R8A8_SRGB => Ok(4),
        F::R32_SFLOAT | F::R32_UINT | F::D32_SFLOAT | F::A2B10G10R10_UNORM_PACK32 => Ok(4),
        F::R16G16B16A16_SFLOAT | F::R32G32_SFLOAT => Ok(8),
        F::R32G32B32A32_SFLOAT => Ok(16),
        format => Err(GpuError::Resource {
            name: image.name().to_owned(),
            reason: format!("the program neither reads nor writes {format:?}"),
        }),
    }
}

/// Makes what was copied visible to the program.
pub(crate) fn host_barrier(device: &ash::Device, commands: vk::CommandBuffer) {
    let barriers = [vk::MemoryBarrier2::default()
        .src_stage_mask(vk::PipelineStageFlags2::ALL_TRANSFER)
        .src_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
        .dst_stage_mask(vk::PipelineStageFlags2::HOST)
        .dst_access_mask(vk::AccessFlags2::HOST_READ)];
    let info = vk::DependencyInfo::default().memory_barriers(&barriers);
    // SAFETY: the command buffer is being recorded.
    unsafe { device.cmd_pipeline_barrier2(commands, &info) };
}

/// Changes the layout of some levels between two transfers.
fn move_levels(
    device: &ash::Device,
    commands: vk::CommandBuffer,
    image: &Image,
    levels: std::ops::Range<u32>,
    old: vk::ImageLayout,
    new: vk::ImageLayout,
) {
    let stages = vk::PipelineStageFlags2::ALL_TRANSFER;
    let barriers = [vk::ImageMemoryBarrier2::default()
        .src_stage_mask(stages)
        .src_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
        .dst_stage_mask(stages)
        .dst_access_mask(vk::AccessFlags2::TRANSFER_READ | vk::AccessFlags2::TRANSFER_WRITE)
        .old_layout(old)
        .new_layout(new)
        .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .image(image.raw())
        .subresource_range(vk::ImageSubresourceRange {
            base_mip_level: levels.start,
            level_count: levels.end - levels.start,
            ..image.range()
        })];
    let info = vk::DependencyInfo::default().image_memory_barriers(&barriers);
    // SAFETY: the command buffer is being recorded.
    unsafe { device.cmd_pipeline_barrier2(commands, &info) };
}

fn level_area(image: &Image, level: u32) -> [vk::Offset3D; 2] {
    let (width, height) = image.size();
    let half = |size: u32| (size >> level).max(1) as i32;
    [vk::Offset3D::default(), vk::Offset3D { x: half(width), y: half(height), z: 1 }]
}
