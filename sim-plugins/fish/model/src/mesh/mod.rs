//! From a species to its skin: grown around the sections at rest, with levels of detail, moved by the frames
//! of the segments ([`crate::frames`]).
//!
//! A mesh is made of patches: the body ([`outline`]), its fins ([`fins`]), its eyes ([`eyes`]). Each is a
//! surface over the unit square, so a level's rows and columns are all that differs between levels, and how
//! far a level strays is measured against the surface itself. `v` goes from the nose to the tail fin's edge;
//! `u` from the back over the sides to the belly, and from there on over the fins ([`crate::paint`]).

mod eyes;
mod fins;
pub mod outline;

use glam::DVec3;
use reef_sdk::{
    Host, Mesh, MeshDesc, MeshError,
    abi::{Joint, MeshLevel, MeshVertex, pack_normal},
};

use crate::{Plan, frames::sections, species::Species};
use outline::Outline;

/// Joints that move a vertex at most.
pub const BONES: usize = 4;

/// How fine a level is.
#[derive(Clone, Copy, Debug)]
struct Fineness {
    /// Rings of the body, and vertices of a ring.
    body: [u32; 2],
    /// Rows and columns of fins; 0: only the tail's is there.
    fin: [u32; 2],
    /// Rows and columns of eyes; 0: there are none.
    eye: [u32; 2],
    /// Joints that move a vertex.
    influences: u32,
}

/// The last two are for shoals: a thousand of them cost what one of the first does.
const LEVELS: [Fineness; 5] = [
    Fineness { body: [44, 24], fin: [12, 4], eye: [4, 12], influences: 4 },
    Fineness { body: [20, 12], fin: [6, 2], eye: [2, 6], influences: 4 },
    Fineness { body: [12, 8], fin: [4, 1], eye: [1, 4], influences: 2 },
    Fineness { body: [7, 4], fin: [2, 1], eye: [0, 0], influences: 2 },
    Fineness { body: [3, 4], fin: [0, 0], eye: [0, 0], influences: 1 },
];
/// How often, and how far at first in cells, a nearer place of a surface is looked for.
const NEARER: [f64; 4] = [0.5, 0.25, 0.125, 0.0625];
/// Half of the step between two places by which a normal is found.
const NUDGE: f64 = 2e-3;

/// A mesh at rest.
#[derive(Clone, Debug, Default)]
pub struct Shape {
    /// At a size of 1.
    pub vertices: Vec<MeshVertex>,
    /// Three a triangle.
    pub indices: Vec<u32>,
    /// The finest first.
    pub levels: Vec<MeshLevel>,
    /// Where the joints stand, nose first.
    pub rest: Vec<Joint>,
    /// [`BONES`] a vertex.
    pub joints: Vec<u32>,
    /// As many, summing to 1.
    pub weights: Vec<f32>,
    /// No vertex is farther from the origin [m].
    pub radius: f64,
}

impl Shape {
    /// Hands it to the host.
    ///
    /// # Errors
    /// The host refuses it.
    pub fn upload(&self, host: &Host, name: &str) -> Result<Mesh, MeshError> {
        host.mesh(&MeshDesc {
            name,
            vertices: &self.vertices,
            indices: &self.indices,
            levels: &self.levels,
            rest: &self.rest,
            influences: BONES as u32,
            joints: &self.joints,
            weights: &self.weights,
            flags: 0,
        })
    }
}

/// The mesh of a species.
pub fn shape(species: &Species, plan: &Plan) -> Shape {
    let mut rest = vec![Joint::default(); plan.body().segments().len()];
    sections(plan, &plan.rest, 1.0, &mut rest);
    let outline = Outline::new(species);
    let mut draft = Draft { outline: &outline, shape: Shape { rest, ..Shape::default() } };
    for fine in LEVELS {
        draft.level(species, fine);
    }
    let far = |vertex: &MeshVertex| glam::Vec3::from(vertex.position).length();
    draft.shape.radius = f64::from(draft.shape.vertices.iter().map(far).fold(0.0, f32::max));
    draft.shape
}

/// Where places of the unit square are at rest [m].
type Surface<'a> = &'a dyn Fn(f64, f64) -> DVec3;

/// A surface over the unit square.
struct Patch<'a> {
    at: Surface<'a>,
    /// Its place on the picture.
    uv: &'a dyn Fn(f64, f64) -> [f64; 2],
    /// How thick it is [m].
    thickness: &'a dyn Fn(f64, f64) -> f64,
    /// Where along the body all of it is moved from [m]; None: each place from beside it.
    root: Option<f64>,
    /// sRGB, times the picture's.
    color: u32,
}

/// Colour of what shows the picture as it is.
const PLAIN: u32 = 0xffff_ffff;

/// A mesh on its way.
struct Draft<'a> {
    outline: &'a Outline,
    shape: Shape,
}

impl Draft<'_> {
    fn level(&mut self, species: &Species, fine: Fineness) {
        let (first_index, first_vertex) = (self.shape.indices.len(), self.shape.vertices.len());
        let mut strays = self.body(fine.body);
        strays = strays.max(self.fins(species, fine.fin));
        let eyes = self.eyes(&species.look, fine.eye);
        strays = strays.max(eyes);
        // Levels must err more and more.
        let before = self.shape.levels.last().map_or(0.0, |level| level.error);
        self.shape.levels.push(MeshLevel {
            first_index: first_index as u32,
            index_count: (self.shape.indices.len() - first_index) as u32,
            first_vertex: first_vertex as u32,
            vertex_count: (self.shape.vertices.len() - first_vertex) as u32,
            error: if first_index == 0 { 0.0 } else { (strays as f32).max(1.001 * before) },
            influences: fine.influences,
            ..MeshLevel::default()
        });
    }

    /// The body without fins; how far it strays from its surface [m].
    fn body(&mut self, size: [u32; 2]) -> f64 {
        let outline = self.outline;
        // Rings are closer at the head.
        let along = |a: f64| outline.end * a * (0.55 + 0.45 * a);
        let at = |a: f64, b: f64| outline.skin(along(a), b);
        let uv = |a: f64, b: f64| {
            let round = if b <= 0.5 { b } else { 1.0 - b };
            [round.clamp(SEAM, 0.5 - SEAM), along(a)]
        };
        let thickness = |a: f64, _: f64| 2.0 * outline.extent(along(a))[1];
        self.patch(&Patch { at: &at, uv: &uv, thickness: &thickness, root: None, color: PLAIN }, size)
    }

    /// Adds a surface in so many rows and columns; how far it strays [m].
    fn patch(&mut self, patch: &Patch<'_>, [rows, columns]: [u32; 2]) -> f64 {
        let first = self.shape.vertices.len() as u32;
        let share = |i: u32, of: u32| f64::from(i) / f64::from(of);
        for row in 0..=rows {
            for column in 0..=columns {
                self.vertex(patch, share(row, rows), share(column, columns));
            }
        }
        let mut strays: f64 = 0.0;
        for row in 0..rows {
            for column in 0..columns {
                let a = first + row * (columns + 1) + column;
                let b = a + columns + 1;
                self.shape.indices.extend([a, b, b + 1, a, b + 1, a + 1]);
                let place = |i: u32| glam::Vec3::from(self.shape.vertices[i as usize].position).as_dvec3();
                // In the middles of a quad, of its rear edge and of its side.
                let (x, y) = (share(2 * row + 1, 2 * rows), share(2 * column + 1, 2 * columns));
                let (x1, y1) = (share(row + 1, rows), share(column + 1, columns));
                let cell = [1.0 / f64::from(rows), 1.0 / f64::from(columns)];
                let middles = [
                    (place(a).midpoint(place(b + 1)), [x, y]),
                    (place(b).midpoint(place(b + 1)), [x1, y]),
                    (place(a + 1).midpoint(place(b + 1)), [x, y1]),
                ];
                let off = middles.iter().map(|(flat, place)| distance(patch.at, *flat, *place, cell));
                strays = off.fold(strays, f64::max);
            }
        }
        strays
    }

    fn vertex(&mut self, patch: &Patch<'_>, a: f64, b: f64) {
        let place = (patch.at)(a, b);
        // At the edges from within.
        let (x, y) = (a.clamp(NUDGE, 1.0 - NUDGE), b.clamp(NUDGE, 1.0 - NUDGE));
        let along = (patch.at)(x + NUDGE, y) - (patch.at)(x - NUDGE, y);
        let across = (patch.at)(x, y + NUDGE) - (patch.at)(x, y - NUDGE);
        let normal = along.cross(across).normalize_or(DVec3::Y);
        self.shape.vertices.push(MeshVertex {
            position: place.as_vec3().to_array(),
            normal: pack_normal(normal.as_vec3().to_array()),
            uv: (patch.uv)(a, b).map(|x| x as f32),
            thickness: (patch.thickness)(a, b) as f32,
            glow: 1.0,
            color: patch.color,
            spare: 0,
        });
        let (joints, weights) =
            bones(self.outline.station(patch.root.unwrap_or(place.x)), self.shape.rest.len());
        self.shape.joints.extend(joints);
        self.shape.weights.extend(weights);
    }
}

/// How far a place is from a surface [m], which is looked for around a place of the unit square, less than a
/// cell from it.
fn distance(at: Surface<'_>, flat: DVec3, [mut x, mut y]: [f64; 2], cell: [f64; 2]) -> f64 {
    let mut least = at(x, y).distance(flat);
    for step in NEARER {
        for (dx, dy) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)] {
            let (u, v) =
                ((x + dx * step * cell[0]).clamp(0.0, 1.0), (y + dy * step * cell[1]).clamp(0.0, 1.0));
            let off = at(u, v).distance(flat);
            if off < least {
                (least, x, y) = (off, u, v);
            }
        }
    }
    least
}

/// No part of the body takes its colour from nearer to the picture's seams.
const SEAM: f64 = 0.004;

/// The joints that move what is at `station` [joints from the nose], by a cubic B-spline: no ring shows
/// where one goes over into the next. Less than a joint from the ends its weights go over into linear ones:
/// the nose and the tail fin's edge are where the body's nodes are.
fn bones(station: f64, count: usize) -> ([u32; BONES], [f32; BONES]) {
    let last = count.saturating_sub(1);
    let first = (station.max(0.0) as usize).min(last);
    let t = (station - first as f64).clamp(0.0, 1.0);
    let left = 1.0 - t;
    let spline = [
        left * left * left,
        (3.0 * t - 6.0) * t * t + 4.0,
        (3.0 * left - 6.0) * left * left + 4.0,
        t * t * t,
    ];
    let inner = station.min(last as f64 - station).clamp(0.0, 1.0);
    let linear = [0.0, left, t, 0.0];
    let mut joints = [0; BONES];
    let mut weights = [0.0; BONES];
    for (i, (weight, linear)) in spline.iter().zip(linear).enumerate() {
        let joint = (first + i).saturating_sub(1).min(last);
        joints[i] = joint as u32;
        // What would be beyond the ends counts for the ends, once.
        let same = (0..i).find(|other| joints[*other] == joint as u32).unwrap_or(i);
        weights[same] += (linear + (weight / 6.0 - linear) * inner) as f32;
    }
    (joints, weights)
}

#[cfg(test)]
mod tests;
