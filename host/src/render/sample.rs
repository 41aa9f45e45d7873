//! Small seas made by hand: what tests and benches of the renderer look at when they need no plugin.

use std::sync::Arc;

use glam::{DVec3, Quat, Vec3};
use reef_abi as abi;

use crate::{
    plugin::streams::Outputs,
    world::{
        environment::{Environment, Rock, Sun, Terrain, WaterOptics},
        frame::{CameraPose, Frame},
    },
};

/// Clear reef water, 4 m deep, a rippled bed with one rock.
pub fn environment() -> Environment {
    let columns = 65;
    let rows = 65;
    let heights = (0..rows * columns)
        .map(|i| {
            let (x, z) = ((i % columns) as f32, (i / columns) as f32);
            -4.0 + 0.25 * (x * 0.21).sin() * (z * 0.17).cos()
        })
        .collect();
    Environment {
        optics: WaterOptics {
            beam: [0.20, 0.115, 0.10],
            downwelling: [0.09, 0.035, 0.025],
            scattered: [0.035, 0.20, 0.36],
        },
        sun: Sun {
            direction: Vec3::new(0.35, 0.85, -0.25).normalize(),
            color: [1.15, 1.1, 0.95],
            ambient: [0.32, 0.42, 0.46],
        },
        terrain: Some(Arc::new(Terrain {
            origin: [-16.0, -16.0],
            cell: 0.5,
            columns,
            rows,
            heights,
            rocks: vec![Rock {
                position: [1.4, -3.9, -1.8],
                half_axes: [0.8, 0.55, 0.6],
                yaw: 0.4,
                seed: 7,
            }],
        })),
        plain_background: None,
        waves: Vec::new(),
    }
}

/// A camera at `eye` that looks at `target`.
pub fn looking_at(eye: DVec3, target: DVec3) -> CameraPose {
    let forward = (target - eye).normalize_or(DVec3::NEG_Z).as_vec3();
    let right = forward.cross(Vec3::Y).normalize_or(Vec3::X);
    let up = right.cross(forward);
    let rotation = Quat::from_mat3(&glam::Mat3::from_cols(right, up, -forward));
    CameraPose { position: eye, rotation, fov_y: 1.0 }
}

/// Tissue like that of an anemone's tentacles.
pub fn tissue() -> abi::Material {
    abi::Material {
        base: [0.32, 0.16, 0.07, 1.0],
        tip: [0.62, 0.18, 0.52, 0.6],
        accent: [0.9, 0.8, 0.5, 0.2],
        translucency: 0.8,
        wrap: 0.5,
        rim: 0.6,
        roughness: 1.0,
        specular: 0.0003,
        ..abi::Material::default()
    }
}

/// How a bed of [`tentacles`] is laid out.
#[derive(Clone, Copy, Debug)]
pub struct Bed {
    /// Tentacles in all.
    pub count: usize,
    /// Distance between neighbours [m].
    pub spacing: f32,
    /// Tentacles side by side in a row along x.
    pub per_row: usize,
    /// y of the roots [m].
    pub y: f64,
    /// Length of a tentacle [m].
    pub length: f32,
    /// Radius at the root [m]; the tip has 0.4 of it.
    pub radius: f32,
}

/// A bed of tentacles that lean and curl, each differently; `sway` turns them, so that two steps differ.
pub fn tentacles(bed: &Bed, sway: f32) -> Outputs {
    const NODES: usize = 10;
    let mut outputs = Outputs { materials: Arc::new(vec![tissue()]), ..Outputs::default() };
    outputs.objects.push(abi::Object {
        id: 1,
        origin: [0.0, bed.y, 0.0],
        bounds_radius: 100.0,
        ..abi::Object::default()
    });
    for i in 0..bed.count {
        let hash = (i as u32).wrapping_mul(0x9e37_79b1);
        let unit = |shift: u32| ((hash >> shift) & 255) as f32 / 255.0;
        let column = (i % bed.per_row) as f32 - (bed.per_row - 1) as f32 * 0.5;
        let row = (i / bed.per_row) as f32;
        let root = Vec3::new(
            (column + 0.5 * (unit(0) - 0.5)) * bed.spacing,
            0.0,
            -(row + 0.5 * (unit(8) - 0.5)) * bed.spacing,
        );
        let first_node = outputs.fibre_nodes.len() as u32;
        let azimuth = unit(16) * std::f32::consts::TAU;
        let lean = 0.25 + 0.5 * unit(4) + sway;
        let step = bed.length / (NODES - 1) as f32;
        let mut p = root;
        for n in 0..NODES {
            let t = n as f32 / (NODES - 1) as f32;
            outputs.fibre_nodes.push(abi::FibreNode { position: p.to_array(), radius: bed.radius * (1.0 - 0.6 * t) });
            let bend = lean * (0.3 + 1.4 * t);
            let turn = azimuth + 0.8 * t;
            p += step * Vec3::new(bend.sin() * turn.cos(), bend.cos(), bend.sin() * turn.sin());
        }
        outputs.fibres.push(abi::Fibre {
            object: 0,
            first_node,
            node_count: NODES as u32,
            material: 0,
            sides: 8,
            variation: hash,
            flatness: 1.0,
            normal: [azimuth.cos(), 0.0, azimuth.sin()],
            ..abi::Fibre::default()
        });
    }
    outputs
}

/// A frame that holds one instance's outputs.
pub fn frame(step: u64, camera: CameraPose, outputs: Outputs) -> Frame {
    Frame {
        step,
        time: step as f64 / 60.0,
        camera,
        outputs: vec![Arc::new(outputs)],
        flow: Arc::new(Vec::new()),
    }
}
