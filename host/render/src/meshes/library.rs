//! The meshes that the sea's instances have, on the device: one of each content, whoever made it.

use std::{borrow::Cow, collections::HashMap, sync::Arc};

use ash::vk;
use bytemuck::Pod;
use reef_abi as abi;
use reef_gpu::{Buffer, Gpu, Result, TEXEL_BYTES};
use reef_streams::{frame::Frame, meshes::Mesh};

use super::{
    records::{DUAL, GpuLevel, GpuMesh, GpuRest, GpuVertex, TWO_SIDED},
    rows::{self, GpuRow},
    stand::Form,
};
use crate::sprites::linear;

/// All that stays of meshes, as the device has it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shelf {
    /// Meshes.
    pub meshes: Vec<GpuMesh>,
    /// Their levels.
    pub levels: Vec<GpuLevel>,
    /// Their joints at rest.
    pub rests: Vec<GpuRest>,
    /// Their vertices at rest.
    pub vertices: Vec<GpuVertex>,
    /// Where in its row each of them is.
    pub rows: Vec<GpuRow>,
    /// Joint and weight of each influence.
    pub bones: Vec<u32>,
    /// Three a triangle, into the mesh's vertices.
    pub indices: Vec<u32>,
    /// How each mesh stands.
    pub forms: Vec<Form>,
    /// Vertices and indices of an instance of each mesh at most: at two levels, where one fades into the
    /// next.
    pub most: Vec<[u64; 2]>,
    numbers: HashMap<[u8; 32], u32>,
}

impl Shelf {
    /// The number of a mesh here.
    pub fn number(&self, mesh: &Mesh) -> Option<u32> {
        self.numbers.get(&mesh.hash).copied()
    }

    /// Adds a mesh, unless its like is here.
    pub fn add(&mut self, mesh: &Mesh) {
        if self.numbers.contains_key(&mesh.hash) {
            return;
        }
        self.numbers.insert(mesh.hash, self.meshes.len() as u32);
        self.forms.push(Form::of(mesh));
        self.most.push(most(mesh));
        let flag = |theirs: u32, ours: u32| if mesh.flags & theirs != 0 { ours } else { 0 };
        let [x, y, z, radius] = mesh.bounds;
        let center = [x, y, z];
        self.meshes.push(GpuMesh {
            first_vertex: self.vertices.len() as u32,
            first_bone: self.bones.len() as u32,
            first_level: self.levels.len() as u32,
            level_count: mesh.levels.len() as u32,
            first_rest: self.rests.len() as u32,
            joints: mesh.rest.len() as u32,
            influences: mesh.influences,
            flags: flag(abi::MESH_DUAL, DUAL) | flag(abi::MESH_TWO_SIDED, TWO_SIDED),
            center,
            radius,
        });
        let first_index = self.indices.len() as u32;
        // Nothing else is ever thin.
        let (rows, slim) = if mesh.flags & abi::MESH_TWO_SIDED != 0 {
            rows::rows(mesh)
        } else {
            (vec![GpuRow::default(); mesh.vertices.len()], vec![rows::WIDE; mesh.levels.len()])
        };
        self.levels.extend(mesh.levels.iter().zip(slim).map(|(level, slim)| GpuLevel {
            first_index: first_index + level.first_index,
            triangles: level.index_count / 3,
            first_vertex: level.first_vertex,
            vertices: level.vertex_count,
            error: level.error,
            influences: level.influences,
            slim,
            end: 0,
        }));
        self.rests.extend(mesh.rest.iter().zip(&mesh.reach).map(|(joint, reach)| {
            let abi::Joint { rotation, translation, scale } = *joint;
            GpuRest { rotation, translation, scale, reach: *reach, end: [0; 3] }
        }));
        self.vertices.extend(mesh.vertices.iter().map(vertex));
        self.rows.extend(rows);
        self.bones.extend_from_slice(&mesh.bones);
        self.indices.extend_from_slice(&mesh.indices);
    }
}

fn most(mesh: &Mesh) -> [u64; 2] {
    let nothing = abi::MeshLevel::default();
    let next = mesh.levels.iter().skip(1).chain([&nothing]);
    mesh.levels.iter().zip(next).fold([0; 2], |[vertices, indices], (a, b)| {
        [
            vertices.max(u64::from(a.vertex_count) + u64::from(b.vertex_count)),
            indices.max(u64::from(a.index_count) + u64::from(b.index_count)),
        ]
    })
}

fn vertex(vertex: &abi::MeshVertex) -> GpuVertex {
    let [r, g, b, opacity] = vertex.color.to_le_bytes();
    let root = |byte: u8| (linear(byte).sqrt() * 255.0 + 0.5) as u8;
    GpuVertex {
        position: vertex.position,
        normal: vertex.normal,
        uv: half(vertex.uv[0]) | half(vertex.uv[1]) << 16,
        thickness: vertex.thickness,
        glow: vertex.glow,
        color: u32::from_le_bytes([root(r), root(g), root(b), opacity]),
    }
}

/// A number as a half float, rounded to the nearest; what is too small for one is 0, what is too great the
/// greatest.
pub fn half(value: f32) -> u32 {
    let sign = value.to_bits() >> 16 & 0x8000;
    let size = value.abs();
    if size < 6.103_515_6e-5 {
        return sign;
    }
    if size >= 65_504.0 {
        return sign | 0x7bff;
    }
    // Half of the last place that stays, so that cutting rounds.
    let bits = size.to_bits() + 0x1000;
    sign | ((bits >> 13) - (112 << 10))
}

/// The shelf's buffers.
pub struct Books {
    /// [`Shelf::meshes`].
    pub meshes: Buffer,
    /// [`Shelf::levels`].
    pub levels: Buffer,
    /// [`Shelf::rests`].
    pub rests: Buffer,
    /// [`Shelf::vertices`].
    pub vertices: Buffer,
    /// [`Shelf::rows`].
    pub rows: Buffer,
    /// [`Shelf::bones`].
    pub bones: Buffer,
    /// [`Shelf::indices`].
    pub indices: Buffer,
}

/// What is on the device, and what that is.
#[derive(Default)]
pub struct Library {
    /// As it was brought.
    pub shelf: Shelf,
    books: Option<Books>,
    /// Hashes of what the sea holds now, in the order of the shelf.
    held: Vec<[u8; 32]>,
}

impl Library {
    /// Makes the device hold the meshes that the instances of this step have. Where these changed, all is
    /// made anew: meshes change when instances begin, not while they run.
    pub fn update(&mut self, gpu: &Gpu, frame: &Frame) -> Result<()> {
        let mut wanted: Vec<&Arc<Mesh>> = Vec::new();
        let mut same = true;
        for mesh in frame.outputs.iter().flat_map(|outputs| outputs.meshes.iter()) {
            if !wanted.iter().any(|known| known.hash == mesh.hash) {
                same &= self.held.get(wanted.len()) == Some(&mesh.hash);
                wanted.push(mesh);
            }
        }
        if same && wanted.len() == self.held.len() {
            return Ok(());
        }
        let mut shelf = Shelf::default();
        wanted.iter().for_each(|mesh| shelf.add(mesh));
        self.books = None;
        if !shelf.meshes.is_empty() {
            self.books = Some(Books {
                meshes: bring(gpu, "meshes", &shelf.meshes)?,
                levels: bring(gpu, "mesh levels", &shelf.levels)?,
                rests: bring(gpu, "mesh joints at rest", &shelf.rests)?,
                vertices: bring(gpu, "mesh vertices at rest", &shelf.vertices)?,
                rows: bring(gpu, "mesh rows", &shelf.rows)?,
                bones: bring(gpu, "mesh bones", &shelf.bones)?,
                indices: bring(gpu, "mesh triangles", &shelf.indices)?,
            });
        }
        self.shelf = shelf;
        self.held = wanted.iter().map(|mesh| mesh.hash).collect();
        Ok(())
    }

    /// The buffers; None where the sea has no meshes.
    pub fn books(&self) -> Option<&Books> {
        self.books.as_ref()
    }
}

/// A buffer of texels with this content, filled up to a whole texel; of one where there is none, because a
/// buffer of no bytes is not allowed.
fn bring<T: Pod>(gpu: &Gpu, name: &str, content: &[T]) -> Result<Buffer> {
    let mut bytes = Cow::Borrowed(bytemuck::cast_slice::<T, u8>(content));
    let whole = bytes.len().next_multiple_of(TEXEL_BYTES as usize).max(TEXEL_BYTES as usize);
    if bytes.len() < whole {
        bytes.to_mut().resize(whole, 0);
    }
    gpu.buffer_with(name, vk::BufferUsageFlags::UNIFORM_TEXEL_BUFFER, &bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device_tests;

    #[test]
    fn halves_are_what_they_stand_for() {
        for value in [0.0, 1.0, -1.0, 0.333_333, 100.0, -99.9, 1e-3, 6.2e-5, 0.999_9] {
            let seen = device_tests::half(half(value));
            assert!((seen - value).abs() <= value.abs() * 0.000_5, "{value} became {seen}");
        }
        assert_eq!((half(1e-9), half(1e9), half(-1e9)), (0, 0x7bff, 0xfbff));
    }
}
