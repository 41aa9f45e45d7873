//! The last pass: egui's triangles over the finished picture.

use std::{
    collections::{HashMap, HashSet},
    sync::{Arc, Mutex},
};

use ash::vk;
use egui::{
    ClippedPrimitive, Color32, ColorImage, ImageData, TextureId, TexturesDelta,
    epaint::{ImageDelta, Primitive},
};
use egui_ash::{DynamicRendering, Options, RenderMode, Renderer, RendererError, allocator::GpuAllocator};

/// egui's pipeline, textures and triangles on the device. Dropped before the context is closed, with the
/// device idle.
pub struct Overlay {
    device: ash::Device,
    renderer: Option<Renderer<GpuAllocator>>,
    pool: vk::CommandPool,
    textures: Textures,
    primitives: Vec<ClippedPrimitive>,
    pixels_per_point: f32,
}

/// What the overlay draws with and into.
pub struct Target {
    /// The device.
    pub device: ash::Device,
    /// Its memory.
    pub allocator: Arc<Mutex<gpu_allocator::vulkan::Allocator>>,
    /// Family of the queue that uploads and draws.
    pub queue_family: u32,
    /// Format of the picture.
    pub format: vk::Format,
    /// Frames that may be in flight.
    pub frames: usize,
}

impl Overlay {
    /// Makes the pipeline for pictures of the target's format.
    pub fn new(target: &Target) -> Result<Self, RendererError> {
        let options = Options {
            in_flight_frames: target.frames.max(1),
            srgb_framebuffer: is_srgb(target.format),
            ..Options::default()
        };
        let renderer = Renderer::with_gpu_allocator(
            target.allocator.clone(),
            target.device.clone(),
            mode(target.format),
            options,
        )?;
        let info = vk::CommandPoolCreateInfo::default()
            .flags(vk::CommandPoolCreateFlags::TRANSIENT)
            .queue_family_index(target.queue_family);
        // SAFETY: the device lives; the pool is destroyed in `drop`.
        let pool = unsafe { target.device.create_command_pool(&info, None) }?;
        Ok(Self {
            device: target.device.clone(),
            renderer: Some(renderer),
            pool,
            textures: Textures::default(),
            primitives: Vec::new(),
            pixels_per_point: 1.0,
        })
    }

    /// Takes what egui painted in this frame. Also where the frame is then not drawn: texture changes add up.
    pub fn paint(&mut self, ctx: &egui::Context, output: egui::FullOutput) {
        let egui::FullOutput { textures_delta, shapes, pixels_per_point, .. } = output;
        self.textures.take(textures_delta);
        self.primitives = ctx.tessellate(shapes, pixels_per_point);
        // The renderer makes buffers of what it gets, and a buffer cannot be empty.
        self.primitives.retain(|p| matches!(&p.primitive, Primitive::Mesh(mesh) if !mesh.indices.is_empty()));
        self.pixels_per_point = pixels_per_point;
    }

    /// Whether [`Overlay::upload`] has something to do.
    pub fn needs_upload(&self) -> bool {
        !self.textures.changed.is_empty() || !self.textures.gone.is_empty()
    }

    /// Brings changed textures to the device. The device has to be idle: no frame in flight may use the old
    /// ones.
    pub fn upload(&mut self, queue: vk::Queue) -> Result<(), RendererError> {
        let Some(renderer) = &mut self.renderer else { return Ok(()) };
        for id in self.textures.gone.drain() {
            renderer.free_texture(id)?;
        }
        for id in self.textures.changed.drain() {
            let Some((image, options)) = self.textures.images.get(&id) else { continue };
            let delta = ImageDelta::full(image.clone(), *options);
            renderer.set_texture(queue, self.pool, id, &delta)?;
        }
        Ok(())
    }

    /// Records the triangles, within dynamic rendering into a picture of this size.
    pub fn draw(&mut self, commands: vk::CommandBuffer, extent: vk::Extent2D) -> Result<(), RendererError> {
        let Some(renderer) = &mut self.renderer else { return Ok(()) };
        renderer.cmd_draw(commands, extent, self.pixels_per_point, &self.primitives)
    }
}

impl Drop for Overlay {
    fn drop(&mut self) {
        self.renderer = None;
        // SAFETY: the owner has waited for the device; the renderer's one-time commands have ended.
        unsafe { self.device.destroy_command_pool(self.pool, None) };
    }
}

fn mode(format: vk::Format) -> RenderMode {
    RenderMode::DynamicRendering(DynamicRendering {
        color_attachment_format: format,
        depth_attachment_format: None,
        stencil_attachment_format: None,
    })
}

fn is_srgb(format: vk::Format) -> bool {
    matches!(format, vk::Format::B8G8R8A8_SRGB | vk::Format::R8G8B8A8_SRGB | vk::Format::A8B8G8R8_SRGB_PACK32)
}

/// Copies of egui's textures. The renderer transitions a texture from UNDEFINED even where only a part of it
/// changes, which lets a driver throw the rest away; so parts are put together here and textures are always
/// uploaded whole.
#[derive(Default)]
struct Textures {
    images: HashMap<TextureId, (Arc<ColorImage>, egui::TextureOptions)>,
    changed: HashSet<TextureId>,
    /// Freed by the newest frame, whose triangles may still show them.
    retiring: HashSet<TextureId>,
    gone: HashSet<TextureId>,
}

impl Textures {
    fn take(&mut self, mut delta: TexturesDelta) {
        for id in self.retiring.drain() {
            self.images.remove(&id);
            self.changed.remove(&id);
            self.gone.insert(id);
        }
        for (id, deltas) in delta.set.drain() {
            for delta in deltas {
                self.set(id, delta);
            }
        }
        self.retiring.extend(delta.free.drain());
    }

    fn set(&mut self, id: TextureId, delta: ImageDelta) {
        let ImageData::Color(part) = delta.image;
        match delta.pos {
            None => {
                self.images.insert(id, (part, delta.options));
            }
            Some(at) => {
                let Some((whole, _)) = self.images.get_mut(&id) else { return };
                insert(Arc::make_mut(whole), &part, at);
            }
        }
        self.gone.remove(&id);
        self.changed.insert(id);
    }
}

/// Writes a part into a picture; what lies outside is left out.
fn insert(whole: &mut ColorImage, part: &ColorImage, [x, y]: [usize; 2]) {
    let ([width, height], [columns, rows]) = (whole.size, part.size);
    let columns = columns.min(width.saturating_sub(x));
    for row in 0..rows.min(height.saturating_sub(y)) {
        let from: &[Color32] = &part.pixels[row * part.size[0]..][..columns];
        whole.pixels[(y + row) * width + x..][..columns].copy_from_slice(from);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ID: TextureId = TextureId::Managed(0);

    fn image(width: usize, height: usize, gray: u8) -> ColorImage {
        ColorImage::filled([width, height], Color32::from_gray(gray))
    }

    fn delta(set: Vec<ImageDelta>, free: &[TextureId]) -> TexturesDelta {
        let mut delta = TexturesDelta::default();
        for one in set {
            delta.push(ID, one);
        }
        for id in free {
            delta.free(*id);
        }
        delta
    }

    #[test]
    fn parts_of_a_texture_are_put_together_over_frames_that_were_not_drawn() {
        let mut textures = Textures::default();
        let options = egui::TextureOptions::LINEAR;
        textures.take(delta(vec![ImageDelta::full(image(4, 3, 0), options)], &[]));
        textures.take(delta(vec![ImageDelta::partial([1, 1], image(2, 1, 7), options)], &[]));
        textures.take(delta(vec![ImageDelta::partial([3, 2], image(2, 2, 9), options)], &[]));
        let pixels: Vec<u8> = textures.images[&ID].0.pixels.iter().map(|p| p.r()).collect();
        assert_eq!(pixels, [0, 0, 0, 0, 0, 7, 7, 0, 0, 0, 0, 9]);
        assert!(textures.changed.contains(&ID));
    }

    #[test]
    fn a_freed_texture_lives_for_the_frame_that_frees_it_and_no_longer() {
        let mut textures = Textures::default();
        let options = egui::TextureOptions::LINEAR;
        textures.take(delta(vec![ImageDelta::full(image(1, 1, 0), options)], &[ID]));
        assert!(textures.changed.contains(&ID) && textures.gone.is_empty());
        textures.take(delta(vec![], &[]));
        assert!(textures.changed.is_empty() && textures.images.is_empty());
        assert!(textures.gone.contains(&ID));
        // A part of a texture that is gone is nothing.
        textures.take(delta(vec![ImageDelta::partial([0, 0], image(1, 1, 1), options)], &[]));
        assert!(textures.changed.is_empty());
    }
}
