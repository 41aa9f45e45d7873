//! Meshes that instances made: what a plugin gave is looked at once, here, so that nothing that is drawn
//! later can lead outside.

use std::fmt::Display;

use glam::Vec3;
use reef_abi as abi;

use crate::{
    check::{FARTHEST_LOCAL, meshes::joint as check_joint},
    retained::{List, Retained, Store},
};

/// Most meshes that one instance may have at a time.
pub const MOST_MESHES: usize = 256;
/// Most vertices of a mesh.
pub const MOST_VERTICES: u32 = 1 << 20;
/// Flags of meshes that mean something here.
pub const FLAGS: u32 = abi::MESH_DUAL | abi::MESH_TWO_SIDED | abi::MESH_CUT_OUT;
/// Most vertices of all meshes of an instance.
pub const MOST_VERTICES_IN_ALL: usize = 1 << 22;
/// Most indices of all meshes of one instance.
pub const MOST_INDICES_IN_ALL: usize = 1 << 24;
/// Most indices of a mesh.
pub const MOST_INDICES: u32 = 1 << 22;
/// Most levels of detail.
pub const MOST_LEVELS: u32 = 8;
/// Most joints.
pub const MOST_JOINTS: u32 = 256;
/// How far from 1 weights may sum to.
const WEIGHT_TOLERANCE: f32 = 1e-3;
/// What the weights of a vertex sum to as they are kept.
pub const WHOLE: u32 = 0xffff;
/// Farthest texture coordinate.
const FARTHEST_UV: f32 = 100.0;

/// One mesh, looked at.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    /// What elements call it.
    pub id: u32,
    /// For messages and debuggers.
    pub name: String,
    /// At rest.
    pub vertices: Vec<abi::MeshVertex>,
    /// Three a triangle.
    pub indices: Vec<u32>,
    /// The finest first.
    pub levels: Vec<abi::MeshLevel>,
    /// Where the joints stand at rest.
    pub rest: Vec<abi::Joint>,
    /// Joints that move a vertex: 0, 1, 2, 4 or 8.
    pub influences: u32,
    /// As many a vertex, the greatest first: the joint, and in the high half its weight, all of a vertex
    /// summing to [`WHOLE`].
    pub bones: Vec<u32>,
    /// `abi::MESH_*`.
    pub flags: u32,
    /// Farthest that a vertex is from each joint that moves it, at rest [m].
    pub reach: Vec<f32>,
    /// Bounding sphere of the vertices at rest: its middle and radius [m].
    pub bounds: [f32; 4],
    /// No vertex lets light through by its opacity.
    pub opaque: bool,
    /// Of all that the plugin gave: what is the same has the same.
    pub hash: [u8; 32],
}

impl Retained for Mesh {
    const WHAT: &'static str = "mesh";
    const MANY: &'static str = "meshes";
    const MOST: usize = MOST_MESHES;

    fn id(&self) -> u32 {
        self.id
    }

    fn name(&self) -> &str {
        &self.name
    }

    fn hash(&self) -> &[u8; 32] {
        &self.hash
    }
}

/// The meshes of one instance, in the order of their ids.
pub type MeshList = List<Mesh>;

/// The meshes that one instance has now.
pub type Meshes = Store<Mesh>;

/// How much of everything a plugin wants a mesh to have.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sizes {
    /// Vertices.
    pub vertices: u32,
    /// Indices.
    pub indices: u32,
    /// Levels of detail.
    pub levels: u32,
    /// Joints.
    pub joints: u32,
    /// Joints that move a vertex.
    pub influences: u32,
}

/// What a plugin wants a mesh to be, out of the contract's struct.
#[derive(Clone, Copy, Debug, Default)]
pub struct Wanted<'a> {
    /// For messages and debuggers.
    pub name: &'a str,
    /// At rest.
    pub vertices: &'a [abi::MeshVertex],
    /// Three a triangle.
    pub indices: &'a [u32],
    /// The finest first.
    pub levels: &'a [abi::MeshLevel],
    /// Where the joints stand at rest.
    pub rest: &'a [abi::Joint],
    /// Joints that move a vertex.
    pub influences: u32,
    /// As many a vertex.
    pub joints: &'a [u32],
    /// As many a vertex.
    pub weights: &'a [f32],
    /// `abi::MESH_*`.
    pub flags: u32,
}

fn between<T: PartialOrd + Display>(what: &str, value: T, low: T, high: T) -> Result<(), String> {
    if value >= low && value <= high {
        return Ok(());
    }
    Err(format!("{what} {value}, allowed is {low} to {high}"))
}

impl Sizes {
    /// Whether there can be such a mesh: before anything of it is read.
    pub fn check(&self) -> Result<(), String> {
        between("vertex_count is", self.vertices, 1, MOST_VERTICES)?;
        between("index_count is", self.indices, 3, MOST_INDICES)?;
        between("level_count is", self.levels, 1, MOST_LEVELS)?;
        between("joint_count is", self.joints, 0, MOST_JOINTS)?;
        if !matches!(self.influences, 0 | 1 | 2 | 4 | 8) {
            return Err(format!("influences is {}, allowed is 0, 1, 2, 4 or 8", self.influences));
        }
        match (self.joints, self.influences) {
            (0, 0) | (1.., 1..) => Ok(()),
            (0, n) => Err(format!("influences is {n}, and there are no joints")),
            (n, _) => Err(format!("influences is 0, and there are {n} joints")),
        }
    }
}

impl Wanted<'_> {
    fn check(&self) -> Result<(), String> {
        for (i, vertex) in self.vertices.iter().enumerate() {
            check_vertex(vertex).map_err(|problem| format!("vertex {i}: {problem}"))?;
        }
        let count = self.vertices.len() as u32;
        if let Some((i, index)) = self.indices.iter().enumerate().find(|(_, index)| **index >= count) {
            return Err(format!("index {i} is {index}, there are {count} vertices"));
        }
        let mut error = -1.0;
        for (i, level) in self.levels.iter().enumerate() {
            self.check_level(level, i, error).map_err(|problem| format!("level {i}: {problem}"))?;
            error = level.error;
        }
        for (i, joint) in self.rest.iter().enumerate() {
            check_joint(joint).map_err(|fault| format!("rest of joint {i}: {fault}"))?;
        }
        self.check_influences()
    }

    fn check_level(&self, level: &abi::MeshLevel, number: usize, before: f32) -> Result<(), String> {
        let count = level.index_count;
        if count == 0 || !count.is_multiple_of(3) {
            return Err(format!("index_count is {count}, allowed is 3, 6, 9 …"));
        }
        let whole = |first: u32, count: u32, there: usize, what: &str| {
            let end = u64::from(first) + u64::from(count);
            if end <= there as u64 {
                return Ok(());
            }
            Err(format!("its {what} end at {end}, there are {there}"))
        };
        whole(level.first_index, count, self.indices.len(), "indices")?;
        whole(level.first_vertex, level.vertex_count, self.vertices.len(), "vertices")?;
        let corners = &self.indices[level.first_index as usize..][..count as usize];
        let own = level.first_vertex..level.first_vertex + level.vertex_count;
        if let Some((i, corner)) = corners.iter().enumerate().find(|(_, corner)| !own.contains(corner)) {
            let (first, last) = (own.start, own.end.saturating_sub(1));
            return Err(format!("its index {i} is vertex {corner}, its vertices are {first} to {last}"));
        }
        if number == 0 && level.error != 0.0 {
            return Err(format!("error is {}, allowed is 0: it is the finest", level.error));
        }
        if !level.error.is_finite() || level.error <= before {
            return Err(format!("error is {}, allowed is above {before}: levels grow coarser", level.error));
        }
        if !matches!(level.influences, 0 | 1 | 2 | 4 | 8) || level.influences > self.influences {
            let most = self.influences;
            return Err(format!(
                "influences is {}, allowed is 0, 1, 2, 4 or 8 up to {most}",
                level.influences
            ));
        }
        if level.influences == 0 && self.influences > 0 {
            return Err("influences is 0, and the mesh has joints".to_owned());
        }
        if level.spare != [0; 2] {
            return Err("spare is not zero".to_owned());
        }
        Ok(())
    }

    fn check_influences(&self) -> Result<(), String> {
        let most = self.influences as usize;
        if most == 0 {
            return Ok(());
        }
        let count = self.rest.len() as u32;
        let vertices = self.joints.chunks_exact(most).zip(self.weights.chunks_exact(most));
        for (i, (joints, weights)) in vertices.enumerate() {
            if let Some(joint) = joints.iter().find(|joint| **joint >= count) {
                return Err(format!("vertex {i} hangs on joint {joint}, there are {count}"));
            }
            if let Some(weight) = weights.iter().find(|weight| !(0.0..=1.0).contains(*weight)) {
                return Err(format!("a weight of vertex {i} is {weight}, allowed is 0 to 1"));
            }
            let sum: f32 = weights.iter().sum();
            if (sum - 1.0).abs() > WEIGHT_TOLERANCE {
                return Err(format!("the weights of vertex {i} sum to {sum}, allowed is 1 within 0.001"));
            }
        }
        Ok(())
    }

    /// What all of it is, as one number.
    fn hash(&self) -> [u8; 32] {
        let mut hasher = blake3::Hasher::new();
        for count in [self.vertices.len(), self.indices.len(), self.levels.len(), self.rest.len()] {
            hasher.update(&(count as u64).to_le_bytes());
        }
        for word in [self.influences, self.flags] {
            hasher.update(&word.to_le_bytes());
        }
        hasher.update(bytemuck::cast_slice(self.vertices));
        hasher.update(bytemuck::cast_slice(self.indices));
        hasher.update(bytemuck::cast_slice(self.levels));
        hasher.update(bytemuck::cast_slice(self.rest));
        hasher.update(bytemuck::cast_slice(self.joints));
        hasher.update(bytemuck::cast_slice(self.weights));
        *hasher.finalize().as_bytes()
    }

    /// Joints and weights of all vertices as they are kept.
    fn bones(&self) -> Vec<u32> {
        let most = self.influences as usize;
        let mut bones = Vec::with_capacity(self.joints.len());
        if most == 0 {
            return bones;
        }
        for (joints, weights) in self.joints.chunks_exact(most).zip(self.weights.chunks_exact(most)) {
            let sum: f32 = weights.iter().sum();
            let kept = |weight: f32| (weight / sum * WHOLE as f32).clamp(0.0, WHOLE as f32) as u32;
            let mut own: Vec<(u32, u32)> = joints.iter().zip(weights).map(|(j, w)| (*j, kept(*w))).collect();
            // A stable order: of equal weights the first stays first.
            own.sort_by_key(|(_, weight)| std::cmp::Reverse(*weight));
            let rest = own[1..].iter().map(|(_, weight)| weight).sum::<u32>().min(WHOLE);
            own[0].1 = WHOLE - rest;
            bones.extend(own.iter().map(|(joint, weight)| joint | weight << 16));
        }
        bones
    }

    fn reach(&self, bones: &[u32]) -> Vec<f32> {
        let mut reach = vec![0.0_f32; self.rest.len()];
        for (vertex, own) in self.vertices.iter().zip(bones.chunks_exact(self.influences.max(1) as usize)) {
            for bone in own.iter().filter(|bone| **bone >> 16 > 0) {
                let joint = (bone & 0xffff) as usize;
                let far = Vec3::from(vertex.position).distance(Vec3::from(self.rest[joint].translation));
                reach[joint] = reach[joint].max(far);
            }
        }
        reach
    }

    fn bounds(&self) -> [f32; 4] {
        let places = || self.vertices.iter().map(|vertex| Vec3::from(vertex.position));
        let low = places().reduce(Vec3::min).unwrap_or_default();
        let high = places().reduce(Vec3::max).unwrap_or_default();
        let middle = (low + high) * 0.5;
        middle.extend(places().map(|place| place.distance(middle)).fold(0.0, f32::max)).to_array()
    }
}

fn check_vertex(vertex: &abi::MeshVertex) -> Result<(), String> {
    for value in vertex.position {
        between("position is", value, -FARTHEST_LOCAL, FARTHEST_LOCAL)?;
    }
    for value in vertex.uv {
        between("uv is", value, -FARTHEST_UV, FARTHEST_UV)?;
    }
    between("thickness is", vertex.thickness, 0.0, FARTHEST_LOCAL)?;
    between("glow is", vertex.glow, 0.0, FARTHEST_LOCAL)?;
    if vertex.spare != 0 {
        return Err("spare is not zero".to_owned());
    }
    Ok(())
}

impl Meshes {
    /// Makes one whose [`Sizes`] were checked; its id. Outside, why there can be none; inside, why there is
    /// no room.
    pub fn add(&mut self, wanted: Wanted<'_>) -> Result<Result<u32, String>, String> {
        wanted.check()?;
        let hash = wanted.hash();
        if !self.has(wanted.name, &hash) {
            let there = |of: fn(&Mesh) -> usize| self.list().iter().map(|mesh| of(mesh)).sum::<usize>();
            let vertices = (wanted.vertices.len(), there(|m| m.vertices.len()), MOST_VERTICES_IN_ALL);
            let indices = (wanted.indices.len(), there(|m| m.indices.len()), MOST_INDICES_IN_ALL);
            for ((count, there, most), what) in [(vertices, "vertices"), (indices, "indices")] {
                if there + count > most {
                    let name = wanted.name;
                    return Ok(Err(self.no_room(format!(
                        "`{name}`: {count} {what} beside {there}; an instance has {most} at most"
                    ))));
                }
            }
        }
        Ok(self.hold(wanted.name, &hash, |id, name| {
            let bones = wanted.bones();
            Mesh {
                id,
                name,
                vertices: wanted.vertices.to_vec(),
                indices: wanted.indices.to_vec(),
                levels: wanted.levels.to_vec(),
                rest: wanted.rest.to_vec(),
                influences: wanted.influences,
                reach: wanted.reach(&bones),
                bones,
                flags: wanted.flags,
                bounds: wanted.bounds(),
                opaque: wanted.vertices.iter().all(|vertex| vertex.color >> 24 == 0xff),
                hash,
            }
        }))
    }
}

#[cfg(test)]
pub(crate) mod tests;
