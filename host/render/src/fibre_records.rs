//! What the fibre passes read and write: `shaders/fibre.glsl` in Rust.

reef_gpu::record! {
    /// `VkDrawIndirectCommand`.
    pub struct Draw = "Draw" {
        /// How many.
        pub vertices: u32,
        /// 1.
        pub instances: u32,
        /// The first.
        pub first_vertex: u32,
        /// 0.
        pub first_instance: u32,
    }
}

reef_gpu::record! {
    /// `VkDrawIndexedIndirectCommand`.
    pub struct IndexedDraw = "IndexedDraw" {
        /// How many.
        pub indices: u32,
        /// 1.
        pub instances: u32,
        /// The first.
        pub first_index: u32,
        /// 0.
        pub vertex_offset: i32,
        /// 0.
        pub first_instance: u32,
    }
}

reef_gpu::record! {
    /// `VkDispatchIndirectCommand`.
    pub struct Groups = "Groups" {
        /// Work groups along x.
        pub x: u32,
        /// Along y.
        pub y: u32,
        /// Along z.
        pub z: u32,
    }
}

/// [`GpuChoice::levels`]: a ribbon that is lit at its rings.
pub const LIT_RIBBON: u32 = 0x1_0000;
/// [`GpuChoice::levels`]: somewhere thinner than [`crate::lod::THIN_RADIUS`].
pub const THIN: u32 = 0x2_0000;

reef_gpu::record! {
    /// What was chosen for a fibre; the device has it alone.
    pub struct GpuChoice = "Choice" {
        /// Ring level, side level, what kind of ribbon.
        pub levels: u32,
        /// Rings.
        pub rings: u32,
        /// Vertices of a ring.
        pub sides: u32,
        /// In the tubes' or the ribbons' vertices.
        pub first_vertex: u32,
        /// In the tubes' indices.
        pub first_index: u32,
        /// 0: this level, 1: the next coarser.
        pub ring_morph: f32,
        /// The same of sides.
        pub side_morph: f32,
        /// Length [m].
        pub chain: f32,
    }
}

reef_gpu::record! {
    /// A ring of a fibre; the device has it alone.
    pub struct GpuRing = "Ring" {
        /// In eye space [m].
        pub center: [f32; 3],
        /// That is drawn [m].
        pub radius: f32,
        /// Unit: angle 0.
        pub normal: [f32; 3],
        /// True over drawn width.
        pub coverage: f32,
        /// Unit.
        pub tangent: [f32; 3],
        /// 0 root, 1 last node, 2 the end of its cap.
        pub along: f32,
        /// Shares of the tangent and of the radial direction in the surface's normal.
        pub slope: [f32; 2],
    }
}

reef_gpu::record! {
    /// A tube's vertex.
    pub struct TubeVertex = "TubeVertex" {
        /// Clip space.
        pub clip: [f32; 4],
        /// 16 bits each.
        pub normal_xy: u32,
        /// 16 bits each; half of how far along the fibre.
        pub normal_z_along: u32,
        /// Cosine and sine of the angle around the fibre, 16 bits each.
        pub circle: u32,
        /// Half floats: true radius [cm], half the true width [px].
        pub radius_half: u32,
        /// 24 and 8 bits.
        pub material_flags: u32,
        /// The fibre's.
        pub variation: u32,
        /// Half floats: length [m], tissue that light crosses in radii.
        pub chain_tissue: u32,
        /// Distance from the middle of a ribbon [px]; 0: a tube.
        pub edge: f32,
    }
}

reef_gpu::record! {
    /// A lit ribbon's vertex.
    pub struct StripVertex = "StripVertex" {
        /// Clip space.
        pub clip: [f32; 4],
        /// What is shown; a: true over drawn width; 8 bits each.
        pub edge: u32,
        /// Middle minus mean of the edges; 8 bits each.
        pub bow: u32,
    }
}

/// Bytes of a tube's vertex.
pub const TUBE: u64 = size_of::<TubeVertex>() as u64;
/// Bytes of a lit ribbon's vertex.
pub const STRIP: u64 = size_of::<StripVertex>() as u64;
/// Words of a tube's vertex.
pub const VERTEX_WORDS: usize = size_of::<TubeVertex>() / 4;
/// Words of a lit ribbon's vertex.
pub const STRIP_WORDS: usize = size_of::<StripVertex>() / 4;

reef_gpu::record! {
    /// What the scan wrote: the draws, and counts for people.
    pub struct DrawCounts = "FibreDraws" {
        /// The tubes that are no ribbons.
        pub tubes: IndexedDraw,
        /// Those that are, whose indices come after all others.
        pub flat_tubes: IndexedDraw,
        /// Lit ribbons that hide what is behind them.
        pub solid: Draw,
        /// Those that let it through.
        pub thin: Draw,
        /// Work groups that skin the tubes.
        pub groups: Groups,
        /// How many tubes there are.
        pub tube_count: u32,
        /// Vertices of the tubes.
        pub vertices: u32,
        /// Fibres that are drawn.
        pub drawn: u32,
        /// Fibres that did not fit into the buffers.
        pub left_out: u32,
    }
}

reef_gpu::record! {
    /// Constants of `fibre_rings.comp`.
    pub(crate) struct RingsPush = "RingsPush" {
        pub(crate) fibre_count: u32,
        pub(crate) alpha: f32,
        pub(crate) use_lod: u32,
        pub(crate) ring_step: f32,
        pub(crate) side_error: f32,
        pub(crate) lit_ribbon: f32,
    }
}

reef_gpu::record! {
    /// Constants of `fibre_scan.comp`.
    pub(crate) struct FibreScanPush = "FibreScanPush" {
        pub(crate) fibre_count: u32,
        pub(crate) vertex_limit: u32,
        pub(crate) index_limit: u32,
        pub(crate) groups_x: u32,
    }
}

reef_gpu::record! {
    /// Constants of `fibre_skin.comp`.
    pub(crate) struct FibreSkinPush = "FibreSkinPush" {
        pub(crate) groups_x: u32,
    }
}

reef_gpu::record! {
    /// Constants of `fibre_ribbon.comp`.
    pub(crate) struct RibbonPush = "RibbonPush" {
        pub(crate) fibre_count: u32,
        pub(crate) alpha: f32,
    }
}
