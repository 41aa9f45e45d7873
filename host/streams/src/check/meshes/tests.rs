use std::sync::Arc;

use super::*;
use crate::{
    check::{Checker, alone},
    meshes::{Meshes, tests::Strip},
};

pub(in crate::check) fn good() -> Outputs {
    let mut meshes = Meshes::default();
    meshes.add(Strip::new().wanted()).expect("a mesh").expect("room");
    let joint = abi::Joint { rotation: [0.0, 0.6, 0.0, 0.8], scale: 1.0, ..Default::default() };
    let skinned = abi::Skinned { mesh: 1, joint_count: 3, scale: 1.0, ..Default::default() };
    let draw = abi::MeshDraw { mesh: 1, vertex_count: 6, ..Default::default() };
    Outputs {
        objects: vec![abi::Object { id: 1, ..Default::default() }],
        materials: vec![abi::Material::default()],
        skinned: vec![skinned, abi::Skinned { first_joint: 3, joint_count: 1, ..skinned }],
        joints: vec![joint; 4],
        mesh_draws: vec![draw, abi::MeshDraw { first_vertex: 6, ..draw }],
        draw_vertices: vec![abi::DrawVertex::default(); 12],
        meshes: meshes.list().clone(),
        ..Outputs::default()
    }
}

fn verdict(spoil: impl FnOnce(&mut Outputs)) -> String {
    let mut outputs = good();
    spoil(&mut outputs);
    Checker::default().check(&outputs, &alone).expect_err("the spoilt outputs passed")
}

#[test]
fn sound_meshes_pass() {
    assert_eq!(Checker::default().check(&good(), &alone), Ok(()));
}

#[test]
fn what_names_meshes_is_looked_at_element_by_element() {
    let said = |spoil: fn(&mut Outputs), words: &str| assert_eq!(verdict(spoil), words);
    said(
        |o| o.skinned[1].mesh = 2,
        "stream skinned, element 1: mesh is 2, which mesh_create did not hand out, or which was destroyed",
    );
    said(
        |o| o.meshes = Arc::default(),
        "stream skinned, element 0: mesh is 1, which mesh_create did not hand out, or which was destroyed",
    );
    said(
        |o| o.skinned[0].joint_count = 2,
        "stream skinned, element 0: joint_count is 2, allowed is 1 or the mesh's 3",
    );
    said(
        |o| o.skinned[0].first_joint = 2,
        "stream skinned, element 0: first_joint and joint_count end at 5, there are 4 joints",
    );
    said(|o| o.skinned[0].scale = 0.0, "stream skinned, element 0: scale is 0, allowed is above 0");
    said(|o| o.skinned[0].fade = 1.5, "stream skinned, element 0: fade is 1.5, allowed is 0 to 1");
    said(|o| o.skinned[0].material = 1, "stream skinned, element 0: material is 1, there are 1 materials");
    said(|o| o.skinned[1].spare[2] = 4, "stream skinned, element 1: spare is not zero");
    said(
        |o| o.mesh_draws[1].vertex_count = 5,
        "stream mesh draw, element 1: vertex_count is 5, the mesh has 6",
    );
    said(
        |o| o.mesh_draws[1].first_vertex = 5,
        "stream mesh draw, element 0: first_vertex leads into the vertices of element 1",
    );
    said(
        |o| o.mesh_draws[1].first_vertex = u32::MAX,
        "stream mesh draw, element 1: first_vertex and vertex_count end at 4294967301, there are 12 vertices",
    );
    said(
        |o| o.joints[3].rotation[0] = 0.5,
        "stream joint, element 3: rotation is (0.5, 0.6, 0, 0.8), which is no unit quaternion",
    );
    said(|o| o.joints[2].scale = f32::NAN, "stream joint, element 2: scale is NaN, allowed is above 0");
    said(
        |o| o.draw_vertices[11].thickness = -0.1,
        "stream draw vertex, element 11: thickness is -0.1, allowed is 0 and more",
    );
    said(
        |o| o.draw_vertices[7].position[2] = f32::INFINITY,
        "stream draw vertex, element 7: position is inf, allowed is -100000 to 100000",
    );
}

/// Six mesh draws of six vertices each, whose first vertices are these.
fn draws(first: [u32; 6]) -> Outputs {
    let mut outputs = good();
    let of = outputs.mesh_draws[0];
    outputs.mesh_draws = first.map(|first_vertex| abi::MeshDraw { first_vertex, ..of }).to_vec();
    outputs.draw_vertices = vec![abi::DrawVertex::default(); 36];
    outputs
}

#[test]
fn mesh_draws_may_come_in_any_order_but_share_no_vertices() {
    let check = |outputs: &Outputs| Checker::default().check(outputs, &alone);
    assert_eq!(check(&draws([12, 0, 30, 6, 24, 18])), Ok(()));
    let shares = |first: [u32; 6], i: usize, other: usize| {
        let words = format!("element {i}: first_vertex leads into the vertices of element {other}");
        assert_eq!(check(&draws(first)), Err(format!("stream mesh draw, {words}")), "{first:?}");
    };
    shares([12, 0, 30, 6, 24, 13], 0, 5);
    shares([12, 0, 30, 6, 29, 18], 2, 4);
    shares([12, 0, 3, 6, 24, 2], 1, 2);
    shares([5, 18, 24, 30, 5, 11], 0, 4);
}

#[test]
fn the_first_wrong_mesh_draw_is_named_whatever_is_wrong_with_it() {
    let shared = [12, 0, 30, 6, 24, 6];
    let overlap = "element 3: first_vertex leads into the vertices of element 5";
    let said = |spoil: fn(&mut Outputs), words: &str| {
        let mut outputs = draws(shared);
        spoil(&mut outputs);
        let message = Checker::default().check(&outputs, &alone).expect_err("spoilt");
        assert_eq!(message, format!("stream mesh draw, {words}"));
    };
    said(|_| (), overlap);
    said(|o| o.mesh_draws[2].fade = 2.0, "element 2: fade is 2, allowed is 0 to 1");
    said(|o| o.mesh_draws[3].fade = 2.0, "element 3: fade is 2, allowed is 0 to 1");
    said(|o| o.mesh_draws[3].spare[0] = 1, overlap);
    said(|o| o.mesh_draws[2].spare[0] = 1, "element 2: spare is not zero");
    said(|o| o.mesh_draws[4].fade = 2.0, overlap);
    said(|o| o.mesh_draws[4].flags = 1 << 9, overlap);
}
