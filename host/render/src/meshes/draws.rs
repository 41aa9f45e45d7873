//! The pipelines that draw meshes, by what a picture needs of them.

use ash::vk;
use reef_gpu::{Blend, DepthDesc, Gpu, GraphicsDesc, Pipeline, VertexDesc};

use super::records::VERTEX_WORDS;
use crate::{formats::DEPTH, quality::Quality, variant::Variant};

/// The draws by pixels: one-sided, two-sided, veils.
pub(super) struct Draws {
    pub(super) sides: [Pipeline; 2],
    pub(super) veil: Pipeline,
    /// Of what is lit at its vertices.
    pub(super) light: Pipeline,
}

impl Draws {
    pub(super) fn new(gpu: &Gpu, variant: Variant) -> Self {
        let pipeline = |name, two_sided, veil| pixel_pipeline(gpu, name, variant, two_sided, veil);
        Self {
            sides: [pipeline("meshes", false, false), pipeline("meshes, two-sided", true, false)],
            veil: pipeline("mesh veils", true, true),
            light: Pipeline::compute(
                gpu,
                "mesh_lit.comp",
                &[variant.quality.constant(), (1, variant.patterns), (5, u32::from(variant.shiny))],
            ),
        }
    }
}

fn pixel_pipeline(gpu: &Gpu, name: &str, variant: Variant, two_sided: bool, veil: bool) -> Pipeline {
    use vk::Format as F;
    let attributes = [
        (0, F::R32G32B32A32_SFLOAT, 0),
        (1, F::R16G16B16A16_SNORM, 16),
        (2, F::R16G16B16A16_SFLOAT, 24),
        (3, F::R16G16B16A16_SFLOAT, 32),
        (4, F::R8G8B8A8_UNORM, 40),
        (5, F::R32_UINT, 44),
    ];
    let blend = if veil { Blend::Alpha } else { Blend::Replace };
    let draw = GraphicsDesc {
        cull: cull(two_sided),
        vertices: &[VertexDesc {
            stride: VERTEX_WORDS as u32 * 4,
            per_instance: false,
            attributes: &attributes,
        }],
        color: &[(variant.quality.format(), blend)],
        depth: Some(DepthDesc { format: DEPTH, compare: vk::CompareOp::GREATER, write: !veil }),
        constants: &[
            variant.quality.constant(),
            (1, variant.patterns),
            (2, u32::from(two_sided)),
            (3, u32::from(veil)),
            (4, variant.textures),
            (5, u32::from(variant.shiny)),
        ],
        ..GraphicsDesc::new(
            name,
            "mesh.vert",
            if variant.textures != 0 { "mesh_textured.frag" } else { "mesh.frag" },
        )
    };
    Pipeline::graphics(gpu, &draw)
}

/// The draw of what is lit at its vertices.
pub(super) fn lit_pipeline(gpu: &Gpu, name: &str, two_sided: bool, veil: bool) -> Pipeline {
    use vk::Format as F;
    let attributes = [(0, F::R32G32B32A32_SFLOAT, 0), (1, F::R8G8B8A8_UNORM, 16), (2, F::R16G16_UNORM, 20)];
    let draw = GraphicsDesc {
        cull: cull(two_sided),
        vertices: &[VertexDesc {
            stride: VERTEX_WORDS as u32 * 4,
            per_instance: false,
            attributes: &attributes,
        }],
        color: &[(Quality::Low.format(), if veil { Blend::Alpha } else { Blend::Replace })],
        depth: Some(DepthDesc { format: DEPTH, compare: vk::CompareOp::GREATER, write: !veil }),
        ..GraphicsDesc::new(name, "mesh_lit.vert", "mesh_lit.frag")
    };
    Pipeline::graphics(gpu, &draw)
}

fn cull(two_sided: bool) -> vk::CullModeFlags {
    if two_sided { vk::CullModeFlags::NONE } else { vk::CullModeFlags::BACK }
}
