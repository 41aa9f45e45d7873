//! What the mesh passes read and write: `shaders/mesh.glsl` in Rust.

use std::mem::offset_of;

use crate::fibre_records::{Groups, IndexedDraw};

/// [`GpuMesh::flags`]: joints are blended as dual quaternions.
pub const DUAL: u32 = 1;
/// [`GpuMesh::flags`]: seen from both sides.
pub const TWO_SIDED: u32 = 2;
/// [`GpuInstance::flags`]: its vertices come with the step.
pub const DRAWN_ANEW: u32 = 1;
/// [`GpuInstance::flags`]: one joint moves all.
pub const RIGID: u32 = 2;
/// [`GpuInstance::flags`]: light comes through by opacity.
pub const VEIL: u32 = 4;
/// [`GpuInstance::flags`]: of a veil, only what faces away.
pub const FAR_SIDE: u32 = 8;
/// [`GpuInstance::flags`]: its material has no texture.
pub const PLAIN: u32 = 16;

/// [`GpuInstance::flags`]: nor a pattern.
pub const SMOOTH: u32 = 32;
/// [`GpuInstance::flags`]: of a veil that is lit at its vertices.
pub const LIT_VEIL: u32 = 64;

/// [`GpuInstance::flags`]: where its texture is less than half opaque there is nothing.
pub const CUT_OUT: u32 = 128;

/// Draws by what they need of the device: lit at vertices, lit by pixels (each one-sided, two-sided), veils
/// by pixels and at vertices, what is thinner than two pixels in the same two ways.
pub const BINS: usize = 8;
/// Of what is lit at its vertices.
pub const BIN_LIT: usize = 0;
/// Of what is lit pixel by pixel.
pub const BIN_PIXEL: usize = 2;
/// Of what light comes through.
pub const BIN_VEIL: usize = 4;
/// Of the same, lit at its vertices.
pub const BIN_LIT_VEIL: usize = 5;
/// Of what is so thin that its edges fade, lit pixel by pixel.
pub const BIN_THIN: usize = 6;
/// Of the same, lit at its vertices.
pub const BIN_LIT_THIN: usize = 7;
/// Of what is thin most of the surface is in rows of less than half this width [px].
pub const THIN_HALF: f32 = 1.0;
/// Half width of what is never widened [px].
pub const NO_ROW: f32 = 100.0;
/// What has no pattern may be so many times as large and still lit at its vertices.
pub const SMOOTH_LIT: f32 = 4.0;
/// A coarser level begins to fade in at this many times its threshold.
pub const BAND: f32 = 1.15;
/// Words of a vertex, as `mesh_skin.comp` writes them.
pub const VERTEX_WORDS: usize = 12;
/// [`GpuPart::bin`]: there was no room for it.
pub const LEFT_OUT: u32 = 0x100;
/// A level of no part.
pub const NOT_DRAWN: u32 = u32::MAX;

reef_gpu::record! {
    /// A mesh on the device.
    pub struct GpuMesh = "Mesh" {
        /// In all meshes' vertices.
        pub first_vertex: u32,
        /// In all bones.
        pub first_bone: u32,
        /// In all levels.
        pub first_level: u32,
        /// How many it has.
        pub level_count: u32,
        /// In all joints at rest.
        pub first_rest: u32,
        /// How many it has.
        pub joints: u32,
        /// Bones a vertex.
        pub influences: u32,
        /// [`DUAL`], [`TWO_SIDED`].
        pub flags: u32,
        /// Of what is at rest [m].
        pub center: [f32; 3],
        /// [m].
        pub radius: f32,
    }
}

reef_gpu::record! {
    /// A level of detail.
    pub struct GpuLevel = "Level" {
        /// In all indices.
        pub first_index: u32,
        /// Indices over three.
        pub triangles: u32,
        /// In its mesh.
        pub first_vertex: u32,
        /// How many it has.
        pub vertices: u32,
        /// How far it strays [m].
        pub error: f32,
        /// Bones that are read of each vertex.
        pub influences: u32,
        /// Half the width of most of its surface [m].
        pub slim: f32,
        /// 0: records are whole texels.
        pub end: u32,
    }
}

reef_gpu::record! {
    /// A joint at rest.
    pub struct GpuRest = "Rest" {
        /// Unit quaternion.
        pub rotation: [f32; 4],
        /// [m].
        pub translation: [f32; 3],
        /// A factor.
        pub scale: f32,
        /// Farthest that a vertex is from it [m].
        pub reach: f32,
        /// 0: records are whole texels.
        pub end: [u32; 3],
    }
}

reef_gpu::record! {
    /// A vertex at rest.
    pub struct GpuVertex = "RestVertex" {
        /// In the mesh [m].
        pub position: [f32; 3],
        /// On an octahedron.
        pub normal: u32,
        /// Two halves.
        pub uv: u32,
        /// Of tissue [m].
        pub thickness: f32,
        /// A factor.
        pub glow: f32,
        /// Roots of linear light, and opacity: 8 bits each.
        pub color: u32,
    }
}

reef_gpu::record! {
    /// An instance in one picture.
    pub struct GpuInstance = "Instance" {
        /// Index into the picture's objects.
        pub object: u32,
        /// Index into the meshes on the device.
        pub mesh: u32,
        /// Index into the picture's materials.
        pub material: u32,
        /// [`DRAWN_ANEW`] and those below it.
        pub flags: u32,
        /// Its first joint or vertex in the step before.
        pub previous: u32,
        /// The same in this step.
        pub current: u32,
        /// Joints that move it.
        pub joints: u32,
        /// Its first moved joint.
        pub palette: u32,
        /// 0: the step before, 1: this step.
        pub blend: f32,
        /// Of the mesh at rest.
        pub scale: f32,
        /// Moves patterns.
        pub phase: f32,
        /// [rad].
        pub hue: f32,
        /// Relative.
        pub value: f32,
        /// 1: gone.
        pub fade: f32,
        /// The instance whose vertices it draws.
        pub vertices_of: u32,
        /// What its neighbours take of the light: see [`super::stand::Canopy::shade`].
        pub shade: u32,
        /// Of what is drawn anew, relative to the object's origin [m].
        pub center: [f32; 3],
        /// [m].
        pub radius: f32,
    }
}

reef_gpu::record! {
    /// An instance at one level of detail; each has two.
    pub struct GpuPart = "Part" {
        /// In all levels; [`NOT_DRAWN`].
        pub level: u32,
        /// One of [`BINS`].
        pub bin: u32,
        /// In the picture's vertices.
        pub first_vertex: u32,
        /// In the picture's indices.
        pub first_index: u32,
        /// The object's origin relative to the eye [m].
        pub base: [f32; 3],
        /// Of the pixels: from, to.
        pub shares: u32,
        /// Its level's first vertex, in all vertices at rest.
        pub first_rest: u32,
        /// That vertex's first influence, in all bones.
        pub first_bone: u32,
        /// 0: another instance has them.
        pub vertices: u32,
        /// How many it has.
        pub triangles: u32,
        /// How it is moved: see `Part` of `shaders/mesh.glsl`.
        pub how: u32,
        /// Its first moved joint.
        pub palette: u32,
        /// Of the mesh at rest.
        pub scale: f32,
        /// Its level's first vertex, in its mesh and so in what is drawn anew.
        pub first_drawn: u32,
    }
}

reef_gpu::record! {
    /// What the scan wrote.
    pub struct MeshCounts = "MeshDraws" {
        /// Of each bin.
        pub commands: [IndexedDraw; BINS],
        /// Work groups over the parts that are drawn.
        pub groups: Groups,
        /// Work groups over the vertices that may be lit by themselves.
        pub light_groups: Groups,
        /// Parts that are drawn, with those that did not fit.
        pub parts: u32,
        /// Vertices in all.
        pub vertices: u32,
        /// Vertices before this may be lit by themselves; none after it is.
        pub lit: u32,
        /// Triangles in all.
        pub triangles: u32,
        /// Parts that are drawn.
        pub drawn: u32,
        /// Parts that did not fit into the buffers.
        pub left_out: u32,
    }
}

/// Where a bin's draw lies in [`MeshCounts`].
pub const fn command(bin: usize) -> u64 {
    (offset_of!(MeshCounts, commands) + bin * size_of::<IndexedDraw>()) as u64
}

/// Where the work groups lie there.
pub const GROUPS: u64 = offset_of!(MeshCounts, groups) as u64;

/// Where those of the light lie.
pub const LIGHT_GROUPS: u64 = offset_of!(MeshCounts, light_groups) as u64;

/// What a picture drew, as it was read back.
#[derive(Clone, Debug, Default)]
pub struct Drawn {
    /// Two an instance, in the instances' order.
    pub parts: Vec<GpuPart>,
    /// Words of each vertex.
    pub vertices: Vec<[u32; VERTEX_WORDS]>,
    /// Three a triangle.
    pub indices: Vec<u32>,
}

reef_gpu::record! {
    /// Constants of `mesh_pose.comp`.
    pub(crate) struct PosePush = "MeshPosePush" {
        pub(super) count: u32,
        pub(super) use_lod: u32,
        pub(super) error: f32,
        pub(super) lit: f32,
        pub(super) first_instance: u32,
        pub(super) first_object: u32,
    }
}

reef_gpu::record! {
    /// Constants of `mesh_scan.comp`.
    pub(crate) struct ScanPush = "MeshScanPush" {
        pub(super) part_count: u32,
        pub(super) vertex_limit: u32,
        pub(super) index_limit: u32,
        pub(super) groups_x: u32,
    }
}

reef_gpu::record! {
    /// Constants of `mesh_skin.comp`.
    pub(crate) struct SkinPush = "MeshSkinPush" {
        pub(super) groups_x: u32,
        pub(super) first_instance: u32,
    }
}

reef_gpu::record! {
    /// Constants of `mesh_index.comp`.
    pub(crate) struct IndexPush = "MeshIndexPush" {
        pub(super) groups_x: u32,
        pub(super) index_limit: u32,
        pub(super) first_instance: u32,
    }
}

reef_gpu::record! {
    /// Constants of `mesh_lit.comp`.
    pub(crate) struct LightPush = "MeshLightPush" {
        pub(super) first_instance: u32,
    }
}
