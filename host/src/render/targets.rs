//! The images that a picture is made in: scene light in half floats, and reversed depth.

use ash::vk;

use crate::gpu::{Gpu, Image, ImageDesc, Result};

/// Format of scene light.
pub const LIGHT: vk::Format = vk::Format::R16G16B16A16_SFLOAT;
/// Format of depth: 1 at the near plane, 0 infinitely far away.
pub const DEPTH: vk::Format = vk::Format::D32_SFLOAT;

/// Attachments of one size.
pub struct Targets {
    /// Scene light, before the tone curve.
    pub light: Image,
    /// Depth.
    pub depth: Image,
}

impl Targets {
    /// Makes both.
    pub fn new(gpu: &Gpu, size: (u32, u32)) -> Result<Self> {
        use vk::ImageUsageFlags as U;
        let light = ImageDesc::new("scene light", size, LIGHT, U::COLOR_ATTACHMENT | U::SAMPLED);
        let depth = ImageDesc::new("depth", size, DEPTH, U::DEPTH_STENCIL_ATTACHMENT | U::SAMPLED);
        Ok(Self { light: Image::new(gpu, &light)?, depth: Image::new(gpu, &depth)? })
    }
}
