//! From a species to its meshes: grown around the skeleton at rest, with levels of detail, moved by its
//! joints.
//!
//! Limbs are sheets ([`sheet`]) or tubes ([`tube`]) around their middle lines ([`spine`]). A species has
//! three meshes, from young to old, and no two have the same ruffles. `v` goes from a blade's root to its
//! tip, `u` across it. Levels of detail say how far they are from the finest one, measured ([`stray`]).

mod sheet;
mod spine;
mod stock;
pub(crate) mod stray;
mod tube;

use glam::{DQuat, DVec3};
use reef_flow::random::{Random, mix};
use reef_sdk::{
    Host, Mesh, MeshDesc, MeshError,
    abi::{self, MeshLevel, MeshVertex, pack_normal},
};

use crate::{
    grow::{Limb, Part},
    looks::Palette,
    modelled::FLAT,
    skeleton::Skeleton,
    species::Species,
};
pub(crate) use spine::BONES;
use spine::{Spine, Spot};
pub(crate) use stock::Stock;
pub(crate) use tube::ROUND;

/// Meshes of a species, from young plants to old ones.
pub const AGES: usize = 3;

/// How fine a level is.
#[derive(Clone, Copy, Debug)]
struct Fineness {
    /// Rows along limbs, and quads across them, as shares of those of the finest level.
    along: f64,
    across: f64,
    /// Sides of tubes.
    sides: u32,
    /// How much of the waves of edges there is: the coarser of them alone, or none.
    waves: Waves,
    /// Sides and rows of gas bladders; 0: there are none.
    bladder: [u32; 2],
    /// Joints that move a vertex.
    influences: u32,
}

/// Waves of edges that a level has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Waves {
    All,
    Long,
    None,
}

const LEVELS: [Fineness; 4] = [
    Fineness { along: 1.0, across: 1.0, sides: 6, waves: Waves::All, bladder: [5, 3], influences: 4 },
    Fineness { along: 0.5, across: 0.5, sides: 4, waves: Waves::Long, bladder: [4, 2], influences: 2 },
    Fineness { along: 0.12, across: 0.25, sides: 3, waves: Waves::None, bladder: [0, 0], influences: 2 },
    Fineness { along: 0.05, across: 0.0, sides: 3, waves: Waves::None, bladder: [0, 0], influences: 1 },
];

/// A mesh at rest.
#[derive(Clone, Debug, Default)]
pub struct Shape {
    /// At a size of 1.
    pub vertices: Vec<MeshVertex>,
    /// Three a triangle.
    pub indices: Vec<u32>,
    /// The finest first.
    pub levels: Vec<MeshLevel>,
    /// Where the joints stand.
    pub rest: Vec<abi::Joint>,
    /// Four a vertex.
    pub joints: Vec<u32>,
    /// As many, summing to 1.
    pub weights: Vec<f32>,
}

impl Shape {
    /// Hands it to the host. `torn`: its picture has holes.
    ///
    /// # Errors
    /// The host refuses it.
    pub fn upload(&self, host: &Host, name: &str, torn: bool) -> Result<Mesh, MeshError> {
        let cut = if torn { abi::MESH_CUT_OUT } else { 0 };
        host.mesh(&MeshDesc {
            name,
            vertices: &self.vertices,
            indices: &self.indices,
            levels: &self.levels,
            rest: &self.rest,
            influences: BONES as u32,
            joints: &self.joints,
            weights: &self.weights,
            flags: abi::MESH_TWO_SIDED | abi::MESH_DUAL | cut,
        })
    }
}

/// The mesh of a species at an age, 0 young to [`AGES`] − 1 old.
pub fn shape(species: &Species, skeleton: &Skeleton, limbs: &[Limb], age: usize) -> Shape {
    let rest = skeleton.rest();
    let shape = Shape { rest: rest_joints(&rest), ..Shape::default() };
    let mut draft = Draft {
        species,
        skeleton,
        rest,
        limbs,
        palette: Palette::new(species, age),
        ripe: age as f64 / (AGES - 1) as f64 * species.variation.age,
        seed: mix(age as u64 ^ 0x5ea_3eed),
        heights: heights(limbs),
        fine: LEVELS[0],
        shape,
        pieces: Vec::new(),
    };
    for fine in LEVELS {
        draft.level(fine);
    }
    draft.shape
}

/// Joints where segments stand at rest.
pub(crate) fn rest_joints(rest: &[(DVec3, DQuat)]) -> Vec<abi::Joint> {
    let joint = |(origin, turn): &(DVec3, DQuat)| abi::Joint {
        rotation: turn.normalize().as_quat().normalize().to_array(),
        translation: origin.as_vec3().to_array(),
        scale: 1.0,
    };
    rest.iter().map(joint).collect()
}

/// Where each limb begins and ends on the way from the root (0) to the tips (1) of what forks.
fn heights(limbs: &[Limb]) -> Vec<[f64; 2]> {
    let mut ends: Vec<[f64; 2]> = Vec::with_capacity(limbs.len());
    for (i, limb) in limbs.iter().enumerate() {
        let below = limb.on.and_then(|on| limbs[..i].iter().position(|other| other.segments.contains(&on)));
        let start = below.filter(|_| limb.part == Part::Fork).map_or(0.0, |below| ends[below][1]);
        ends.push([start, start + limb.length]);
    }
    let top = ends.iter().map(|[_, end]| *end).fold(1e-9, f64::max);
    ends.iter().map(|[start, end]| [start / top, end / top]).collect()
}

/// A mesh on its way.
struct Draft<'a> {
    species: &'a Species,
    skeleton: &'a Skeleton,
    rest: Vec<(DVec3, DQuat)>,
    limbs: &'a [Limb],
    palette: Palette,
    /// From young (0) to old (1).
    ripe: f64,
    seed: u64,
    heights: Vec<[f64; 2]>,
    fine: Fineness,
    shape: Shape,
    /// The triangles of each limb, level by level: limb, first index, end.
    pieces: Vec<Vec<[usize; 3]>>,
}

/// What a vertex is beside its place.
#[derive(Clone, Copy, Debug)]
struct Tissue {
    normal: DVec3,
    uv: [f64; 2],
    thickness: f64,
    /// sRGB.
    color: u32,
}

impl Draft<'_> {
    fn level(&mut self, fine: Fineness) {
        self.fine = fine;
        let (first_index, first_vertex) = (self.shape.indices.len(), self.shape.vertices.len());
        let mut pieces = Vec::new();
        for number in 0..self.limbs.len() {
            let begin = self.shape.indices.len();
            self.limb(number);
            pieces.push([number, begin, self.shape.indices.len()]);
        }
        let begin = self.shape.indices.len();
        self.holdfast();
        pieces.push([self.limbs.len(), begin, self.shape.indices.len()]);
        let saved = self.shape.levels.last().map_or(u32::MAX, |level| level.index_count / 5 * 4);
        if self.shape.indices.len() - first_index > saved as usize {
            // What saves less than a fifth is no level.
            self.shape.indices.truncate(first_index);
            self.shape.vertices.truncate(first_vertex);
            self.shape.joints.truncate(BONES * first_vertex);
            self.shape.weights.truncate(BONES * first_vertex);
            return;
        }
        self.pieces.push(pieces);
        let error = match self.pieces.as_slice() {
            [finest, .., own] => stray::farthest(&self.shape, finest, own),
            _ => 0.0,
        };
        // Levels must err more and more.
        let before = self.shape.levels.last().map_or(0.0, |level| level.error);
        self.shape.levels.push(MeshLevel {
            first_index: first_index as u32,
            index_count: (self.shape.indices.len() - first_index) as u32,
            first_vertex: first_vertex as u32,
            vertex_count: (self.shape.vertices.len() - first_vertex) as u32,
            error: if first_index == 0 { 0.0 } else { (error as f32).max(1.001 * before) },
            influences: fine.influences,
            ..MeshLevel::default()
        });
    }

    fn limb(&mut self, number: usize) {
        let limb = &self.limbs[number];
        let tissue = match limb.part {
            Part::Blade => &self.species.blades.tissue,
            Part::Stem | Part::Fork => &self.species.stem.tissue,
        };
        let width = tissue.width;
        let spine = Spine::new(self.skeleton, &self.rest, limb, limb.part == Part::Fork);
        let mut random = Random::new(self.seed, number as u64);
        let from = self.bladders(limb, &spine, width);
        if tissue.width <= FLAT * tissue.thickness {
            self.stipe(number, &spine, 0.5 * width);
            if limb.part == Part::Blade && self.species.look.teeth > 0 {
                self.comb(&spine, &mut random);
            }
        } else {
            self.sheet(number, &spine, from, width, tissue.thickness, &mut random);
        }
    }

    /// Adds a vertex; its number.
    fn vertex(&mut self, place: DVec3, spot: &Spot, tissue: &Tissue) -> u32 {
        self.shape.vertices.push(MeshVertex {
            position: place.as_vec3().to_array(),
            normal: pack_normal(tissue.normal.as_vec3().to_array()),
            uv: tissue.uv.map(|x| x as f32),
            thickness: tissue.thickness as f32,
            glow: 1.0,
            color: tissue.color,
            spare: 0,
        });
        self.shape.joints.extend(spot.joints);
        self.shape.weights.extend(spot.weights.map(|weight| weight as f32));
        self.shape.vertices.len() as u32 - 1
    }
}

/// Adds the triangles of a grid of vertices that follow one another, row after row: `rows` by `columns`
/// quads.
pub(crate) fn quads(indices: &mut Vec<u32>, first: u32, rows: u32, columns: u32) {
    for row in 0..rows {
        for column in 0..columns {
            let a = first + row * (columns + 1) + column;
            let b = a + columns + 1;
            indices.extend([a, a + 1, b + 1, a, b + 1, b]);
        }
    }
}

#[cfg(test)]
mod tests;
