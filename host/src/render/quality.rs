//! Pipelines by quality: what a quality leaves out is not compiled in, because a software rasteriser runs both sides of
//! every branch.

use crate::gpu::{Gpu, GraphicsDesc, Pipeline, Result};

/// How much work a picture may be.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Quality {
    /// Four caustic waves, none on what sways, no shafts of light.
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
}

/// One pipeline a quality. Nothing is compiled before it is drawn with.
pub struct ByQuality {
    low: Pipeline,
    high: Pipeline,
}

impl ByQuality {
    /// Describes both.
    pub fn new(gpu: &Gpu, desc: &GraphicsDesc<'_>) -> Self {
        let of = |quality: Quality| {
            Pipeline::graphics(gpu, &GraphicsDesc { constants: &[quality.constant()], ..*desc })
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
