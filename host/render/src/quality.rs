//! Pipelines by quality: what a quality leaves out is not compiled in, because a software rasteriser runs
//! both sides of every branch.

use ash::vk;
use reef_gpu::{Gpu, GraphicsDesc, Pipeline, Result};

use super::formats::{LIGHT, SHOWN};

/// How much work a picture may be.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Quality {
    /// Four caustic waves, none on what sways, no shafts of light; materials write what the display shows.
    Low,
    /// Everything.
    #[default]
    High,
}

impl Quality {
    /// `HIGH` of `shaders/view.glsl`.
    pub fn constant(self) -> (u32, u32) {
        (0, u32::from(self == Quality::High))
    }

    /// What the materials draw into, as `shaders/shown.glsl` has it.
    pub fn format(self) -> vk::Format {
        match self {
            Quality::Low => SHOWN,
            Quality::High => LIGHT,
        }
    }
}

/// One pipeline a quality. Nothing is compiled before it is drawn with.
pub struct ByQuality {
    low: Pipeline,
    high: Pipeline,
}

impl ByQuality {
    /// Describes both, with the same shaders.
    pub fn new(gpu: &Gpu, desc: &GraphicsDesc<'_>) -> Self {
        Self::with_low(gpu, desc, desc)
    }

    /// Describes both. What `low` draws into scene light is drawn into what the display shows.
    pub fn with_low(gpu: &Gpu, high: &GraphicsDesc<'_>, low: &GraphicsDesc<'_>) -> Self {
        let of = |quality: Quality| {
            let desc = if quality == Quality::Low { low } else { high };
            let format = |f: vk::Format| if f == LIGHT { quality.format() } else { f };
            let color: Vec<_> = desc.color.iter().map(|&(f, blend)| (format(f), blend)).collect();
            Pipeline::graphics(
                gpu,
                &GraphicsDesc { color: &color, constants: &[quality.constant()], ..*desc },
            )
        };
        Self { low: of(Quality::Low), high: of(Quality::High) }
    }

    /// The one for this quality.
    pub fn get(&self, quality: Quality) -> &Pipeline {
        match quality {
            Quality::Low => &self.low,
            Quality::High => &self.high,
        }
    }

    /// Compiles the one for this quality now.
    pub fn prepare(&self, quality: Quality) -> Result<()> {
        self.get(quality).prepare()
    }
}
