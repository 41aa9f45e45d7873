//! Meshes that a plugin makes: they go with the outputs that name them, keep their ids over a load, a reset
//! and a discarded step, and end with their instance.

use std::sync::Arc;

use reef_plugin::{Library, Plugin as Loaded, StepStatus};
use reef_sdk::prelude::*;
use reef_streams::Outputs;
use reef_tests::{
    artifacts::artifacts,
    sea::{Sea, config},
};

/// A mesh from the start, another from step 2 on, drawn by joints and by vertices; what goes wrong when it is
/// asked to.
struct Modeller {
    host: Host,
    step: u64,
    sheet: Mesh,
    second: Option<Mesh>,
    wrong: String,
}

#[derive(serde::Deserialize, schemars::JsonSchema)]
struct Size {
    /// Width of the sheet [m].
    width: f32,
    /// What goes wrong.
    #[serde(default)]
    wrong: String,
}

fn sheet(host: &Host, name: &str, width: f32, wrong: &str) -> Result<Mesh, MeshError> {
    let vertex = |x: f32, y: f32| abi::MeshVertex {
        position: [x * width, y, 0.0],
        normal: pack_normal([0.0, 0.0, 1.0]),
        uv: [x, y],
        color: u32::MAX,
        ..Default::default()
    };
    let joint = |y| abi::Joint { rotation: [0.0, 0.0, 0.0, 1.0], translation: [0.0, y, 0.0], scale: 1.0 };
    let mut vertices = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]].map(|[x, y]| vertex(x, y));
    let mut weights = [[1.0, 0.0], [1.0, 0.0], [0.5, 0.5], [0.5, 0.5]].concat();
    let mut joints = [[0, 1]; 4].concat();
    match wrong {
        "nan" => vertices[2].position[0] = f32::NAN,
        "weights" => weights[5] = 0.75,
        "joints" => joints[7] = 2,
        _ => {}
    }
    host.mesh(&MeshDesc {
        name,
        vertices: &vertices,
        indices: &[0, 1, 3, 0, 3, 2],
        rest: &[0.0, 1.0].map(joint),
        influences: 2,
        joints: &joints,
        weights: &weights,
        flags: abi::MESH_TWO_SIDED,
        ..Default::default()
    })
}

impl Plugin for Modeller {
    const ID: &'static str = "test.modeller";
    const NAME: &'static str = "Modeller";
    const VERSION: &'static str = "1.0.0";
    const VENDOR: &'static str = "Reef's tests";
    const DESCRIPTION: &'static str = "Makes meshes.";
    const STATE_VERSION: u32 = 1;
    const STATE_MIN_VERSION: u32 = 1;
    type Config = Size;

    fn create(host: &Host, _: &SceneInfo, config: Size) -> Result<Self, ConfigError> {
        let sheet = sheet(host, "sheet", config.width, &config.wrong)?;
        Ok(Self { host: *host, step: 0, sheet, second: None, wrong: config.wrong })
    }

    fn step(&mut self, input: &StepInput, output: &mut Output) -> Result<Status, StepError> {
        self.step += u64::from(input.dt() > 0.0);
        if self.step == 2 && self.second.is_none() {
            self.second = Some(sheet(&self.host, "second", 3.0, "")?);
        }
        if self.step == 4 && self.wrong == "discard" {
            return Err(StepError::Discard("not this one".to_owned()));
        }
        let mut mesh = self.second.as_ref().unwrap_or(&self.sheet).id();
        if self.step == 3 && self.wrong == "destroyed" {
            self.second = None;
            mesh = 2;
        }
        output.emit(&[abi::Object { id: 1, ..Default::default() }])?;
        output.emit(&[abi::Material { base: [1.0; 4], ..Default::default() }])?;
        output.emit(&[abi::Skinned { mesh, joint_count: 2, scale: 1.0, ..Default::default() }])?;
        let joint = abi::Joint { rotation: [0.0, 0.0, 0.0, 1.0], scale: 1.0, ..Default::default() };
        output.emit(&[joint; 2])?;
        let draw = abi::MeshDraw { mesh: self.sheet.id(), vertex_count: 4, ..Default::default() };
        let first_vertex = if self.wrong == "overlap" && self.step == 3 { 3 } else { 4 };
        output.emit(&[draw, abi::MeshDraw { first_vertex, ..draw }])?;
        output.emit(&[abi::DrawVertex::default(); 8])?;
        Ok(Status::Ok)
    }

    fn save(&self, state: &mut StateWriter) {
        state.put("step", &[self.step]);
    }

    fn load(&mut self, state: &mut StateReader) -> Result<(), StateError> {
        self.step = state.get::<u64>("step")?[0];
        Ok(())
    }
}

fn plugin() -> Loaded {
    Library::from_entry(reef_sdk::entry::<Modeller>(), 2).unwrap().1.remove(0)
}

fn named(outputs: &Outputs) -> (Vec<&str>, u32) {
    (outputs.meshes.iter().map(|mesh| mesh.name.as_str()).collect(), outputs.skinned[0].mesh)
}

#[test]
fn each_steps_outputs_carry_the_meshes_that_there_are() {
    let sea = Sea::default();
    let mut instance = plugin().create(&config(r#"{"width": 0.5}"#)).unwrap();
    let mut seen: Vec<Arc<Outputs>> = Vec::new();
    for step in 0..4 {
        assert_eq!(instance.step(&sea.input(step), &[]).status, StepStatus::Ok);
        seen.push(instance.outputs().clone());
    }
    assert!(Arc::ptr_eq(&seen[2].meshes, &seen[3].meshes), "nothing is copied from step to step");
    assert_eq!(named(&seen[1]), (vec!["sheet"], 1));
    assert_eq!(named(&seen[2]), (vec!["sheet", "second"], 2));
    let mesh = seen[2].meshes[0].clone();
    assert_eq!((mesh.vertices.len(), mesh.indices.len(), mesh.levels.len()), (4, 6, 1));
    drop((instance, seen));
    assert_eq!(Arc::strong_count(&mesh), 1, "nobody else holds what the instance made");
}

#[test]
fn a_load_a_reset_and_a_discarded_step_keep_meshes_and_ids() {
    let sea = Sea::default();
    let mut instance = plugin().create(&config(r#"{"width": 0.5, "wrong": "discard"}"#)).unwrap();
    instance.step(&sea.input(0), &[]);
    let before = instance.outputs().clone();
    let state = instance.save().unwrap();
    // More often than there is room for, were each time's kept.
    for _ in 0..300 {
        instance.load(&state).unwrap();
        instance.reset().unwrap();
    }
    for step in 0..4 {
        instance.step(&sea.input(step), &[]);
        if step == 0 {
            assert_eq!(named(instance.outputs()), named(&before));
        }
    }
    let kept = instance.outputs().clone();
    assert_eq!(instance.step(&sea.input(4), &[]).status, StepStatus::Discarded);
    assert!(Arc::ptr_eq(instance.outputs(), &kept), "the last good picture stays");
    assert_eq!(instance.step(&sea.input(5), &[]).status, StepStatus::Ok);
    assert_eq!(named(instance.outputs()), named(&kept));
}

#[test]
fn what_the_host_refuses_of_a_mesh_is_said_in_its_words() {
    for (wrong, words) in [
        ("nan", "mesh_create: `sheet`: vertex 2: position is NaN"),
        ("weights", "mesh_create: `sheet`: the weights of vertex 2 sum to 1.25, allowed is 1 within 0.001"),
        ("joints", "mesh_create: `sheet`: vertex 3 hangs on joint 2, there are 2"),
    ] {
        let config = config(&format!(r#"{{"width": 0.5, "wrong": "{wrong}"}}"#));
        let error = plugin().create(&config).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
}

#[test]
fn destroyed_meshes_and_overlapping_draws_leave_the_last_picture() {
    let sea = Sea::default();
    for (wrong, words) in [
        ("destroyed", "element 0: mesh is 2, which mesh_create did not hand out, or which was destroyed"),
        ("overlap", "stream mesh draw, element 0: first_vertex leads into the vertices of element 1"),
    ] {
        let text = config(&format!(r#"{{"width": 0.5, "wrong": "{wrong}"}}"#));
        let mut instance = plugin().create(&text).unwrap();
        for step in 0..3 {
            assert_eq!(instance.step(&sea.input(step), &[]).status, StepStatus::Ok);
        }
        let kept = instance.outputs().clone();
        let report = instance.step(&sea.input(3), &[]);
        assert_eq!(report.status, StepStatus::Failed);
        assert!(report.message.as_deref().unwrap_or_default().contains(words), "{report:?}");
        assert!(Arc::ptr_eq(instance.outputs(), &kept) && kept.meshes.len() == 2);
    }
}

/// All that a step emitted.
fn emitted(outputs: &Outputs) -> Vec<Vec<u8>> {
    outputs.all_bytes().map(|(_, _, bytes)| bytes.to_vec()).collect()
}

#[test]
fn a_build_that_takes_over_in_mid_motion_emits_the_same_bytes() {
    let path = artifacts().plugin("reef_fixture_meshes");
    let load = || super::load(path, 2);
    let text = config(r#"{"plants": 5, "fish": 7, "bells": 2}"#);
    let sea = Sea::default();
    let old = load();
    let mut through = old.create(&text).unwrap();
    let mut until = old.create(&text).unwrap();
    for step in 1..=20 {
        assert_eq!(through.step(&sea.input(step), &[]).status, StepStatus::Ok);
        until.step(&sea.input(step), &[]);
    }
    let state = until.save().unwrap();
    drop(until);
    // A copy of the file is another library to the loader.
    let folder = tempfile::tempdir().unwrap();
    let copy = folder.path().join(path.file_name().unwrap());
    std::fs::copy(path, &copy).unwrap();
    let newer = super::load(&copy, 1);
    let mut after = newer.create(&text).unwrap();
    after.load(&state).unwrap();
    for step in 21..=40 {
        through.step(&sea.input(step), &[]);
        assert_eq!(after.step(&sea.input(step), &[]).status, StepStatus::Ok);
        assert_eq!(emitted(through.outputs()), emitted(after.outputs()), "step {step}");
    }
    let outputs = after.outputs();
    assert_eq!((outputs.skinned.len(), outputs.mesh_draws.len(), outputs.meshes.len()), (12, 2, 3));
    let hashes = |outputs: &Outputs| outputs.meshes.iter().map(|mesh| mesh.hash).collect::<Vec<_>>();
    assert_eq!(hashes(through.outputs()), hashes(outputs), "nothing of them is brought to the device anew");
}
