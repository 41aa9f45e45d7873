//! How wide a mesh is across, vertex by vertex: what a blade or a stem that is thinner than a pixel is
//! widened by (`shaders/mesh_skin.comp`).
//!
//! A *row* is what edges join along which v does not change: the two edges of a blade and what is between
//! them, or a ring around a stem. It has a middle, an axis (the way to the rows with greater v) and, across
//! that, half axes W, to its farthest vertex, and M.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use reef_abi::{MeshVertex, pack_normal};
use reef_streams::meshes::Mesh;

use super::library::half;

/// Where a vertex is in its row, packed: `rest_row_at` of `shaders/mesh_texels.glsl` makes a `RestRow` of it.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct GpuRow {
    /// Along, unit, on an octahedron.
    pub axis: u32,
    /// The way of W, unit, on an octahedron.
    pub wide: u32,
    /// Two halves: |W|, |M| [m]; both 0: it has no row. M is negative in a ring.
    pub half: u32,
    /// Two halves: from the row's middle to the vertex along W and along M, in |W|.
    pub place: u32,
}

/// Of a level that is never widened [m].
pub const WIDE: f32 = 1e9;

/// Vertices that are so near are one [m].
const SAME: f32 = 1e-6;
/// What has more corners is no ring around a stem.
const MOST_CORNERS: usize = 64;

/// One row on its way.
#[derive(Clone, Copy, Debug, Default)]
struct Row {
    middle: Vec3,
    count: f32,
    ring: bool,
    axis: Vec3,
    wide: Vec3,
    /// |M|
    deep: f32,
}

/// The rows of a mesh's vertices, and of each level the half width of most of its surface [m].
pub fn rows(mesh: &Mesh) -> (Vec<GpuRow>, Vec<f32>) {
    let numbers = join(&mesh.vertices, &mesh.indices);
    let mut rows = vec![Row::default(); mesh.vertices.len()];
    let mut known: Vec<Vec<Vec3>> = vec![Vec::new(); mesh.vertices.len()];
    for (vertex, number) in mesh.vertices.iter().zip(&numbers) {
        let (row, known) = (&mut rows[*number as usize], &mut known[*number as usize]);
        let place = Vec3::from(vertex.position);
        // The seam of a ring stands twice.
        if known.len() < MOST_CORNERS && known.iter().any(|other| other.distance(place) < SAME) {
            row.ring = true;
            continue;
        }
        row.middle += place;
        row.count += 1.0;
        known.push(place);
    }
    rows.iter_mut().filter(|row| row.count > 0.0).for_each(|row| row.middle /= row.count);
    for triangle in mesh.indices.chunks_exact(3) {
        for (a, b) in [(0, 1), (1, 2), (2, 0)].map(|(a, b)| (triangle[a] as usize, triangle[b] as usize)) {
            let up = mesh.vertices[b].uv[1] - mesh.vertices[a].uv[1];
            let [a, b] = [a, b].map(|i| numbers[i] as usize);
            let way = (rows[b].middle - rows[a].middle) * up.signum();
            if a != b {
                rows[a].axis += way;
                rows[b].axis += way;
            }
        }
    }
    let off =
        |rows: &[Row], i: usize| Vec3::from(mesh.vertices[i].position) - rows[numbers[i] as usize].middle;
    for i in 0..mesh.vertices.len() {
        let own = off(&rows, i);
        let row = &mut rows[numbers[i] as usize];
        if own.length_squared() > row.wide.length_squared() {
            row.wide = own;
        }
    }
    for row in &mut rows {
        row.axis = row.axis.normalize_or_zero();
    }
    for (i, vertex) in mesh.vertices.iter().enumerate() {
        let own = off(&rows, i);
        let row = &mut rows[numbers[i] as usize];
        let least = (0.5 * vertex.thickness).min(row.wide.length());
        row.deep = row.deep.max(own.dot(row.across()).abs()).max(least);
    }
    let packed = (0..mesh.vertices.len()).map(|i| rows[numbers[i] as usize].packed(off(&rows, i))).collect();
    let slim = mesh.levels.iter().map(|level| {
        let own = &mesh.indices[level.first_index as usize..][..level.index_count as usize];
        slim(own, &mesh.vertices, |i| &rows[numbers[i as usize] as usize])
    });
    (packed, slim.collect())
}

/// Half the width that most of some triangles' area has [m]; [`WIDE`] where most of it is in no row.
fn slim<'a>(indices: &[u32], vertices: &[MeshVertex], row: impl Fn(u32) -> &'a Row) -> f32 {
    let (mut area, mut sized, mut sum) = (0.0, 0.0, 0.0);
    for t in indices.chunks_exact(3) {
        let [a, b, c] = [t[0], t[1], t[2]].map(|i| Vec3::from(vertices[i as usize].position));
        let own = (b - a).cross(c - a).length();
        let widest = t.iter().map(|i| row(*i)).filter(|row| row.is_one()).map(|row| row.wide.length());
        area += own;
        if let Some(widest) = widest.reduce(f32::max) {
            sized += own;
            sum += own * widest;
        }
    }
    if sized < 0.5 * area || sized <= 0.0 { WIDE } else { sum / sized }
}

/// The first vertex of each vertex's row.
fn join(vertices: &[MeshVertex], indices: &[u32]) -> Vec<u32> {
    let mut parents: Vec<u32> = (0..vertices.len() as u32).collect();
    fn root(parents: &mut [u32], mut at: u32) -> u32 {
        while parents[at as usize] != at {
            let above = parents[parents[at as usize] as usize];
            parents[at as usize] = above;
            at = above;
        }
        at
    }
    for t in indices.chunks_exact(3) {
        for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
            if vertices[a as usize].uv[1] == vertices[b as usize].uv[1] {
                let [a, b] = [root(&mut parents, a), root(&mut parents, b)];
                parents[a.max(b) as usize] = a.min(b);
            }
        }
    }
    (0..vertices.len() as u32).map(|i| root(&mut parents, i)).collect()
}

impl Row {
    /// Whether it has a width and an axis.
    fn is_one(&self) -> bool {
        self.count > 1.0 && self.wide != Vec3::ZERO && self.axis != Vec3::ZERO
    }

    /// The way of M, unit.
    fn across(&self) -> Vec3 {
        self.axis.cross(self.wide).normalize_or_zero()
    }

    fn packed(&self, off: Vec3) -> GpuRow {
        if !self.is_one() {
            return GpuRow::default();
        }
        let (size, deep) = (self.wide.length(), self.deep.max(MIN_DEPTH));
        let along = [off.dot(self.wide) / (size * size), off.dot(self.across()) / size];
        GpuRow {
            axis: pack_normal(self.axis.to_array()),
            wide: pack_normal((self.wide / size).to_array()),
            half: half(size.max(MIN_DEPTH)) | half(if self.ring { -deep } else { deep }) << 16,
            place: half(along[0]) | half(along[1]) << 16,
        }
    }
}

/// What halves can tell from 0 [m].
const MIN_DEPTH: f32 = 1e-4;
