//! The background: the water's own light and the surface from below, where nothing else was drawn.

use super::{
    formats::{DEPTH, LIGHT},
    quality::{ByQuality, Quality},
    targets::Targets,
};
use ash::vk;
use reef_gpu::{Blend, DepthDesc, DepthLoad, Frame, Gpu, GraphicsDesc, Load, Result, Upload};

/// The pass that draws the background.
pub struct Sky {
    pipeline: ByQuality,
}

impl Sky {
    /// Describes the pipeline.
    pub fn new(gpu: &Gpu) -> Self {
        let desc = GraphicsDesc {
            color: &[(LIGHT, Blend::Replace)],
            depth: Some(DepthDesc { format: DEPTH, compare: vk::CompareOp::GREATER_OR_EQUAL, write: false }),
            ..GraphicsDesc::new("background", "full_screen.vert", "sky.frag")
        };
        Self { pipeline: ByQuality::new(gpu, &desc) }
    }

    /// Compiles the pipeline now.
    pub fn prepare(&self, quality: Quality) -> Result<()> {
        self.pipeline.prepare(quality)
    }

    /// The pass.
    pub fn draw(
        &self,
        frame: &mut Frame<'_>,
        view: Upload,
        quality: Quality,
        targets: &Targets<'_>,
    ) -> Result<()> {
        frame
            .pass("background")
            .color(targets.light, Load::Keep)
            .depth(targets.depth, DepthLoad::ReadOnly)
            .bind(self.pipeline.get(quality), &[(0, view.into())])
            .run(|cmd| {
                cmd.pipeline(self.pipeline.get(quality))?;
                cmd.draw(0..3, 0..1);
                Ok(())
            })
    }
}
