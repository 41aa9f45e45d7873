//! Debug lines: forces, moments, skeletons, over everything that is not in front of them.

use super::{
    formats::{DEPTH, LIGHT},
    gather::GpuLine,
    quality::{ByQuality, Quality},
    targets::Targets,
};
use ash::vk;
use reef_gpu::{Blend, DepthDesc, DepthLoad, Frame, Gpu, GraphicsDesc, Load, Result, Upload};

reef_gpu::record! {
    /// Constants of `line.vert` and `line.frag`.
    pub(crate) struct LinePush = "LinePush" {
        /// [px].
        width: f32,
    }
}

/// The pass that draws debug lines.
pub struct Lines {
    pipeline: ByQuality,
}

impl Lines {
    /// Describes the pipeline.
    pub fn new(gpu: &Gpu) -> Self {
        let desc = GraphicsDesc {
            color: &[(LIGHT, Blend::Alpha)],
            depth: Some(DepthDesc { format: DEPTH, compare: vk::CompareOp::GREATER_OR_EQUAL, write: false }),
            ..GraphicsDesc::new("debug lines", "line.vert", "line.frag")
        };
        Self { pipeline: ByQuality::new(gpu, &desc) }
    }

    /// Compiles the pipeline now.
    pub fn prepare(&self, quality: Quality) -> Result<()> {
        self.pipeline.prepare(quality)
    }

    /// The pass. `width` in pixels.
    pub fn draw(
        &self,
        frame: &mut Frame<'_>,
        view: Upload,
        lines: &[GpuLine],
        width: f32,
        quality: Quality,
        targets: &Targets<'_>,
    ) -> Result<()> {
        if lines.is_empty() {
            return Ok(());
        }
        let count = lines.len() as u32;
        let lines = frame.upload(lines)?;
        frame
            .pass("debug lines")
            .color(targets.light, Load::Keep)
            .depth(targets.depth, DepthLoad::ReadOnly)
            .bind(self.pipeline.get(quality), &[(0, view.into()), (1, lines.into())])
            .run(|cmd| {
                cmd.pipeline(self.pipeline.get(quality))?;
                cmd.push(&LinePush { width })?;
                cmd.draw(0..count * 6, 0..1);
                Ok(())
            })
    }
}
