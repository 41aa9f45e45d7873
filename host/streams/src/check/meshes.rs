//! The checks of what meshes are made of: joints, vertices, and the elements that name them.

use reef_abi as abi;

use super::{
    Emitted, Fault, PIECE, Unknown,
    elements::{Checked, FARTHEST_LOCAL, UNIT_TOLERANCE, above, at_least, fault, index, within},
};
use crate::{Outputs, meshes::Mesh, retained};

/// Widest turn of a hue [rad].
const HALF_TURN: f32 = std::f32::consts::PI;

fn is_turn([x, y, z, w]: [f32; 4]) -> bool {
    ((x * x + y * y + z * z + w * w) - 1.0).abs() <= UNIT_TOLERANCE
}

fn is_near([x, y, z]: [f32; 3]) -> bool {
    (x.abs() <= FARTHEST_LOCAL) & (y.abs() <= FARTHEST_LOCAL) & (z.abs() <= FARTHEST_LOCAL)
}

/// The mesh that an element names.
fn mesh(outputs: &Outputs, id: u32) -> Result<&Mesh, Fault> {
    retained::find(&outputs.meshes, id).map(|mesh| &**mesh).ok_or_else(|| Fault {
        field: "mesh",
        problem: format!("is {id}, which mesh_create did not hand out, or which was destroyed"),
    })
}

fn range(fields: &'static str, first: u32, count: u32, there: usize, of: &str) -> Checked {
    let end = u64::from(first) + u64::from(count);
    if end <= there as u64 {
        return Ok(());
    }
    fault(fields, format!("end at {end}, there are {there} {of}"))
}

/// Phase, hue, value and fade.
fn look([phase, hue, value, fade]: [f32; 4]) -> Checked {
    within("phase", phase, 0.0, 1.0)?;
    within("hue", hue, -HALF_TURN, HALF_TURN)?;
    within("value", value, -1.0, 4.0)?;
    within("fade", fade, 0.0, 1.0)
}

impl Emitted for abi::Joint {
    const PIECE: Option<usize> = Some(2 * PIECE);

    fn check(&self, _: &Outputs) -> Checked {
        joint(self)
    }

    fn id(&self) -> Option<u64> {
        None
    }

    fn object(&self) -> Option<u32> {
        None
    }

    fn spare_is_zero(&self) -> bool {
        true
    }

    fn glance(part: &[Self], _: u64, _: &Outputs) -> (bool, bool) {
        let sound = |joint: &Self| {
            is_turn(joint.rotation)
                & is_near(joint.translation)
                & (joint.scale > 0.0)
                & (joint.scale <= FARTHEST_LOCAL)
        };
        (part.iter().fold(true, |all, joint| all & sound(joint)), true)
    }
}

/// What is wrong with a joint.
pub(crate) fn joint(joint: &abi::Joint) -> Checked {
    let [x, y, z, w] = joint.rotation;
    if !is_turn(joint.rotation) {
        return fault("rotation", format!("is ({x}, {y}, {z}, {w}), which is no unit quaternion"));
    }
    for value in joint.translation {
        within("translation", value, -FARTHEST_LOCAL, FARTHEST_LOCAL)?;
    }
    above("scale", joint.scale, 0.0)?;
    within("scale", joint.scale, 0.0, FARTHEST_LOCAL)
}

impl Emitted for abi::DrawVertex {
    const PIECE: Option<usize> = Some(4 * PIECE);

    fn check(&self, _: &Outputs) -> Checked {
        for value in self.position {
            within("position", value, -FARTHEST_LOCAL, FARTHEST_LOCAL)?;
        }
        at_least("thickness", self.thickness, 0.0)?;
        within("thickness", self.thickness, 0.0, FARTHEST_LOCAL)
    }

    fn id(&self) -> Option<u64> {
        None
    }

    fn object(&self) -> Option<u32> {
        None
    }

    fn spare_is_zero(&self) -> bool {
        true
    }

    fn glance(part: &[Self], _: u64, _: &Outputs) -> (bool, bool) {
        let sound = |vertex: &Self| {
            is_near(vertex.position) & (vertex.thickness >= 0.0) & (vertex.thickness <= FARTHEST_LOCAL)
        };
        (part.iter().fold(true, |all, vertex| all & sound(vertex)), true)
    }
}

impl Emitted for abi::Skinned {
    const PIECE: Option<usize> = Some(PIECE);

    fn check(&self, outputs: &Outputs) -> Checked {
        index("object", self.object, outputs.objects.len(), "objects")?;
        index("material", self.material, outputs.materials.len(), "materials")?;
        let joints = mesh(outputs, self.mesh)?.rest.len();
        if self.joint_count != 1 && self.joint_count as usize != joints {
            let allowed = if joints > 1 { format!("1 or the mesh's {joints}") } else { "1".to_owned() };
            return fault("joint_count", format!("is {}, allowed is {allowed}", self.joint_count));
        }
        let there = outputs.joints.len();
        range("first_joint and joint_count", self.first_joint, self.joint_count, there, "joints")?;
        above("scale", self.scale, 0.0)?;
        within("scale", self.scale, 0.0, FARTHEST_LOCAL)?;
        look([self.phase, self.hue, self.value, self.fade])
    }

    fn unknown(&self) -> Option<Unknown> {
        Unknown::bits(self.flags, abi::FLAG_NO_BLEND)
    }

    fn id(&self) -> Option<u64> {
        None
    }

    fn object(&self) -> Option<u32> {
        Some(self.object)
    }

    fn spare_is_zero(&self) -> bool {
        self.spare == [0; 5]
    }
}

impl Emitted for abi::MeshDraw {
    // One job looks at all: they are few, and each has to begin where those before it have ended.
    const PIECE: Option<usize> = None;

    fn check(&self, outputs: &Outputs) -> Checked {
        index("object", self.object, outputs.objects.len(), "objects")?;
        index("material", self.material, outputs.materials.len(), "materials")?;
        let vertices = mesh(outputs, self.mesh)?.vertices.len();
        if self.vertex_count as usize != vertices {
            return fault("vertex_count", format!("is {}, the mesh has {vertices}", self.vertex_count));
        }
        let there = outputs.draw_vertices.len();
        range("first_vertex and vertex_count", self.first_vertex, self.vertex_count, there, "vertices")?;
        look([self.phase, self.hue, self.value, self.fade])
    }

    fn unknown(&self) -> Option<Unknown> {
        Unknown::bits(self.flags, abi::FLAG_NO_BLEND)
    }

    fn id(&self) -> Option<u64> {
        None
    }

    fn object(&self) -> Option<u32> {
        Some(self.object)
    }

    fn spare_is_zero(&self) -> bool {
        self.spare == [0; 2]
    }

    /// No two share vertices.
    fn beside(elements: &[Self], room: &mut Vec<u64>) -> Option<(usize, Fault)> {
        let end = |range: u64| (range >> 32) + (range & u64::from(u32::MAX));
        let range = |draw: &Self| u64::from(draw.first_vertex) << 32 | u64::from(draw.vertex_count);
        room.clear();
        room.extend(elements.iter().map(range));
        room.sort_unstable();
        // Behind all ranges in order: how far each, or one before it, goes.
        let mut farthest = 0;
        for i in 0..elements.len() {
            farthest = end(room[i]).max(farthest);
            room.push(farthest);
        }
        let (sorted, ends) = room.split_at(elements.len());
        let shares = |own: u64| {
            let place = sorted.partition_point(|range| *range < own);
            let before = place.checked_sub(1).is_some_and(|before| ends[before] > own >> 32);
            before || sorted.get(place + 1).is_some_and(|next| next >> 32 < end(own))
        };
        let i = elements.iter().position(|element| shares(range(element)))?;
        let other =
            (0..elements.len()).find(|&other| other != i && overlap(&elements[other], &elements[i]))?;
        let problem = format!("leads into the vertices of element {other}");
        Some((i, Fault { field: "first_vertex", problem }))
    }

    /// Draws whose vertices follow one another share none.
    fn glance(part: &[Self], _: u64, outputs: &Outputs) -> (bool, bool) {
        let sound = part.iter().all(|draw| draw.verdict(outputs).is_ok() && draw.unknown().is_none());
        let end = |draw: &Self| u64::from(draw.first_vertex) + u64::from(draw.vertex_count);
        let follow = |pair: &[Self]| end(&pair[0]) <= u64::from(pair[1].first_vertex);
        (sound, part.windows(2).all(follow))
    }
}

/// Whether two elements share vertices.
fn overlap(a: &abi::MeshDraw, b: &abi::MeshDraw) -> bool {
    let ends = [a, b].map(|draw| u64::from(draw.first_vertex) + u64::from(draw.vertex_count));
    u64::from(a.first_vertex) < ends[1] && u64::from(b.first_vertex) < ends[0]
}

#[cfg(test)]
pub(super) mod tests;
