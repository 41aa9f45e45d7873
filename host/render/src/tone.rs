//! The last pass of the sea: scene light through the tone curve, with dither, into the picture.

use ash::vk;
use reef_gpu::{Blend, Frame, Gpu, GraphicsDesc, Image, Load, Pipeline, Resource, Result, SamplerDesc};

/// ENCODE, SAMPLES and CURVE of `shaders/tonemap.frag`.
type Constants = [(u32, u32); 3];

reef_gpu::record! {
    /// Constants of `tonemap.frag`.
    pub(crate) struct TonePush = "TonePush" {
        /// Brightness of the picture; 1 is the scene's own.
        exposure: f32,
    }
}

/// How light becomes colour.
#[derive(Clone, Copy, Debug)]
pub struct Finish {
    /// Brightness; 1 is the scene's own.
    pub exposure: f32,
    /// Samples along each side of a pixel.
    pub samples: u32,
    /// A diagram, whose colours are shown as they are.
    pub diagram: bool,
    /// The materials wrote already what is shown.
    pub shown: bool,
}

/// The pass that finishes a picture.
pub struct Tone {
    gpu: Gpu,
    /// One for each way of finishing that was met: branches on push constants would have lavapipe make the
    /// shader anew in each frame.
    pipelines: Vec<(vk::Format, Constants, Pipeline)>,
    sampler: vk::Sampler,
}

impl Tone {
    /// Nothing is described before the first target is known.
    pub fn new(gpu: &Gpu) -> Result<Self> {
        let sampler = gpu.sampler(SamplerDesc { linear: false, repeat: [false; 2], anisotropic: false })?;
        Ok(Self { gpu: gpu.clone(), pipelines: Vec::new(), sampler })
    }

    /// The pass.
    pub fn draw(
        &mut self,
        frame: &mut Frame<'_>,
        light: &Image,
        finish: Finish,
        picture: &Image,
    ) -> Result<()> {
        let format = picture.format();
        let encodes = matches!(format, vk::Format::R8G8B8A8_SRGB | vk::Format::B8G8R8A8_SRGB);
        let curve = if finish.shown { 2 } else { u32::from(!finish.diagram) };
        let constants = [(2, u32::from(!encodes)), (3, finish.samples), (4, curve)];
        let index = match self.pipelines.iter().position(|(f, c, _)| *f == format && *c == constants) {
            Some(index) => index,
            None => {
                let color = [(format, Blend::Replace)];
                let desc = GraphicsDesc {
                    color: &color,
                    constants: &constants,
                    ..GraphicsDesc::new("tone", "full_screen.vert", "tonemap.frag")
                };
                self.pipelines.push((format, constants, Pipeline::graphics(&self.gpu, &desc)));
                self.pipelines.len() - 1
            }
        };
        let pipeline = &self.pipelines[index].2;
        frame
            .pass("tone")
            .color(picture, Load::Discard)
            .bind(pipeline, &[(0, Resource::Texture(light, self.sampler))])
            .run(|cmd| {
                cmd.pipeline(pipeline)?;
                cmd.push(&TonePush { exposure: finish.exposure })?;
                cmd.draw(0..3, 0..1);
                Ok(())
            })
    }
}
