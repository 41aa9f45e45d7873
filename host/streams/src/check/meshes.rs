//! The checks of what meshes are made of: joints, vertices, and the elements that name them.

use reef_abi as abi;

use super::{Checked, FARTHEST_LOCAL, UNIT_TOLERANCE, above, at_least, each, fault, flags, index, within};
use crate::{Outputs, meshes::Mesh, retained};

/// Widest turn of a hue [rad]: half a circle, as an f32 may have rounded it.
const HALF_TURN: f32 = 3.141_593;

fn is_turn([x, y, z, w]: [f32; 4]) -> bool {
    ((x * x + y * y + z * z + w * w) - 1.0).abs() <= UNIT_TOLERANCE
}

fn is_near([x, y, z]: [f32; 3]) -> bool {
    (x.abs() <= FARTHEST_LOCAL) & (y.abs() <= FARTHEST_LOCAL) & (z.abs() <= FARTHEST_LOCAL)
}

/// Whether a joint is sound.
pub(super) fn sound(joint: &abi::Joint) -> bool {
    is_turn(joint.rotation)
        & is_near(joint.translation)
        & (joint.scale > 0.0)
        & (joint.scale <= FARTHEST_LOCAL)
}

/// Whether a vertex that was made anew is sound.
pub(super) fn sound_vertex(vertex: &abi::DrawVertex) -> bool {
    is_near(vertex.position) & (vertex.thickness >= 0.0) & (vertex.thickness <= FARTHEST_LOCAL)
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

fn vertex(vertex: &abi::DrawVertex) -> Checked {
    for value in vertex.position {
        within("position", value, -FARTHEST_LOCAL, FARTHEST_LOCAL)?;
    }
    at_least("thickness", vertex.thickness, 0.0)?;
    within("thickness", vertex.thickness, 0.0, FARTHEST_LOCAL)
}

/// The mesh that an element names.
fn mesh(outputs: &Outputs, id: u32) -> Result<&Mesh, super::Fault> {
    retained::find(&outputs.meshes, id).map(|mesh| &**mesh).ok_or_else(|| super::Fault {
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

fn no_spare(spare: &[u32]) -> Checked {
    if spare.iter().all(|word| *word == 0) {
        return Ok(());
    }
    fault("spare", "is not zero")
}

fn skinned(outputs: &Outputs, element: &abi::Skinned) -> Checked {
    index("object", element.object, outputs.objects.len(), "objects")?;
    index("material", element.material, outputs.materials.len(), "materials")?;
    flags(element.flags, abi::FLAG_NO_BLEND)?;
    let joints = mesh(outputs, element.mesh)?.rest.len();
    if element.joint_count != 1 && element.joint_count as usize != joints {
        let allowed = if joints > 1 { format!("1 or the mesh's {joints}") } else { "1".to_owned() };
        return fault("joint_count", format!("is {}, allowed is {allowed}", element.joint_count));
    }
    let there = outputs.joints.len();
    range("first_joint and joint_count", element.first_joint, element.joint_count, there, "joints")?;
    above("scale", element.scale, 0.0)?;
    within("scale", element.scale, 0.0, FARTHEST_LOCAL)?;
    look([element.phase, element.hue, element.value, element.fade])?;
    no_spare(&element.spare)
}

fn draw(outputs: &Outputs, element: &abi::MeshDraw) -> Checked {
    index("object", element.object, outputs.objects.len(), "objects")?;
    index("material", element.material, outputs.materials.len(), "materials")?;
    flags(element.flags, abi::FLAG_NO_BLEND)?;
    let vertices = mesh(outputs, element.mesh)?.vertices.len();
    if element.vertex_count as usize != vertices {
        return fault("vertex_count", format!("is {}, the mesh has {vertices}", element.vertex_count));
    }
    let there = outputs.draw_vertices.len();
    range("first_vertex and vertex_count", element.first_vertex, element.vertex_count, there, "vertices")?;
    look([element.phase, element.hue, element.value, element.fade])?;
    no_spare(&element.spare)
}

/// The elements that name meshes: the first that is wrong.
pub(super) fn elements(outputs: &Outputs) -> Result<(), String> {
    each("skinned", &outputs.skinned, |element| skinned(outputs, element))?;
    each("mesh draw", &outputs.mesh_draws, |element| draw(outputs, element))?;
    let mut end = 0;
    for (i, draw) in outputs.mesh_draws.iter().enumerate() {
        if u64::from(draw.first_vertex) < end {
            let first = draw.first_vertex;
            return Err(format!(
                "stream mesh draw, element {i}: first_vertex is {first}, the element before ends at {end}"
            ));
        }
        end = u64::from(draw.first_vertex) + u64::from(draw.vertex_count);
    }
    Ok(())
}

/// The first element of all that is wrong.
pub(super) fn find(outputs: &Outputs) -> Result<(), String> {
    each("joint", &outputs.joints, joint)?;
    each("draw vertex", &outputs.draw_vertices, vertex)?;
    elements(outputs)
}

#[cfg(test)]
mod tests;
