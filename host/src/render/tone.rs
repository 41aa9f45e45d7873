//! The last pass of the sea: scene light through the tone curve, with dither, into the picture.

use ash::vk;
use bytemuck::{Pod, Zeroable};

use super::targets::Targets;
use crate::gpu::{
    Access, Blend, Frame, Gpu, GraphicsDesc, Image, Load, Pipeline, Resource, Result, SamplerDesc,
};

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Push {
    exposure: f32,
    encode: u32,
    samples: i32,
    curve: u32,
}

/// How light becomes colour.
#[derive(Clone, Copy)]
pub struct Finish {
    /// Brightness; 1 is the scene's own.
    pub exposure: f32,
    /// Samples along each side of a pixel.
    pub samples: u32,
    /// A diagram, whose colours are shown as they are.
    pub diagram: bool,
}

/// The pass that finishes a picture.
pub struct Tone {
    gpu: Gpu,
    /// One for each format of a target that was met.
    pipelines: Vec<(vk::Format, Pipeline)>,
    sampler: vk::Sampler,
}

impl Tone {
    /// Nothing is described before the first target is known.
    pub fn new(gpu: &Gpu) -> Result<Self> {
        let sampler = gpu.sampler(SamplerDesc { linear: false, repeat: false, anisotropic: false })?;
        Ok(Self { gpu: gpu.clone(), pipelines: Vec::new(), sampler })
    }

    /// The pass.
    pub fn draw(
        &mut self,
        frame: &mut Frame<'_>,
        targets: &Targets,
        finish: Finish,
        picture: &Image,
    ) -> Result<()> {
        let format = picture.format();
        let index = match self.pipelines.iter().position(|(f, _)| *f == format) {
            Some(index) => index,
            None => {
                let color = [(format, Blend::Replace)];
                let desc = GraphicsDesc {
                    color: &color,
                    ..GraphicsDesc::new("tone", "full_screen.vert", "tonemap.frag")
                };
                self.pipelines.push((format, Pipeline::graphics(&self.gpu, &desc)));
                self.pipelines.len() - 1
            }
        };
        let pipeline = &self.pipelines[index].1;
        let encodes = matches!(format, vk::Format::R8G8B8A8_SRGB | vk::Format::B8G8R8A8_SRGB);
        frame.pass("tone").read(&targets.light, Access::FragmentSampled).color(picture, Load::Discard).run(
            |cmd| {
                cmd.pipeline(pipeline)?;
                cmd.bind(&[(0, Resource::Texture(&targets.light, self.sampler))])?;
                cmd.push(&Push {
                    exposure: finish.exposure,
                    encode: u32::from(!encodes),
                    samples: finish.samples as i32,
                    curve: u32::from(!finish.diagram),
                })?;
                cmd.draw(0..3, 0..1);
                Ok(())
            },
        )
    }
}
