//! The ways in which a pass touches a buffer or an image, and what each means to Vulkan.

use ash::vk::{AccessFlags2 as A, ImageLayout as L, PipelineStageFlags2 as S};

/// How a pass touches one resource. A pass that reads and writes the same resource declares both.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Access {
    /// Arguments of an indirect draw or dispatch.
    IndirectRead,
    /// Indices.
    IndexRead,
    /// Vertex attributes.
    AttributeRead,
    /// Storage or uniform buffer, read in a vertex shader.
    VertexRead,
    /// Storage or uniform buffer, read in a fragment shader.
    FragmentRead,
    /// Storage or uniform buffer or storage image, read in a compute shader.
    ComputeRead,
    /// Storage or texel buffer, or storage image, written in a compute shader.
    ComputeWrite,
    /// Sampled image, or texels of a buffer, in a vertex shader.
    VertexSampled,
    /// Sampled image, or texels of a buffer, in a fragment shader.
    FragmentSampled,
    /// Sampled image, or texels of a buffer, in a compute shader.
    ComputeSampled,
    /// Colour attachment: loaded, blended, written, or resolved into.
    ColorAttachment,
    /// Depth attachment, tested and written.
    DepthAttachment,
    /// Depth attachment, tested only.
    DepthAttachmentRead,
    /// Source of a copy, a blit or a resolve.
    TransferSrc,
    /// Target of a copy, a blit, a fill or a clear.
    TransferDst,
    /// Read by the program after the frame's fence.
    HostRead,
    /// Handed to the window system.
    Present,
}

/// The stages, the kinds of access, and the layout of an [`Access`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Use {
    /// Stages of the pipeline that touch the resource.
    pub stages: S,
    /// How they do.
    pub accesses: A,
    /// The layout in which an image has to be; UNDEFINED for what only buffers know.
    pub layout: L,
    /// Whether anything is written.
    pub writes: bool,
}

/// Every stage in which anything is touched.
pub(crate) const ALL_STAGES: S = S::from_raw(
    S::DRAW_INDIRECT.as_raw()
        | S::INDEX_INPUT.as_raw()
        | S::VERTEX_ATTRIBUTE_INPUT.as_raw()
        | S::VERTEX_SHADER.as_raw()
        | S::FRAGMENT_SHADER.as_raw()
        | S::COMPUTE_SHADER.as_raw()
        | S::EARLY_FRAGMENT_TESTS.as_raw()
        | S::LATE_FRAGMENT_TESTS.as_raw()
        | S::COLOR_ATTACHMENT_OUTPUT.as_raw()
        | S::ALL_TRANSFER.as_raw(),
);

impl Access {
    /// What Vulkan calls it. `depth`: the resource is a depth image.
    pub fn describe(self, depth: bool) -> Use {
        let shader_read = A::SHADER_STORAGE_READ | A::UNIFORM_READ;
        let sampled = if depth { L::DEPTH_READ_ONLY_OPTIMAL } else { L::SHADER_READ_ONLY_OPTIMAL };
        let depth_stages = S::EARLY_FRAGMENT_TESTS | S::LATE_FRAGMENT_TESTS;
        let (stages, accesses, layout, writes) = match self {
            Access::IndirectRead => (S::DRAW_INDIRECT, A::INDIRECT_COMMAND_READ, L::UNDEFINED, false),
            Access::IndexRead => (S::INDEX_INPUT, A::INDEX_READ, L::UNDEFINED, false),
            Access::AttributeRead => {
                (S::VERTEX_ATTRIBUTE_INPUT, A::VERTEX_ATTRIBUTE_READ, L::UNDEFINED, false)
            }
            Access::VertexRead => (S::VERTEX_SHADER, shader_read, L::GENERAL, false),
            Access::FragmentRead => (S::FRAGMENT_SHADER, shader_read, L::GENERAL, false),
            Access::ComputeRead => (S::COMPUTE_SHADER, shader_read, L::GENERAL, false),
            Access::ComputeWrite => (S::COMPUTE_SHADER, A::SHADER_STORAGE_WRITE, L::GENERAL, true),
            Access::VertexSampled => (S::VERTEX_SHADER, A::SHADER_SAMPLED_READ, sampled, false),
            Access::FragmentSampled => (S::FRAGMENT_SHADER, A::SHADER_SAMPLED_READ, sampled, false),
            Access::ComputeSampled => (S::COMPUTE_SHADER, A::SHADER_SAMPLED_READ, sampled, false),
            Access::ColorAttachment => (
                S::COLOR_ATTACHMENT_OUTPUT,
                A::COLOR_ATTACHMENT_READ | A::COLOR_ATTACHMENT_WRITE,
                L::COLOR_ATTACHMENT_OPTIMAL,
                true,
            ),
            Access::DepthAttachment => (
                depth_stages,
                A::DEPTH_STENCIL_ATTACHMENT_READ | A::DEPTH_STENCIL_ATTACHMENT_WRITE,
                L::DEPTH_ATTACHMENT_OPTIMAL,
                true,
            ),
            Access::DepthAttachmentRead => {
                (depth_stages, A::DEPTH_STENCIL_ATTACHMENT_READ, L::DEPTH_READ_ONLY_OPTIMAL, false)
            }
            Access::TransferSrc => (S::ALL_TRANSFER, A::TRANSFER_READ, L::TRANSFER_SRC_OPTIMAL, false),
            Access::TransferDst => (S::ALL_TRANSFER, A::TRANSFER_WRITE, L::TRANSFER_DST_OPTIMAL, true),
            Access::HostRead => (S::HOST, A::HOST_READ, L::UNDEFINED, false),
            // The semaphore that the presentation waits for makes everything visible to it.
            Access::Present => (S::NONE, A::NONE, L::PRESENT_SRC_KHR, false),
        };
        Use { stages, accesses, layout, writes }
    }

    /// Whether images can be touched so.
    pub fn suits_images(self) -> bool {
        self.describe(false).layout != L::UNDEFINED
    }

    /// Whether buffers can be touched so.
    pub fn suits_buffers(self) -> bool {
        !matches!(
            self,
            Access::ColorAttachment | Access::DepthAttachment | Access::DepthAttachmentRead | Access::Present
        )
    }
}
