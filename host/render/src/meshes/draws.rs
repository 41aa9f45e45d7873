//! The pipelines that draw meshes, by what a picture needs of them.

use ash::vk;
use reef_gpu::{Blend, DepthDesc, Gpu, GraphicsDesc, Pipeline, VertexDesc};

use super::records::VERTEX_WORDS;
use crate::{formats::DEPTH, quality::Quality, variant::Variant};

/// What a draw is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Solid.
    OneSided,
    /// Solid.
    TwoSided,
    /// Light comes through by opacity.
    Veil,
    /// Its edges fade.
    Thin,
}

impl Kind {
    fn cull(self) -> vk::CullModeFlags {
        if self == Self::OneSided { vk::CullModeFlags::BACK } else { vk::CullModeFlags::NONE }
    }

    /// Whether it hides what is behind it.
    fn solid(self) -> bool {
        matches!(self, Self::OneSided | Self::TwoSided)
    }

    fn blend(self) -> Blend {
        if self.solid() { Blend::Replace } else { Blend::Alpha }
    }

    fn depth(self) -> DepthDesc {
        DepthDesc { format: DEPTH, compare: vk::CompareOp::GREATER, write: self.solid() }
    }

    fn constants(self) -> [(u32, u32); 3] {
        [
            (2, u32::from(self != Self::OneSided)),
            (3, u32::from(self == Self::Veil)),
            (6, u32::from(self == Self::Thin)),
        ]
    }
}

/// The draws by pixels: one-sided, two-sided, veils, what is thin.
pub(super) struct Draws {
    pub(super) sides: [Pipeline; 2],
    pub(super) veil: Pipeline,
    pub(super) thin: Pipeline,
    /// Of what is lit at its vertices.
    pub(super) light: Pipeline,
}

impl Draws {
    pub(super) fn new(gpu: &Gpu, variant: Variant) -> Self {
        let pipeline = |name, kind| pixel_pipeline(gpu, name, variant, kind);
        Self {
            sides: [pipeline("meshes", Kind::OneSided), pipeline("meshes, two-sided", Kind::TwoSided)],
            veil: pipeline("mesh veils", Kind::Veil),
            thin: pipeline("thin meshes", Kind::Thin),
            light: Pipeline::compute(
                gpu,
                "mesh_lit.comp",
                &[variant.quality.constant(), (1, variant.patterns), (5, u32::from(variant.shiny))],
            ),
        }
    }
}

fn pixel_pipeline(gpu: &Gpu, name: &str, variant: Variant, kind: Kind) -> Pipeline {
    use vk::Format as F;
    let attributes = [
        (0, F::R32G32B32A32_SFLOAT, 0),
        (1, F::R16G16B16A16_SNORM, 16),
        (2, F::R16G16B16A16_SFLOAT, 24),
        (3, F::R16G16B16A16_SFLOAT, 32),
        (4, F::R8G8B8A8_UNORM, 40),
        (5, F::R32_UINT, 44),
    ];
    let [two_sided, veil, thin] = kind.constants();
    let draw = GraphicsDesc {
        cull: kind.cull(),
        vertices: &[VertexDesc {
            stride: VERTEX_WORDS as u32 * 4,
            per_instance: false,
            attributes: &attributes,
        }],
        color: &[(variant.quality.format(), kind.blend())],
        depth: Some(kind.depth()),
        constants: &[
            variant.quality.constant(),
            (1, variant.patterns),
            two_sided,
            veil,
            (4, variant.textures),
            (5, u32::from(variant.shiny)),
            thin,
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
pub(super) fn lit_pipeline(gpu: &Gpu, name: &str, kind: Kind) -> Pipeline {
    use vk::Format as F;
    let attributes = [
        (0, F::R32G32B32A32_SFLOAT, 0),
        (1, F::R8G8B8A8_UNORM, 16),
        (2, F::R16G16_UNORM, 20),
        (3, F::R16G16_SFLOAT, 24),
    ];
    let [_, _, thin] = kind.constants();
    let draw = GraphicsDesc {
        cull: kind.cull(),
        vertices: &[VertexDesc {
            stride: VERTEX_WORDS as u32 * 4,
            per_instance: false,
            attributes: &attributes,
        }],
        color: &[(Quality::Low.format(), kind.blend())],
        depth: Some(kind.depth()),
        constants: &[thin],
        ..GraphicsDesc::new(name, "mesh_lit.vert", "mesh_lit.frag")
    };
    Pipeline::graphics(gpu, &draw)
}
