//! The skinned mesh of a file, as it stands where the file's nodes are.

use core::ops::Range;

use glam::{DMat4, DVec2, DVec3};
use gltf_json::{
    Index,
    accessor::{Accessor, Type},
    mesh::{Mode, Primitive, Semantic},
    validation::Checked,
};

use super::{
    file::{Fault, File},
    rig::Bone,
};

/// Most vertices and triangles of a file.
pub const MOST_VERTICES: usize = 20_000;
/// Triangles.
pub const MOST_TRIANGLES: usize = 20_000;

/// How far the weights of a vertex may be from 1 in all.
const UNEVEN: f32 = 0.01;

/// A corner of the mesh at rest.
#[derive(Clone, Debug, PartialEq)]
pub struct Corner {
    /// Relative to the root [m].
    pub place: DVec3,
    /// Unit.
    pub normal: DVec3,
    /// Across, and from root to tip; None: the file says nothing.
    pub uv: Option<DVec2>,
    /// Linear, multiplies the species' colours.
    pub color: [f64; 3],
    /// Bones that move it, the strongest first.
    pub bones: [usize; 4],
    /// Summing to 1.
    pub weights: [f64; 4],
}

/// A mesh at rest.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Skin {
    /// Its corners.
    pub corners: Vec<Corner>,
    /// Three a triangle.
    pub indices: Vec<u32>,
}

/// The number of the skin that counts: that of the first mesh which has one, or the first of all.
pub(super) fn number(file: &File<'_>) -> Option<usize> {
    let skinned = file.root.nodes.iter().filter(|node| node.mesh.is_some());
    let first = skinned.filter_map(|node| node.skin).map(|skin| skin.value()).next();
    first.or((!file.root.skins.is_empty()).then_some(0))
}

/// What takes a vertex to the plant's space, for each of the skin's joints.
fn movers(file: &File<'_>, skin: usize, bones: &[Bone], listed: &[usize]) -> Result<Vec<DMat4>, Fault> {
    let path = format!("skins[{skin}].inverseBindMatrices");
    let Some(at) = file.root.skins[skin].inverse_bind_matrices else {
        return Ok(listed.iter().map(|bone| bones[*bone].base).collect());
    };
    let (numbers, _) = file.numbers(at, &[Type::Mat4], usize::from(u16::MAX))?;
    if numbers.len() < 16 * listed.len() {
        let problem = format!("has {} matrices for {} joints", numbers.len() / 16, listed.len());
        return Err(Fault::new(path, problem));
    }
    let matrix = |own: &[f32]| DMat4::from_cols_array(&core::array::from_fn(|i| f64::from(own[i])));
    Ok(listed
        .iter()
        .zip(numbers.chunks_exact(16))
        .map(|(bone, own)| bones[*bone].base * matrix(own))
        .collect())
}

/// The accessor of an attribute.
fn attribute(of: &Primitive, semantic: Semantic) -> Option<Index<Accessor>> {
    of.attributes.get(&Checked::Valid(semantic)).copied()
}

/// All meshes that hang on a skin.
///
/// # Errors
/// What is missing, too much, or leads nowhere.
pub(super) fn read(file: &File<'_>, skin: usize, bones: &[Bone], listed: &[usize]) -> Result<Skin, Fault> {
    let movers = movers(file, skin, bones, listed)?;
    let mut all = Skin::default();
    let on_skin = |node: &&gltf_json::Node| node.skin.is_some_and(|own| own.value() == skin);
    for mesh in file.root.nodes.iter().filter(on_skin).filter_map(|node| node.mesh) {
        for (i, primitive) in file.root.meshes[mesh.value()].primitives.iter().enumerate() {
            let path = format!("meshes[{}].primitives[{i}]", mesh.value());
            add(file, primitive, &path, &movers, listed, &mut all)?;
        }
    }
    Ok(all)
}

/// Adds a primitive.
fn add(
    file: &File<'_>,
    primitive: &Primitive,
    path: &str,
    movers: &[DMat4],
    listed: &[usize],
    all: &mut Skin,
) -> Result<(), Fault> {
    if primitive.mode != Checked::Valid(Mode::Triangles) {
        return Err(Fault::new(format!("{path}.mode"), "must be triangles (4)"));
    }
    let needed = |semantic: Semantic, name: &str| {
        let path = format!("{path}.attributes.{name}");
        attribute(primitive, semantic).ok_or_else(|| Fault::new(path, "is missing: a skinned mesh has it"))
    };
    let room = MOST_VERTICES - all.corners.len();
    let floats = |at: Index<Accessor>, shapes: &[Type]| file.numbers(at, shapes, room);
    let (places, _) = floats(needed(Semantic::Positions, "POSITION")?, &[Type::Vec3])?;
    let (weights, _) = floats(needed(Semantic::Weights(0), "WEIGHTS_0")?, &[Type::Vec4])?;
    let joints = file.counts(needed(Semantic::Joints(0), "JOINTS_0")?, Type::Vec4, room)?;
    let count = places.len() / 3;
    let optional = |semantic: Semantic, shapes: &[Type]| {
        attribute(primitive, semantic).map(|at| floats(at, shapes)).transpose()
    };
    let normals = optional(Semantic::Normals, &[Type::Vec3])?;
    let uvs = optional(Semantic::TexCoords(0), &[Type::Vec2])?;
    let colors = optional(Semantic::Colors(0), &[Type::Vec3, Type::Vec4])?;
    let lengths = [
        ("WEIGHTS_0", weights.len() / 4),
        ("JOINTS_0", joints.len() / 4),
        ("NORMAL", normals.as_ref().map_or(count, |(all, _)| all.len() / 3)),
        ("TEXCOORD_0", uvs.as_ref().map_or(count, |(all, _)| all.len() / 2)),
        ("COLOR_0", colors.as_ref().map_or(count, |(all, width)| all.len() / width)),
    ];
    if let Some((name, length)) = lengths.into_iter().find(|(_, length)| *length != count) {
        let problem = format!("has {length} elements for {count} positions");
        return Err(Fault::new(format!("{path}.attributes.{name}"), problem));
    }
    let first = all.corners.len() as u32;
    for vertex in 0..count {
        let hang = |i: usize| (weights[4 * vertex + i], joints[4 * vertex + i] as usize);
        let sum: f32 = (0..4).map(|i| hang(i).0).sum();
        if (sum - 1.0).abs() > UNEVEN || (0..4).any(|i| hang(i).0 < 0.0) {
            let problem = format!(
                "of vertex {vertex} sum to {sum}; they must sum to 1, of at most four joints a vertex"
            );
            return Err(Fault::new(format!("{path}.attributes.WEIGHTS_0"), problem));
        }
        let mut hung: [(f32, usize); 4] = core::array::from_fn(hang);
        if let Some((_, joint)) = hung.iter().find(|(weight, joint)| *weight > 0.0 && *joint >= listed.len())
        {
            let problem = format!("of vertex {vertex} has {joint}; the skin has {} joints", listed.len());
            return Err(Fault::new(format!("{path}.attributes.JOINTS_0"), problem));
        }
        hung.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut mover = DMat4::ZERO;
        for (weight, joint) in hung.iter().filter(|(weight, _)| *weight > 0.0) {
            mover += movers[*joint] * f64::from(weight / sum);
        }
        let vector = |of: &[f32]| DVec3::from([0, 1, 2].map(|i| f64::from(of[3 * vertex + i])));
        let normal = normals.as_ref().map_or(DVec3::ZERO, |(all, _)| vector(all));
        all.corners.push(Corner {
            place: mover.transform_point3(vector(&places)),
            normal: mover.transform_vector3(normal).normalize_or_zero(),
            // A picture's rows go down, a blade goes up.
            uv: uvs.as_ref().map(|(all, _)| {
                let [u, v] = [all[2 * vertex], all[2 * vertex + 1]].map(f64::from);
                DVec2::new(u, 1.0 - v).clamp(DVec2::ZERO, DVec2::ONE)
            }),
            color: colors.as_ref().map_or([1.0; 3], |(all, width)| {
                [0, 1, 2].map(|i| f64::from(all[width * vertex + i]).clamp(0.0, 1.0))
            }),
            bones: hung.map(|(weight, joint)| listed[if weight > 0.0 { joint } else { hung[0].1 }]),
            weights: hung.map(|(weight, _)| f64::from(weight / sum)),
        });
    }
    let indices = match primitive.indices {
        Some(at) => file.counts(at, Type::Scalar, 3 * MOST_TRIANGLES - all.indices.len())?,
        None => (0..count as u32).collect(),
    };
    if indices.is_empty() || indices.len() % 3 != 0 {
        return Err(Fault::new(
            format!("{path}.indices"),
            format!("are {}, which make no triangles", indices.len()),
        ));
    }
    if let Some(beyond) = indices.iter().find(|index| **index as usize >= count) {
        return Err(Fault::new(format!("{path}.indices"), format!("name vertex {beyond} of {count}")));
    }
    let own = all.indices.len();
    all.indices.extend(indices.iter().map(|index| first + index));
    if all.indices.len() > 3 * MOST_TRIANGLES {
        let problem = format!("make more than {MOST_TRIANGLES} triangles");
        return Err(Fault::new(format!("{path}.indices"), problem));
    }
    if normals.is_none() {
        smooth(all, own..all.indices.len());
    }
    Ok(())
}

/// Normals of the corners of some triangles, which have none yet: the mean of those around them.
pub(super) fn smooth(skin: &mut Skin, indices: Range<usize>) {
    for triangle in skin.indices[indices].chunks_exact(3) {
        let [a, b, c] = [0, 1, 2].map(|i| skin.corners[triangle[i] as usize].place);
        let normal = (b - a).cross(c - a);
        for corner in triangle {
            skin.corners[*corner as usize].normal += normal;
        }
    }
}
