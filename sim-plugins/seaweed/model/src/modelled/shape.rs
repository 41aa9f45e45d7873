//! The mesh of a modelled plant as the host takes it, with coarser levels of detail; and one for a plant that
//! has joints alone.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3};
use reef_flow::math::cos_sin_f64;
use reef_sdk::abi::{MeshLevel, MeshVertex, pack_normal};

use super::{Bone, Corner, Model, Skin, rig::whole};
use crate::{
    looks::Palette,
    mesh::{BONES, ROUND, Shape, quads, rest_joints, stray},
    skeleton::Skeleton,
    species::{Species, Tissue},
};

/// Edges of the cells in which a level's corners become one, as shares of the plant's extent, and joints that
/// move a corner.
const COARSER: [(f64, u32); 3] = [(1.0 / 96.0, 2), (1.0 / 40.0, 2), (1.0 / 16.0, 1)];

/// Sides of a bone that is round, and its rows.
const SIDES: u32 = 5;
const ROWS: u32 = 3;

/// What is wider than so many times its thickness is flat.
pub(crate) const FLAT: f64 = 2.2;

/// The mesh of a model whose segments are those of a skeleton.
pub(crate) fn shape(model: &Model, species: &Species, skeleton: &Skeleton) -> Shape {
    let palette = Palette::new(species, 0);
    let mut shape = Shape { rest: rest_joints(&skeleton.rest()), ..Shape::default() };
    let whole = whole(&model.bones);
    let vertex = |shape: &mut Shape, corner: &Corner| {
        let bone = &model.bones[corner.bones[0]];
        let tissue = model.tissue(species, corner.bones[0]);
        let up = bone.along + (corner.place - bone.origin).dot(bone.up);
        let uv = corner.uv.unwrap_or(DVec2::new(ROUND, (up / whole).clamp(0.0, 1.0)));
        let stem = if tissue.width <= FLAT * tissue.thickness { 1.0 } else { 0.0 };
        shape.vertices.push(MeshVertex {
            position: corner.place.as_vec3().to_array(),
            normal: pack_normal(corner.normal.normalize_or(DVec3::Y).as_vec3().to_array()),
            uv: uv.as_vec2().to_array(),
            thickness: tissue.thickness as f32,
            glow: 1.0,
            color: palette.tinted(stem, corner.color),
            spare: 0,
        });
        shape.joints.extend(corner.bones.map(|bone| model.moving[bone] as u32));
        shape.weights.extend(corner.weights.map(|weight| weight as f32));
    };
    model.skin.corners.iter().for_each(|corner| vertex(&mut shape, corner));
    shape.indices.extend(&model.skin.indices);
    shape.levels.push(level(&shape, 0, 0, BONES as u32, 0.0));
    let (low, high) = model.skin.corners.iter().fold((DVec3::MAX, DVec3::MIN), |(low, high), corner| {
        (low.min(corner.place), high.max(corner.place))
    });
    let extent = (high - low).length();
    let finest = [0, 0, shape.indices.len()];
    for (share, influences) in COARSER {
        let (corners, indices) = clustered(&model.skin, share * extent);
        let before = shape.levels[shape.levels.len() - 1];
        if indices.is_empty() || indices.len() > before.index_count as usize / 5 * 4 {
            continue;
        }
        let (first_index, first_vertex) = (shape.indices.len(), shape.vertices.len());
        corners.iter().for_each(|corner| vertex(&mut shape, &model.skin.corners[*corner as usize]));
        shape.indices.extend(indices.iter().map(|index| first_vertex as u32 + index));
        let strays = stray::farthest(&shape, &[finest], &[[0, first_index, shape.indices.len()]]);
        let error = (strays as f32).max(1.001 * before.error).max(f32::MIN_POSITIVE);
        shape.levels.push(level(&shape, first_index, first_vertex, influences, error));
    }
    shape
}

/// The level of all that follows a first index and a first vertex.
fn level(shape: &Shape, index: usize, vertex: usize, influences: u32, error: f32) -> MeshLevel {
    MeshLevel {
        first_index: index as u32,
        index_count: (shape.indices.len() - index) as u32,
        first_vertex: vertex as u32,
        vertex_count: (shape.vertices.len() - vertex) as u32,
        error,
        influences,
        ..MeshLevel::default()
    }
}

/// Corners by cells of a lattice: the first in each stands for all that hang on the same bone there. Which
/// they are, and the triangles that are left among them.
fn clustered(skin: &Skin, cell: f64) -> (Vec<u32>, Vec<u32>) {
    let mut known = BTreeMap::new();
    let mut kept = Vec::new();
    let stand_ins: Vec<u32> = (0..)
        .zip(&skin.corners)
        .map(|(number, corner)| {
            let at = (corner.place / cell.max(1e-9)).round().to_array().map(|x| x as i64);
            *known.entry((at, corner.bones[0])).or_insert_with(|| {
                kept.push(number);
                kept.len() as u32 - 1
            })
        })
        .collect();
    let triangles = skin.indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]].map(|i| stand_ins[i as usize]));
    let whole = triangles.filter(|[a, b, c]| a != b && b != c && c != a);
    (kept, whole.flatten().collect())
}

/// Tubes or ribbons along bones that have no mesh.
pub(super) fn along<'a>(bones: &[Bone], tissue_of: impl Fn(usize) -> &'a Tissue) -> Skin {
    let mut skin = Skin::default();
    let whole = whole(bones);
    for (number, bone) in bones.iter().enumerate() {
        let tissue = tissue_of(number);
        let goes_on = |other: &Bone, end: DVec3| other.origin.distance(end) < 0.02 * bone.length;
        let end = bone.origin + bone.up * bone.length;
        let below = bone.parent.filter(|parent| {
            let below = &bones[*parent];
            goes_on(bone, below.origin + below.up * below.length)
        });
        let above = bones.iter().position(|other| other.parent == Some(number) && goes_on(other, end));
        let x = bone.base.transform_vector3(DVec3::X);
        let across = (x - bone.up * bone.up.dot(x)).normalize_or(bone.up.any_orthonormal_vector());
        let out = across.cross(bone.up);
        let flat = tissue.width > FLAT * tissue.thickness;
        let sides = if flat { 1 } else { SIDES };
        let first = skin.corners.len() as u32;
        for row in 0..=ROWS {
            let t = f64::from(row) / f64::from(ROWS);
            // Both sides of a joint move its ring alike.
            let (other, share) = match (below, above) {
                (Some(below), _) if row == 0 => (below, 0.5),
                (_, Some(above)) if row == ROWS => (above, 0.5),
                _ => (number, 0.0),
            };
            let taper = if above.is_none() { (1.0 - t * t * t).max(0.1) } else { 1.0 };
            for side in 0..=sides {
                let u = f64::from(side) / f64::from(sides);
                let (cos, sin) = cos_sin_f64(core::f64::consts::TAU * u);
                let (way, normal) = match flat {
                    true => (across * (2.0 * u - 1.0), out),
                    false => (across * cos + out * sin, across * cos + out * sin),
                };
                skin.corners.push(Corner {
                    place: bone.origin + bone.up * (t * bone.length) + way * (0.5 * tissue.width * taper),
                    normal,
                    // A flat one shows the whole picture's width.
                    uv: flat.then(|| DVec2::new(u, ((bone.along + t * bone.length) / whole).min(1.0))),
                    color: [1.0; 3],
                    bones: [number, other, number, number],
                    weights: [1.0 - share, share, 0.0, 0.0],
                });
            }
        }
        quads(&mut skin.indices, first, ROWS, sides);
    }
    skin
}
