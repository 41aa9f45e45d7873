//! From a file's joints to segments.
//!
//! A joint's bone goes up its own Y axis, as Blender's bones do, to the joint that goes on there; one that
//! ends the plant is as long as what hangs on it. A segment bends about one axis freely, so a bone is two: a
//! short one that points where the bone does, and the rest of it, turned by 90° about the bone. Where a bone
//! begins beside the axis of the one that it stands on, a stiff segment bridges the gap. At rest each joint
//! is exactly where the file has it.

use core::f64::consts::FRAC_PI_2;

use glam::{DMat4, DQuat, DVec2, DVec3};
use gltf_json::scene::Node;

use super::file::{Fault, File};
use crate::{grow::piece, skeleton::Segment, species::Tissue};

/// Most joints of a file. Each makes two segments, and a third where a gap is bridged; of those a plant has
/// at most [`crate::grow::MOST_GROWN`].
pub const MOST_JOINTS: usize = 128;

/// So much of a joint's name counts [characters].
const LONGEST_NAME: usize = 64;

/// Share of a bone that its first segment is.
const KNUCKLE: f64 = 0.1;
/// A bone that begins so near the axis of what it stands on, as a share of that one's length, begins on it.
const BESIDE: f64 = 0.005;
/// A child goes on where its parent ends when it is as near its axis as this share of the way there.
const AHEAD: f64 = 0.05;
/// How much stiffer a bridge is than the bone that stands on it.
const BRIDGE: f64 = 30.0;
/// Of a bone that nothing says the length of [m], and the shortest that there may be.
const USUAL: f64 = 0.1;
const SHORTEST: f64 = 1e-4;

/// A joint of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Bone {
    /// In the file.
    pub name: String,
    /// Its node.
    pub node: usize,
    /// Among the bones, which have parents first.
    pub parent: Option<usize>,
    /// From its own space to the plant's, whose origin is the root's: what the mesh at rest is made with.
    pub base: DMat4,
    /// Where it begins, relative to the root [m].
    pub origin: DVec3,
    /// The way that it goes, unit.
    pub up: DVec3,
    /// [m]
    pub length: f64,
    /// Bones from the root to it: 0, the root.
    pub depth: u32,
    /// Length of the way from the root to its beginning [m].
    pub along: f64,
}

/// Where a node stands in its parent.
fn local(node: &Node) -> Option<DMat4> {
    if let Some(matrix) = node.matrix {
        return Some(DMat4::from_cols_array(&matrix.map(f64::from)));
    }
    let vector = |v: Option<[f32; 3]>, usual: DVec3| v.map_or(usual, |v| DVec3::from(v.map(f64::from)));
    let [x, y, z, w] = node.rotation.map_or([0.0, 0.0, 0.0, 1.0], |rotation| rotation.0.map(f64::from));
    let turn = DQuat::from_xyzw(x, y, z, w);
    let (scale, place) = (vector(node.scale, DVec3::ONE), vector(node.translation, DVec3::ZERO));
    let unit = (turn.length() - 1.0).abs() < 0.01;
    unit.then(|| DMat4::from_scale_rotation_translation(scale, turn.normalize(), place))
}

/// The parent of each node, and where each stands in the world, parents of all before them: their order, too.
struct Tree {
    parents: Vec<Option<usize>>,
    places: Vec<DMat4>,
    order: Vec<usize>,
}

impl Tree {
    fn of(nodes: &[Node]) -> Result<Self, Fault> {
        let mut parents: Vec<Option<usize>> = vec![None; nodes.len()];
        for (number, node) in nodes.iter().enumerate() {
            for (i, child) in node.children.iter().flatten().enumerate() {
                if let Some(other) = parents[child.value()].replace(number) {
                    let problem =
                        format!("is a child of nodes[{other}] already; a node has one parent at most");
                    return Err(Fault::new(format!("nodes[{number}].children[{i}]"), problem));
                }
            }
        }
        let mut tree = Self { parents, places: vec![DMat4::IDENTITY; nodes.len()], order: Vec::new() };
        let mut open: Vec<usize> =
            (0..nodes.len()).rev().filter(|number| tree.parents[*number].is_none()).collect();
        while let Some(number) = open.pop() {
            let path = || format!("nodes[{number}]");
            let own = local(&nodes[number])
                .ok_or_else(|| Fault::new(format!("{}.rotation", path()), "must be a unit quaternion"))?;
            let place = tree.parents[number].map_or(own, |parent| tree.places[parent] * own);
            if !place.to_cols_array().iter().all(|x| x.abs() < 1e5) {
                let problem = "stands farther than 1e5 m from the origin, or is scaled by as much";
                return Err(Fault::new(path(), problem));
            }
            tree.places[number] = place;
            tree.order.push(number);
            open.extend(nodes[number].children.iter().flatten().rev().map(|child| child.value()));
        }
        let mut found = vec![false; nodes.len()];
        tree.order.iter().for_each(|number| found[*number] = true);
        // Each has one parent: those that no root leads to go round.
        match found.iter().position(|found| !found) {
            Some(round) => {
                let problem = "stands on itself: following parents must lead to a root";
                Err(Fault::new(format!("nodes[{round}]"), problem))
            }
            None => Ok(tree),
        }
    }
}

/// The nodes that are joints, each with where it is named: those of a skin, or all below the roots.
fn joints(file: &File<'_>, skin: Option<usize>, tree: &Tree) -> Result<Vec<(usize, String)>, Fault> {
    let nodes = &file.root.nodes;
    let found: Vec<(usize, String)> = match skin.and_then(|skin| file.root.skins.get(skin)) {
        Some(own) => {
            let path = |i: usize| format!("skins[{}].joints[{i}]", skin.unwrap_or(0));
            own.joints.iter().enumerate().map(|(i, joint)| (joint.value(), path(i))).collect()
        }
        None => {
            let bare = |number: &usize| {
                let node = &nodes[*number];
                tree.parents[*number].is_some() && node.mesh.is_none() && node.camera.is_none()
            };
            let bones = tree.order.iter().copied().filter(bare);
            bones.map(|number| (number, format!("nodes[{number}]"))).collect()
        }
    };
    if found.is_empty() {
        return Err(Fault::whole("has no joints: neither a skin nor nodes below an armature"));
    }
    if found.len() > MOST_JOINTS {
        let path = skin.map_or("nodes".to_owned(), |skin| format!("skins[{skin}].joints"));
        return Err(Fault::new(path, format!("are {}; at most {MOST_JOINTS} are allowed", found.len())));
    }
    Ok(found)
}

/// The bones of a file, parents first, and the number of each of the skin's joints among them.
pub(super) fn bones(file: &File<'_>, skin: Option<usize>) -> Result<(Vec<Bone>, Vec<usize>), Fault> {
    let nodes = &file.root.nodes;
    let tree = Tree::of(nodes)?;
    let listed = joints(file, skin, &tree)?;
    let mut numbers: Vec<Option<usize>> = vec![None; nodes.len()];
    let mut paths: Vec<Option<&str>> = vec![None; nodes.len()];
    for (node, path) in &listed {
        if paths[*node].replace(path).is_some() {
            return Err(Fault::new(path.as_str(), format!("is nodes[{node}], which is listed before")));
        }
    }
    let mut bones: Vec<Bone> = Vec::with_capacity(listed.len());
    let mut root = None;
    for node in tree.order.iter().copied().filter(|node| paths[*node].is_some()) {
        let above = core::iter::successors(tree.parents[node], |at| tree.parents[*at]);
        let parent = above.filter_map(|at| numbers[at]).next();
        let name =
            nodes[node].name.iter().flat_map(|name| name.chars()).take(LONGEST_NAME).collect::<String>();
        if let (None, Some(first)) = (parent, bones.first()) {
            let problem = format!(
                "`{name}` stands on no other joint, as `{}` does; a plant has one root (and no vertex without \
                 a bone, for which Blender writes a joint of its own)",
                first.name
            );
            return Err(Fault::new(paths[node].unwrap_or_default(), problem));
        }
        let base = tree.places[node];
        let up = base.transform_vector3(DVec3::Y);
        if up.length() < 1e-6 {
            return Err(Fault::new(format!("nodes[{node}].scale"), "leaves its Y axis no length"));
        }
        let root = *root.get_or_insert(base.w_axis.truncate());
        let below = parent.map(|parent| &bones[parent]);
        numbers[node] = Some(bones.len());
        bones.push(Bone {
            name,
            node,
            parent,
            base: DMat4::from_translation(-root) * base,
            origin: base.w_axis.truncate() - root,
            up: up.normalize(),
            length: 0.0,
            depth: below.map_or(0, |below| below.depth + 1),
            along: 0.0,
        });
    }
    let of = |(node, _): &(usize, String)| numbers[*node].unwrap_or(0);
    Ok((bones, listed.iter().map(of).collect()))
}

/// Sets how long the bones are. `ends`: how far up each what hangs on it reaches [m].
///
/// # Errors
/// One has no length.
pub(super) fn measure(bones: &mut [Bone], ends: &[f64]) -> Result<(), Fault> {
    for number in 0..bones.len() {
        let (origin, up) = (bones[number].origin, bones[number].up);
        let (mut ahead, mut farthest) = (0.0_f64, 0.0_f64);
        for child in bones.iter().filter(|child| child.parent == Some(number)) {
            let way = child.origin - origin;
            let along = way.dot(up);
            farthest = farthest.max(along);
            if (way - up * along).length() <= AHEAD * along {
                ahead = ahead.max(along);
            }
        }
        let below = bones[number]
            .parent
            .map(|parent| (bones[parent].along, bones[parent].origin, bones[parent].length));
        let usual = below.map_or(USUAL, |(_, _, length)| length);
        let bone = &mut bones[number];
        bone.length = match (ahead, farthest.max(ends[number])) {
            (ahead, _) if ahead > SHORTEST => ahead,
            (_, end) if end > SHORTEST => end,
            _ => usual,
        };
        bone.along = below.map_or(0.0, |(along, start, _)| along + start.distance(origin));
        if !(SHORTEST..=1e3).contains(&bone.length) {
            let problem = format!("makes a bone of {} m; allowed is {SHORTEST} to 1000", bone.length);
            return Err(Fault::new(format!("nodes[{}]", bone.node), problem));
        }
    }
    Ok(())
}

/// The longest way from the root to the end of a bone [m].
pub(super) fn whole(bones: &[Bone]) -> f64 {
    bones.iter().map(|bone| bone.along + bone.length).fold(SHORTEST, f64::max)
}

/// A way as θ about the parent's Y and φ about its own X, from the parent's base.
fn turn_to(base: DQuat, way: DVec3) -> (f64, f64) {
    let own = base.inverse() * way;
    let aside = DVec2::new(own.x, own.z).length();
    let theta = if aside > 1e-9 { DVec2::new(own.z, own.x).to_angle() } else { 0.0 };
    (theta, DVec2::new(own.y, aside).to_angle())
}

/// Segments on their way.
struct Growing {
    segments: Vec<Segment>,
    bases: Vec<DQuat>,
}

impl Growing {
    /// Adds a segment that points somewhere, or where `turn` turns it; its number.
    fn add(&mut self, parent: Option<(usize, f64)>, (theta, phi): (f64, f64), segment: Segment) -> usize {
        let base = self.base(parent);
        self.bases.push((base * DQuat::from_rotation_y(theta) * DQuat::from_rotation_x(phi)).normalize());
        let (parent, height) = (parent.map(|(parent, _)| parent), parent.map_or(0.0, |(_, height)| height));
        self.segments.push(Segment { parent, height, theta, phi, ..segment });
        self.segments.len() - 1
    }

    fn base(&self, parent: Option<(usize, f64)>) -> DQuat {
        parent.map_or(DQuat::IDENTITY, |(parent, _)| self.bases[parent])
    }
}

/// The segments of bones, and the one of each that moves what hangs on it. `tissue_of`: what a bone is of,
/// and the lift of the bladder on it [N].
pub(super) fn segments<'a>(
    bones: &[Bone],
    tissue_of: impl Fn(usize) -> (&'a Tissue, f64),
) -> (Vec<Segment>, Vec<usize>) {
    let whole = whole(bones);
    let mut plant = Growing { segments: Vec::new(), bases: Vec::new() };
    let mut moving: Vec<usize> = Vec::with_capacity(bones.len());
    for (number, bone) in bones.iter().enumerate() {
        let (tissue, bladder) = tissue_of(number);
        let up = ((bone.along + 0.5 * bone.length) / whole).min(1.0);
        let joint = piece(tissue, bone.length, up);
        let part = |share: f64, stiffer: f64| Segment {
            stiffness: joint.stiffness * stiffer,
            damping: joint.damping * stiffer,
            ..piece(tissue, share * bone.length, up)
        };
        let mut on = None;
        if let Some(parent) = bone.parent {
            let below = &bones[parent];
            let along = (bone.origin - below.origin).dot(below.up).clamp(0.0, below.length);
            let (rest, first) = (moving[parent], KNUCKLE * below.length);
            on = Some(if along < first { (rest - 1, along) } else { (rest, along - first) });
            let way = bone.origin - (below.origin + below.up * along);
            let gap = way.length();
            if gap > (BESIDE * below.length).max(SHORTEST) {
                let turn = turn_to(plant.base(on), way / gap);
                let bridge = part(gap / bone.length, BRIDGE);
                on = Some((plant.add(on, turn, bridge), gap));
            }
        }
        let turn = turn_to(plant.base(on), bone.up);
        let mut first = part(KNUCKLE, 1.0);
        first.lift += bladder;
        let knuckle = plant.add(on, turn, first);
        let rest = Some((knuckle, KNUCKLE * bone.length));
        moving.push(plant.add(rest, (FRAC_PI_2, 0.0), part(1.0 - KNUCKLE, 1.0)));
    }
    (plant.segments, moving)
}
