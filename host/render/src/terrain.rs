//! The sea bed: tiles of a grid whose vertices read the height field, sand made in the fragment shader.

use std::sync::Arc;

use ash::vk;
use glam::DVec2;
use reef_gpu::{
    Access, Blend, Buffer, DepthDesc, DepthLoad, Frame, Gpu, GraphicsDesc, Image, ImageDesc, Load, Resource,
    Result, SamplerDesc, Upload,
};
use reef_streams::environment::{Environment, Ripples, Terrain as Bed};

use super::{
    contact::{self, ContactMap},
    formats::{DEPTH, LIGHT},
    gather::Stander,
    noise,
    quality::{ByQuality, Quality},
    sand,
    targets::Targets,
    tiles,
    view::{Lens, View},
};

/// What the ground's and the rocks' shaders read besides the view: noise and contact map.
pub struct GroundTextures {
    /// Tiling noise.
    pub noise: Image,
    /// Shade of what stands on the ground.
    pub contact: Image,
    /// The sand of low quality, with the ripples that it was made for.
    sand: Option<(Ripples, Image)>,
    noise_texels: Vec<u8>,
    /// For the noise.
    pub repeat: vk::Sampler,
    /// For the contact map.
    pub clamp: vk::Sampler,
    origin: DVec2,
    extent: f32,
    key: Option<u64>,
}

impl GroundTextures {
    /// Makes the noise, and an empty contact map.
    pub fn new(gpu: &Gpu) -> Result<Self> {
        use vk::ImageUsageFlags as U;
        let size = (noise::SIZE as u32, noise::SIZE as u32);
        let usage = U::SAMPLED | U::TRANSFER_DST | U::TRANSFER_SRC;
        let format = vk::Format::R8G8B8A8_UNORM;
        let image = Image::new(gpu, &ImageDesc { mips: 9, ..ImageDesc::new("noise", size, format, usage) })?;
        let noise_texels = noise::texels();
        gpu.write_image(&image, &noise_texels)?;
        Ok(Self {
            noise: image,
            sand: None,
            noise_texels,
            contact: contact_image(gpu, &vec![255; contact::SIZE * contact::SIZE * 2])?,
            repeat: gpu.sampler(SamplerDesc { linear: true, repeat: [true; 2], anisotropic: false })?,
            clamp: gpu.sampler(SamplerDesc { linear: true, repeat: [false; 2], anisotropic: false })?,
            origin: DVec2::ZERO,
            extent: 1.0,
            key: None,
        })
    }

    /// Makes the contact map anew where something moved.
    pub fn update(&mut self, gpu: &Gpu, environment: &Environment, standers: &[Stander]) -> Result<()> {
        let key = ContactMap::key(standers);
        if self.key == Some(key) {
            return Ok(());
        }
        let map = ContactMap::new(environment, standers);
        self.contact = contact_image(gpu, &map.texels)?;
        self.origin = map.origin;
        self.extent = map.extent;
        self.key = Some(key);
        Ok(())
    }

    /// Makes the sand anew where the ripples are others.
    pub fn lay_sand(&mut self, gpu: &Gpu, ripples: &Ripples) -> Result<()> {
        if self.sand.as_ref().is_some_and(|(of, _)| of == ripples) {
            return Ok(());
        }
        use vk::ImageUsageFlags as U;
        let size = (sand::SIZE as u32, sand::SIZE as u32);
        let usage = U::SAMPLED | U::TRANSFER_DST | U::TRANSFER_SRC;
        let desc = ImageDesc::new("sand", size, vk::Format::R8G8B8A8_UNORM, usage);
        let image = Image::new(gpu, &ImageDesc { mips: sand::SIZE.ilog2() + 1, ..desc })?;
        gpu.write_image(&image, &sand::texels(ripples, &self.noise_texels))?;
        self.sand = Some((*ripples, image));
        Ok(())
    }

    /// What the ground's shaders of a quality read as binding 3.
    pub fn ground(&self, quality: Quality) -> &Image {
        match (&self.sand, quality) {
            (Some((_, sand)), Quality::Low) => sand,
            _ => &self.noise,
        }
    }

    /// Forgets the contact map: the scene is another.
    pub fn forget(&mut self) {
        self.key = None;
    }

    /// A texture that repeats, and the contact map, as bindings 3 and 4.
    pub fn bindings<'a>(&'a self, repeating: &'a Image) -> [(u32, Resource<'a>); 2] {
        [(3, Resource::Texture(repeating, self.repeat)), (4, Resource::Texture(&self.contact, self.clamp))]
    }

    /// Where the contact map lies.
    pub fn describe(&self, view: &mut View, lens: &Lens) {
        view.contact_scale = [1.0 / self.extent; 2];
        view.contact_origin = [(self.origin.x - lens.eye.x) as f32, (self.origin.y - lens.eye.z) as f32];
    }
}

fn contact_image(gpu: &Gpu, texels: &[u8]) -> Result<Image> {
    let size = (contact::SIZE as u32, contact::SIZE as u32);
    let usage = vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST;
    let image = Image::new(gpu, &ImageDesc::new("contact map", size, vk::Format::R8G8_UNORM, usage))?;
    gpu.write_image(&image, texels)?;
    Ok(image)
}

/// The pass that draws the sea bed.
pub struct Terrain {
    pipeline: ByQuality,
    /// Of a tile at low and at high quality.
    indices: [Buffer; 2],
    bed: Option<Laid>,
}

/// Mean depth of a bed of these heights below the surface [m].
fn depth(heights: &[f32]) -> f32 {
    let sum: f64 = heights.iter().map(|height| f64::from(*height)).sum();
    (-sum / heights.len().max(1) as f64).max(0.1) as f32
}

/// A scene's bed on the device.
struct Laid {
    bed: Arc<Bed>,
    heights: Buffer,
    /// See [`tiles::band`].
    band: [f32; 2],
    /// Below the surface, in the mean [m].
    depth: f32,
}

impl Terrain {
    /// Describes the pipeline, makes the tiles' indices.
    pub fn new(gpu: &Gpu) -> Result<Self> {
        let desc = GraphicsDesc {
            cull: vk::CullModeFlags::BACK,
            color: &[(LIGHT, Blend::Replace)],
            depth: Some(DepthDesc { format: DEPTH, compare: vk::CompareOp::GREATER, write: true }),
            ..GraphicsDesc::new("terrain", "terrain.vert", "terrain.frag")
        };
        let low = GraphicsDesc { vertex: "terrain_low.vert", fragment: Some("terrain_low.frag"), ..desc };
        let indices = |quality| {
            let indices = tiles::indices(tiles::quads(quality));
            gpu.buffer_with("terrain indices", vk::BufferUsageFlags::INDEX_BUFFER, &indices)
        };
        Ok(Self {
            pipeline: ByQuality::with_low(gpu, &desc, &low),
            indices: [indices(Quality::Low)?, indices(Quality::High)?],
            bed: None,
        })
    }

    /// Compiles the pipeline now.
    pub fn prepare(&self, quality: Quality) -> Result<()> {
        self.pipeline.prepare(quality)
    }

    /// Takes over a scene's bed.
    pub fn set(&mut self, gpu: &Gpu, bed: Option<&Arc<Bed>>) -> Result<()> {
        self.bed = match bed {
            Some(bed) => {
                let heights = tiles::heights(bed);
                let usage = vk::BufferUsageFlags::STORAGE_BUFFER;
                let heights = gpu.buffer_with("terrain heights", usage, &heights)?;
                Some(Laid { bed: bed.clone(), heights, band: tiles::band(bed), depth: depth(&bed.heights) })
            }
            None => None,
        };
        Ok(())
    }

    /// Where the bed lies, for the shaders.
    pub fn describe(&self, view: &mut View, lens: &Lens) {
        let Some(Laid { bed, band, depth, .. }) = &self.bed else { return };
        view.bed_depth = *depth;
        let near = tiles::nearest(bed, lens);
        let place = DVec2::from(bed.origin) + near * f64::from(bed.cell);
        view.terrain_origin = [(place.x - lens.eye.x) as f32, (place.y - lens.eye.z) as f32];
        view.terrain_cell = bed.cell;
        view.terrain_zero = -lens.eye.y as f32;
        view.aloof = tiles::aloof(*band, lens.eye.y) as f32;
        view.nearest = near.as_vec2().to_array();
        view.terrain_size = [bed.columns as f32, bed.rows as f32];
        let ripples = bed.ripples;
        view.ripple_number = std::f32::consts::TAU / ripples.spacing.max(0.01);
        view.ripple_height = ripples.height * 0.5;
        view.surge = [ripples.direction.sin(), ripples.direction.cos()];
    }

    /// The pass.
    pub fn draw(
        &self,
        frame: &mut Frame<'_>,
        view: Upload,
        lens: &Lens,
        quality: Quality,
        textures: &GroundTextures,
        targets: &Targets<'_>,
    ) -> Result<()> {
        let Some(Laid { bed, heights, band, .. }) = &self.bed else { return Ok(()) };
        let tiles = tiles::tiles(bed, *band, lens, tiles::quads(quality));
        if tiles.is_empty() {
            return Ok(());
        }
        let count = tiles.len() as u32;
        let tiles = frame.upload(&tiles)?;
        let indices = &self.indices[usize::from(quality == Quality::High)];
        let [ground, contact] = textures.bindings(textures.ground(quality));
        let pipeline = self.pipeline.get(quality);
        frame
            .pass("terrain")
            .bind(pipeline, &[(0, view.into()), (1, heights.into()), (2, tiles.into()), ground, contact])
            .read(indices, Access::IndexRead)
            .color(targets.light, Load::Keep)
            .depth(targets.depth, DepthLoad::Keep)
            .run(|cmd| {
                cmd.pipeline(pipeline)?;
                cmd.indices(indices, vk::IndexType::UINT16)?;
                cmd.draw_indexed(0..(indices.size() / 2) as u32, 0, 0..count);
                Ok(())
            })
    }
}
