//! Images: attachments, textures, storage images, and those of a swapchain.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use ash::vk;
use gpu_allocator::{
    MemoryLocation,
    vulkan::{Allocation, AllocationCreateDesc, AllocationScheme},
};

use super::{
    barriers::State,
    buffer::allocate,
    context::{Gpu, Shared},
    error::{Call, GpuError, Result},
    garbage::{Garbage, free},
};

/// What an image is to be.
#[derive(Clone, Copy, Debug)]
pub struct ImageDesc<'a> {
    /// For messages and debuggers.
    pub name: &'a str,
    /// In pixels, at least 1.
    pub width: u32,
    /// In pixels, at least 1.
    pub height: u32,
    /// Layers of an array; 1: a plain image.
    pub layers: u32,
    /// Levels of the pyramid of halved pictures; 1: only the picture.
    pub mips: u32,
    /// Format of a pixel.
    pub format: vk::Format,
    /// Samples a pixel.
    pub samples: vk::SampleCountFlags,
    /// What it is used as.
    pub usage: vk::ImageUsageFlags,
}

impl<'a> ImageDesc<'a> {
    /// A plain picture: one layer, one level, one sample.
    pub fn new(name: &'a str, size: (u32, u32), format: vk::Format, usage: vk::ImageUsageFlags) -> Self {
        let samples = vk::SampleCountFlags::TYPE_1;
        Self { name, width: size.0, height: size.1, layers: 1, mips: 1, format, samples, usage }
    }
}

/// An image with one view of all of it. Dropped while frames are in flight, it lives until they have ended.
pub struct Image {
    raw: vk::Image,
    view: vk::ImageView,
    name: String,
    size: (u32, u32),
    layers: u32,
    mips: u32,
    format: vk::Format,
    samples: vk::SampleCountFlags,
    /// None: the window system owns the image, and its swapchain the view.
    allocation: Option<Allocation>,
    state: Mutex<State>,
    id: u64,
    shared: Arc<Shared>,
}

impl Image {
    /// Makes an image; its content is undefined.
    pub fn new(gpu: &Gpu, desc: &ImageDesc<'_>) -> Result<Image> {
        let shared = &gpu.shared;
        let limit = shared.info.limits.max_image_dimension2_d;
        if desc.width == 0 || desc.height == 0 || desc.width > limit || desc.height > limit {
            return Err(GpuError::Resource {
                name: desc.name.to_owned(),
                reason: format!(
                    "{}x{} pixels: this device allows 1x1 to {limit}x{limit}",
                    desc.width, desc.height
                ),
            });
        }
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(desc.format)
            .extent(vk::Extent3D { width: desc.width, height: desc.height, depth: 1 })
            .mip_levels(desc.mips.max(1))
            .array_layers(desc.layers.max(1))
            .samples(desc.samples)
            .tiling(vk::ImageTiling::OPTIMAL)
            .usage(desc.usage)
            .initial_layout(vk::ImageLayout::UNDEFINED);
        // SAFETY: the device lives.
        let raw = unsafe { shared.device.create_image(&info, None) }.call("vkCreateImage")?;
        let allocation = Self::bind(shared, raw, desc.name);
        let allocation = match allocation {
            Ok(allocation) => allocation,
            Err(error) => {
                // SAFETY: nothing uses it.
                unsafe { shared.device.destroy_image(raw, None) };
                return Err(error);
            }
        };
        let view = view_of(shared, raw, desc.format, desc.layers.max(1), desc.mips.max(1));
        let view = match view {
            Ok(view) => view,
            Err(error) => {
                // SAFETY: nothing uses it.
                unsafe { shared.device.destroy_image(raw, None) };
                free(shared, allocation);
                return Err(error);
            }
        };
        shared.name(raw, desc.name);
        shared.name(view, desc.name);
        Ok(Image {
            raw,
            view,
            name: desc.name.to_owned(),
            size: (desc.width, desc.height),
            layers: desc.layers.max(1),
            mips: desc.mips.max(1),
            format: desc.format,
            samples: desc.samples,
            allocation: Some(allocation),
            state: Mutex::new(State::NEW),
            id: shared.register("image", desc.name),
            shared: shared.clone(),
        })
    }

    /// Wraps an image of a swapchain, which keeps owning it and its view.
    pub(crate) fn of_swapchain(
        shared: &Arc<Shared>,
        raw: vk::Image,
        view: vk::ImageView,
        size: (u32, u32),
        format: vk::Format,
    ) -> Image {
        Image {
            raw,
            view,
            name: "window".to_owned(),
            size,
            layers: 1,
            mips: 1,
            format,
            samples: vk::SampleCountFlags::TYPE_1,
            allocation: None,
            state: Mutex::new(State::NEW),
            id: shared.register("swapchain image", "window"),
            shared: shared.clone(),
        }
    }

    fn bind(shared: &Shared, raw: vk::Image, name: &str) -> Result<Allocation> {
        // SAFETY: `raw` was made just now.
        let requirements = unsafe { shared.device.get_image_memory_requirements(raw) };
        let allocation = allocate(
            shared,
            &AllocationCreateDesc {
                name,
                requirements,
                location: MemoryLocation::GpuOnly,
                linear: false,
                allocation_scheme: AllocationScheme::GpuAllocatorManaged,
            },
        )?;
        // SAFETY: the memory was made for this image's requirements, and is bound once.
        let bound = unsafe { shared.device.bind_image_memory(raw, allocation.memory(), allocation.offset()) };
        match bound.call("vkBindImageMemory") {
            Ok(()) => Ok(allocation),
            Err(error) => {
                free(shared, allocation);
                Err(error)
            }
        }
    }

    /// Vulkan's handle.
    pub fn raw(&self) -> vk::Image {
        self.raw
    }

    /// The view of all levels and layers.
    pub fn view(&self) -> vk::ImageView {
        self.view
    }

    /// Its name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Width and height in pixels.
    pub fn size(&self) -> (u32, u32) {
        self.size
    }

    /// Width and height as Vulkan has them.
    pub fn extent(&self) -> vk::Extent2D {
        vk::Extent2D { width: self.size.0, height: self.size.1 }
    }

    /// Layers of the array.
    pub fn layers(&self) -> u32 {
        self.layers
    }

    /// Levels of the pyramid.
    pub fn mips(&self) -> u32 {
        self.mips
    }

    /// Format of a pixel.
    pub fn format(&self) -> vk::Format {
        self.format
    }

    /// Samples a pixel.
    pub fn samples(&self) -> vk::SampleCountFlags {
        self.samples
    }

    /// A number that no other resource of the context has.
    pub fn id(&self) -> u64 {
        self.id
    }

    /// Whether it holds depths.
    pub fn is_depth(&self) -> bool {
        is_depth(self.format)
    }

    /// All of it.
    pub fn range(&self) -> vk::ImageSubresourceRange {
        range_of(self.format, self.layers, self.mips)
    }

    pub(crate) fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Image {
    fn drop(&mut self) {
        let lives = self.shared.unregister(self.id);
        if let (true, Some(allocation)) = (lives, self.allocation.take()) {
            self.shared.discard(Garbage::Image(self.raw, self.view, allocation));
        }
    }
}

/// Whether a format holds depths.
pub(crate) fn is_depth(format: vk::Format) -> bool {
    matches!(format, vk::Format::D32_SFLOAT | vk::Format::D16_UNORM | vk::Format::X8_D24_UNORM_PACK32)
}

fn range_of(format: vk::Format, layers: u32, mips: u32) -> vk::ImageSubresourceRange {
    vk::ImageSubresourceRange {
        aspect_mask: if is_depth(format) { vk::ImageAspectFlags::DEPTH } else { vk::ImageAspectFlags::COLOR },
        base_mip_level: 0,
        level_count: mips,
        base_array_layer: 0,
        layer_count: layers,
    }
}

pub(crate) fn view_of(
    shared: &Shared,
    raw: vk::Image,
    format: vk::Format,
    layers: u32,
    mips: u32,
) -> Result<vk::ImageView> {
    let kind = if layers > 1 { vk::ImageViewType::TYPE_2D_ARRAY } else { vk::ImageViewType::TYPE_2D };
    let info = vk::ImageViewCreateInfo::default()
        .image(raw)
        .view_type(kind)
        .format(format)
        .subresource_range(range_of(format, layers, mips));
    // SAFETY: the image lives and has the format, layers and levels that its owner says.
    unsafe { shared.device.create_image_view(&info, None) }.call("vkCreateImageView")
}
