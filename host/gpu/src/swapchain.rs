//! A window's pictures: taken from the window system, drawn to, given back to be shown.
//!
//! A frame of a window, in order: [`Swapchain::prepare`] makes the swapchain anew where it no longer fits;
//! [`Frames::begin`](super::Frames::begin); [`Swapchain::acquire`]; passes that draw into
//! [`Swapchain::image`]; [`Frame::finish_for_present`]; [`Frame::submit`] with [`Swapchain::signals`];
//! [`Swapchain::present`].

use std::sync::Arc;

use ash::vk;

use super::{
    barriers::State,
    context::{Gpu, Shared},
    error::{Call, GpuError, Result},
    frames::{Frame, Signals},
    image::{Image, view_of},
    instance::Surface,
};

/// A window system that hands over no image within this time is asked again in the next frame.
const PATIENCE_NS: u64 = 1_000_000_000;
/// Stages in which a frame touches the window's image first: drawn to, or copied to.
const WAITS: vk::PipelineStageFlags2 = vk::PipelineStageFlags2::from_raw(
    vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT.as_raw()
        | vk::PipelineStageFlags2::ALL_TRANSFER.as_raw(),
);

/// One image, until it is shown.
#[derive(Debug)]
#[must_use = "an image that was taken has to be shown"]
pub struct Acquired {
    image: u32,
    frame: usize,
}

/// The images of one size and format that a window shows in turn.
#[derive(Default)]
struct Chain {
    raw: vk::SwapchainKHR,
    images: Vec<Image>,
    views: Vec<vk::ImageView>,
    /// One an image: signalled when it was drawn, waited for by the window system, which says nothing of when
    /// it has. An image that is handed out again proves it.
    drawn: Vec<vk::Semaphore>,
}

/// The swapchain of one window.
pub struct Swapchain {
    shared: Arc<Shared>,
    surface: Surface,
    format: vk::SurfaceFormatKHR,
    chain: Chain,
    /// One a frame in flight: signalled when the image may be drawn to.
    free: Vec<vk::Semaphore>,
    wanted: (u32, u32),
    vsync: bool,
    stale: bool,
    /// An image was taken and is not shown yet. Where a frame fails meanwhile, its semaphore stays signalled.
    taken: bool,
    id: u64,
}

impl Swapchain {
    /// A swapchain for a window whose content has this size in pixels, for as many frames as can be in
    /// flight. The images themselves are made by the first [`Swapchain::prepare`].
    pub fn new(gpu: &Gpu, surface: Surface, size: (u32, u32), frames: usize) -> Result<Swapchain> {
        let shared = gpu.shared.clone();
        let format = choose_format(&shared, &surface)?;
        let id = shared.register("swapchain", "window");
        let mut swapchain = Swapchain {
            shared,
            surface,
            format,
            chain: Chain::default(),
            free: Vec::new(),
            wanted: size,
            vsync: true,
            stale: true,
            taken: false,
            id,
        };
        for _ in 0..frames.max(1) {
            let semaphore = swapchain.semaphore("image is free")?;
            swapchain.free.push(semaphore);
        }
        Ok(swapchain)
    }

    /// Format of the images.
    pub fn format(&self) -> vk::Format {
        self.format.format
    }

    /// Width and height of the images; zero before the first [`Swapchain::prepare`].
    pub fn size(&self) -> (u32, u32) {
        self.chain.images.first().map_or((0, 0), Image::size)
    }

    /// Whether the images encode linear light as sRGB by themselves. Where not (the usual case), shaders have
    /// to.
    pub fn encodes_srgb(&self) -> bool {
        matches!(self.format.format, vk::Format::B8G8R8A8_SRGB | vk::Format::R8G8B8A8_SRGB)
    }

    /// Waits for the display before each frame (as it does from the beginning), or draws as fast as the
    /// driver lets it.
    pub fn set_vsync(&mut self, vsync: bool) {
        if self.vsync != vsync {
            self.vsync = vsync;
            self.stale = true;
        }
    }

    /// The window's content has this size now.
    pub fn resized(&mut self, size: (u32, u32)) {
        self.wanted = size;
        self.grow_stale();
    }

    /// Makes images of the window's present size, where the old ones no longer fit. False: the window has no
    /// area, and nothing can be drawn.
    pub fn prepare(&mut self) -> Result<bool> {
        if self.wanted.0 == 0 || self.wanted.1 == 0 {
            return Ok(false);
        }
        if !self.stale && !self.taken {
            return Ok(true);
        }
        let caps = self.capabilities()?;
        let Some(extent) = choose_extent(&caps, self.wanted) else { return Ok(false) };
        // What was drawn and shown from the old images has to have ended: there is no other way to know.
        {
            let _queue = self.shared.queue();
            // SAFETY: the queue is held, so that nobody else submits.
            unsafe { self.shared.device.device_wait_idle() }.call("vkDeviceWaitIdle")?;
        }
        let old = std::mem::take(&mut self.chain);
        let made = self.make(&caps, extent, old.raw);
        self.destroy(old);
        self.chain = made?;
        if self.taken {
            for i in 0..self.free.len() {
                let fresh = self.semaphore("image is free")?;
                let spent = std::mem::replace(&mut self.free[i], fresh);
                // SAFETY: the device is idle, and the swapchain that may have signalled it is gone.
                unsafe { self.shared.device.destroy_semaphore(spent, None) };
            }
            self.taken = false;
        }
        self.stale = false;
        Ok(true)
    }

    /// Takes an image to draw this frame into. None: the window changed meanwhile; drop the frame and begin
    /// again.
    pub fn acquire(&mut self, frame: &Frame<'_>) -> Result<Option<Acquired>> {
        let index = frame.index();
        let semaphore = *self.free.get(index).ok_or_else(|| GpuError::Surface {
            reason: format!("it was made for {} frames in flight, this is number {index}", self.free.len()),
        })?;
        let functions = self.functions()?;
        // SAFETY: the swapchain lives; the semaphore's last wait belonged to a frame whose fence has passed,
        // because `frame` uses its place again.
        let taken = unsafe {
            functions.acquire_next_image(self.chain.raw, PATIENCE_NS, semaphore, vk::Fence::null())
        };
        match taken {
            Ok((image, suboptimal)) => {
                self.taken = true;
                if suboptimal {
                    self.grow_stale();
                }
                if let Some(image) = self.chain.images.get(image as usize) {
                    *image.state() = State::acquired(WAITS);
                }
                Ok(Some(Acquired { image, frame: index }))
            }
            Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => {
                self.grow_stale();
                Ok(None)
            }
            Err(vk::Result::TIMEOUT | vk::Result::NOT_READY) => Ok(None),
            Err(result) => Err(surface_error("vkAcquireNextImageKHR", result)),
        }
    }

    /// The image that was taken.
    pub fn image(&self, acquired: &Acquired) -> Result<&Image> {
        self.chain.images.get(acquired.image as usize).ok_or_else(|| GpuError::Surface {
            reason: format!("it handed over image {}, which it does not have", acquired.image),
        })
    }

    /// What the frame's submission waits for and signals.
    pub fn signals(&self, acquired: &Acquired) -> Signals {
        Signals {
            wait: self.free.get(acquired.frame).map(|&semaphore| (semaphore, WAITS)),
            signal: self.chain.drawn.get(acquired.image as usize).copied(),
        }
    }

    /// Shows the image, once the frame that draws it was submitted.
    pub fn present(&mut self, acquired: Acquired) -> Result<()> {
        let functions = self.functions()?;
        let waits: Vec<_> = self.chain.drawn.get(acquired.image as usize).copied().into_iter().collect();
        let (chains, images) = ([self.chain.raw], [acquired.image]);
        let info =
            vk::PresentInfoKHR::default().wait_semaphores(&waits).swapchains(&chains).image_indices(&images);
        let shown = {
            let queue = self.shared.queue();
            // SAFETY: the queue is held; the image was acquired, and the submission that signals the
            // semaphore made.
            unsafe { functions.queue_present(*queue, &info) }
        };
        self.taken = false;
        match shown {
            Ok(false) => {
                if !self.stale {
                    self.shared.instance.canary.set_resizing(false);
                }
            }
            Ok(true) | Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => self.grow_stale(),
            Err(result) => return Err(surface_error("vkQueuePresentKHR", result)),
        }
        Ok(())
    }

    fn grow_stale(&mut self) {
        self.stale = true;
        self.shared.instance.canary.set_resizing(true);
    }

    fn functions(&self) -> Result<ash::khr::swapchain::Device> {
        self.shared
            .swapchain
            .clone()
            .ok_or_else(|| GpuError::Surface { reason: "the context was opened without a window".to_owned() })
    }

    fn capabilities(&self) -> Result<vk::SurfaceCapabilitiesKHR> {
        let (functions, device) = (&self.surface.functions, self.shared.info.raw);
        // SAFETY: surface and device live, and belong to the same instance.
        unsafe { functions.get_physical_device_surface_capabilities(device, self.surface.raw) }
            .map_err(|result| surface_error("vkGetPhysicalDeviceSurfaceCapabilitiesKHR", result))
    }

    fn present_mode(&self) -> Result<vk::PresentModeKHR> {
        let (functions, device) = (&self.surface.functions, self.shared.info.raw);
        // SAFETY: surface and device live, and belong to the same instance.
        let offered =
            unsafe { functions.get_physical_device_surface_present_modes(device, self.surface.raw) }
                .map_err(|result| surface_error("vkGetPhysicalDeviceSurfacePresentModesKHR", result))?;
        Ok(choose_mode(&offered, self.vsync))
    }

    fn make(
        &self,
        caps: &vk::SurfaceCapabilitiesKHR,
        extent: vk::Extent2D,
        old: vk::SwapchainKHR,
    ) -> Result<Chain> {
        let functions = self.functions()?;
        let mode = self.present_mode()?;
        let transfers = vk::ImageUsageFlags::TRANSFER_SRC | vk::ImageUsageFlags::TRANSFER_DST;
        let most = if caps.max_image_count == 0 { u32::MAX } else { caps.max_image_count };
        let info = vk::SwapchainCreateInfoKHR::default()
            .surface(self.surface.raw)
            .min_image_count((caps.min_image_count + 1).min(most))
            .image_format(self.format.format)
            .image_color_space(self.format.color_space)
            .image_extent(extent)
            .image_array_layers(1)
            .image_usage(vk::ImageUsageFlags::COLOR_ATTACHMENT | (transfers & caps.supported_usage_flags))
            .image_sharing_mode(vk::SharingMode::EXCLUSIVE)
            .pre_transform(caps.current_transform)
            .composite_alpha(choose_alpha(caps.supported_composite_alpha))
            .present_mode(mode)
            .clipped(true)
            .old_swapchain(old);
        // SAFETY: the surface lives, everything asked for is among its capabilities; `old` is idle.
        let raw = unsafe { functions.create_swapchain(&info, None) }
            .map_err(|result| surface_error("vkCreateSwapchainKHR", result))?;
        let mut chain = Chain { raw, ..Chain::default() };
        match self.fill(&mut chain, extent) {
            Ok(()) => Ok(chain),
            Err(error) => {
                self.destroy(chain);
                Err(error)
            }
        }
    }

    fn fill(&self, chain: &mut Chain, extent: vk::Extent2D) -> Result<()> {
        // SAFETY: the swapchain was made just now.
        let images =
            unsafe { self.functions()?.get_swapchain_images(chain.raw) }.call("vkGetSwapchainImagesKHR")?;
        for raw in images {
            let view = view_of(&self.shared, raw, self.format.format, 1, 1)?;
            chain.views.push(view);
            chain.drawn.push(self.semaphore("image is drawn")?);
            self.shared.name(raw, "window");
            self.shared.name(view, "window");
            let size = (extent.width, extent.height);
            chain.images.push(Image::of_swapchain(&self.shared, raw, view, size, self.format.format));
        }
        Ok(())
    }

    fn semaphore(&self, name: &str) -> Result<vk::Semaphore> {
        // SAFETY: the device lives; who asks destroys it.
        let made = unsafe { self.shared.device.create_semaphore(&vk::SemaphoreCreateInfo::default(), None) };
        let semaphore = made.call("vkCreateSemaphore")?;
        self.shared.name(semaphore, name);
        Ok(semaphore)
    }

    /// Destroys images that nothing uses any more.
    fn destroy(&self, chain: Chain) {
        drop(chain.images);
        // SAFETY: the device is idle, and the images' only owner gave them up.
        unsafe {
            chain.views.iter().for_each(|&view| self.shared.device.destroy_image_view(view, None));
            chain.drawn.iter().for_each(|&semaphore| self.shared.device.destroy_semaphore(semaphore, None));
            if let Some(functions) = &self.shared.swapchain {
                functions.destroy_swapchain(chain.raw, None);
            }
        }
    }
}

impl Drop for Swapchain {
    fn drop(&mut self) {
        if !self.shared.unregister(self.id) {
            return;
        }
        {
            let _queue = self.shared.queue();
            // SAFETY: the queue is held. An error means that the device is lost: then it is idle, too.
            if let Err(result) = unsafe { self.shared.device.device_wait_idle() } {
                tracing::warn!("vkDeviceWaitIdle: {result}");
            }
        }
        let chain = std::mem::take(&mut self.chain);
        self.destroy(chain);
        // SAFETY: the device is idle.
        unsafe {
            self.free.iter().for_each(|&semaphore| self.shared.device.destroy_semaphore(semaphore, None));
        }
    }
}

fn surface_error(call: &'static str, result: vk::Result) -> GpuError {
    match result {
        vk::Result::ERROR_DEVICE_LOST => GpuError::DeviceLost { passes: format!("({call})") },
        vk::Result::ERROR_SURFACE_LOST_KHR => {
            GpuError::Surface { reason: "the window system took the window away".to_owned() }
        }
        result => GpuError::Vulkan { call, result },
    }
}

/// Eight bits a channel, not encoded by the device: the tone curve encodes and dithers by itself, and the
/// panel blends as egui means it.
fn choose_format(shared: &Shared, surface: &Surface) -> Result<vk::SurfaceFormatKHR> {
    // SAFETY: surface and device live, and belong to the same instance.
    let formats =
        unsafe { surface.functions.get_physical_device_surface_formats(shared.info.raw, surface.raw) }
            .map_err(|result| surface_error("vkGetPhysicalDeviceSurfaceFormatsKHR", result))?;
    best_format(&formats).ok_or_else(|| GpuError::Surface {
        reason: "it offers no format of 8 bits a channel in sRGB colours".to_owned(),
    })
}

fn best_format(offered: &[vk::SurfaceFormatKHR]) -> Option<vk::SurfaceFormatKHR> {
    use vk::Format as F;
    [F::B8G8R8A8_UNORM, F::R8G8B8A8_UNORM, F::B8G8R8A8_SRGB, F::R8G8B8A8_SRGB]
        .map(|format| vk::SurfaceFormatKHR { format, color_space: vk::ColorSpaceKHR::SRGB_NONLINEAR })
        .into_iter()
        .find(|wanted| offered.contains(wanted))
}

/// The surface's own size; where it has none (Wayland), the wanted one within its limits. None: there is no
/// area.
fn choose_extent(caps: &vk::SurfaceCapabilitiesKHR, wanted: (u32, u32)) -> Option<vk::Extent2D> {
    let own = caps.current_extent;
    let extent = if own.width == u32::MAX {
        let (least, most) = (caps.min_image_extent, caps.max_image_extent);
        let within = |side: u32, least: u32, most: u32| side.max(least).min(most);
        vk::Extent2D {
            width: within(wanted.0, least.width, most.width),
            height: within(wanted.1, least.height, most.height),
        }
    } else {
        own
    };
    (extent.width > 0 && extent.height > 0).then_some(extent)
}

/// FIFO waits for the display, and is always there.
fn choose_mode(offered: &[vk::PresentModeKHR], vsync: bool) -> vk::PresentModeKHR {
    use vk::PresentModeKHR as M;
    let wanted: &[M] = if vsync { &[] } else { &[M::MAILBOX, M::IMMEDIATE] };
    wanted.iter().copied().find(|mode| offered.contains(mode)).unwrap_or(M::FIFO)
}

fn choose_alpha(offered: vk::CompositeAlphaFlagsKHR) -> vk::CompositeAlphaFlagsKHR {
    use vk::CompositeAlphaFlagsKHR as A;
    [A::OPAQUE, A::INHERIT, A::PRE_MULTIPLIED, A::POST_MULTIPLIED]
        .into_iter()
        .find(|&alpha| offered.contains(alpha))
        .unwrap_or(A::OPAQUE)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn caps(own: (u32, u32)) -> vk::SurfaceCapabilitiesKHR {
        let extent = |(width, height)| vk::Extent2D { width, height };
        vk::SurfaceCapabilitiesKHR {
            current_extent: extent(own),
            min_image_extent: extent((1, 1)),
            max_image_extent: extent((4096, 4096)),
            ..Default::default()
        }
    }

    fn size(extent: Option<vk::Extent2D>) -> Option<(u32, u32)> {
        extent.map(|e| (e.width, e.height))
    }

    #[test]
    fn the_surfaces_own_size_wins_over_the_windows_idea_of_it() {
        assert_eq!(size(choose_extent(&caps((640, 360)), (800, 600))), Some((640, 360)));
    }

    #[test]
    fn a_surface_without_a_size_takes_the_windows_within_limits() {
        let open = (u32::MAX, u32::MAX);
        assert_eq!(size(choose_extent(&caps(open), (800, 600))), Some((800, 600)));
        assert_eq!(size(choose_extent(&caps(open), (9000, 600))), Some((4096, 600)));
    }

    #[test]
    fn a_window_without_area_has_no_pictures() {
        assert_eq!(size(choose_extent(&caps((0, 0)), (800, 600))), None);
        assert_eq!(size(choose_extent(&caps((0, 7)), (800, 600))), None);
    }

    #[test]
    fn a_format_that_the_device_does_not_encode_is_preferred() {
        let offer = |format| vk::SurfaceFormatKHR { format, color_space: vk::ColorSpaceKHR::SRGB_NONLINEAR };
        let offered = [offer(vk::Format::B8G8R8A8_SRGB), offer(vk::Format::R8G8B8A8_UNORM)];
        assert_eq!(best_format(&offered), Some(offered[1]));
        assert_eq!(best_format(&offered[..1]), Some(offered[0]));
        assert_eq!(best_format(&[offer(vk::Format::R5G6B5_UNORM_PACK16)]), None);
    }

    #[test]
    fn without_vsync_the_fastest_mode_is_taken_and_fifo_where_there_is_none() {
        use vk::PresentModeKHR as M;
        assert_eq!(choose_mode(&[M::FIFO, M::IMMEDIATE, M::MAILBOX], false), M::MAILBOX);
        assert_eq!(choose_mode(&[M::FIFO], false), M::FIFO);
        assert_eq!(choose_mode(&[M::FIFO, M::IMMEDIATE, M::MAILBOX], true), M::FIFO);
    }

    #[test]
    fn transparency_is_only_taken_where_nothing_else_is_offered() {
        use vk::CompositeAlphaFlagsKHR as A;
        assert_eq!(choose_alpha(A::OPAQUE | A::INHERIT), A::OPAQUE);
        assert_eq!(choose_alpha(A::POST_MULTIPLIED), A::POST_MULTIPLIED);
    }
}
