//! The images that a picture is made in: light and reversed depth.

use ash::vk;
use reef_gpu::{Gpu, Image, ImageDesc, Result};

use super::{formats::DEPTH, quality::Quality};

/// What the passes draw into.
#[derive(Clone, Copy)]
pub struct Targets<'a> {
    /// Scene light, or at low quality what the display shows of it.
    pub light: &'a Image,
    /// Depth.
    pub depth: &'a Image,
}

/// Attachments of one size that are kept from frame to frame.
pub struct Attachments {
    light: Option<Image>,
    depth: Image,
}

impl Attachments {
    /// Those for a picture of this size. `before` is used again where it fits. Low quality draws into
    /// `picture` itself where that has the format and one sample a pixel.
    pub fn fit(
        before: Option<Self>,
        gpu: &Gpu,
        size: (u32, u32),
        quality: Quality,
        picture: &Image,
    ) -> Result<Self> {
        use vk::ImageUsageFlags as U;
        let direct = quality.format() == picture.format() && picture.size() == size;
        let wanted = (!direct).then_some(quality.format());
        if let Some(before) = before
            && before.depth.size() == size
            && before.light.as_ref().map(Image::format) == wanted
        {
            return Ok(before);
        }
        let light = |format| {
            Image::new(gpu, &ImageDesc::new("scene light", size, format, U::COLOR_ATTACHMENT | U::SAMPLED))
        };
        let depth = ImageDesc::new("depth", size, DEPTH, U::DEPTH_STENCIL_ATTACHMENT | U::SAMPLED);
        Ok(Self { light: wanted.map(light).transpose()?, depth: Image::new(gpu, &depth)? })
    }

    /// What the passes draw into on the way to `picture`.
    pub fn targets<'a>(&'a self, picture: &'a Image) -> Targets<'a> {
        Targets { light: self.light.as_ref().unwrap_or(picture), depth: &self.depth }
    }

    /// What the last pass has to bring into the picture; None where it is there already.
    pub fn unfinished(&self) -> Option<&Image> {
        self.light.as_ref()
    }
}
