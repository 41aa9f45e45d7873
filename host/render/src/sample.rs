//! Small seas made by hand: what tests and benches of the renderer look at when they need no plugin.

use std::sync::Arc;

use glam::{DVec3, Quat, Vec3};
use reef_abi as abi;
use reef_streams::{
    Outputs,
    environment::{Environment, Ripples, Rock, Sun, Terrain, WaterOptics},
    frame::{CameraPose, Frame},
    identity::ModuleTag,
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
            shafts: 1.0,
        },
        terrain: Some(Arc::new(Terrain {
            origin: [-16.0, -16.0],
            cell: 0.5,
            columns,
            rows,
            heights,
            rocks: vec![Rock { position: [1.4, -3.9, -1.8], half_axes: [0.8, 0.55, 0.6], yaw: 0.4, seed: 7 }],
            ripples: Ripples::default(),
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
    let mut outputs = Outputs { materials: vec![tissue()], ..Outputs::default() };
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
            outputs
                .fibre_nodes
                .push(abi::FibreNode { position: p.to_array(), radius: bed.radius * (1.0 - 0.6 * t) });
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

/// The tissue of a blade of seagrass.
pub fn blade_material() -> abi::Material {
    abi::Material {
        base: [0.10, 0.16, 0.04, 1.0],
        tip: [0.30, 0.34, 0.10, 0.4],
        translucency: 0.5,
        wrap: 0.5,
        rim: 0.2,
        ..abi::Material::default()
    }
}

/// An anemone made by hand: a wide foot with a disc, tentacles around it in a spiral, leaning outward and
/// swaying.
pub fn anemone(outputs: &mut Outputs, id: u64, origin: [f64; 3], size: f32, materials: [u32; 2], sway: f32) {
    let object = outputs.objects.len() as u32;
    let push = |outputs: &mut Outputs, nodes: &[(Vec3, f32)], fibre: abi::Fibre| {
        let first_node = outputs.fibre_nodes.len() as u32;
        outputs
            .fibre_nodes
            .extend(nodes.iter().map(|&(p, radius)| abi::FibreNode { position: p.to_array(), radius }));
        outputs.fibres.push(abi::Fibre {
            object,
            first_node,
            node_count: nodes.len() as u32,
            flatness: 1.0,
            ..fibre
        });
    };
    outputs.objects.push(abi::Object {
        id,
        origin,
        bounds_center: [0.0, size * 0.6, 0.0],
        bounds_radius: size * 1.3,
        ..abi::Object::default()
    });
    let foot: Vec<(Vec3, f32)> = (0..10)
        .map(|i| {
            let t = i as f32 / 9.0;
            let radius = size * (0.36 - 0.12 * (t * std::f32::consts::PI).sin() + 0.06 * t);
            (Vec3::new(sway * 0.1 * t * size, size * 0.6 * t - 0.01, 0.0), radius)
        })
        .collect();
    let normal = [0.0, 0.0, 1.0];
    push(
        outputs,
        &foot,
        abi::Fibre {
            material: materials[0],
            sides: 32,
            flags: abi::FIBRE_CAP,
            normal,
            ..abi::Fibre::default()
        },
    );
    for n in 0..70_u32 {
        let hash = (n + 1).wrapping_mul(0x9e37_79b1) ^ (id as u32).wrapping_mul(0x85eb_ca6b);
        let unit = |shift: u32| ((hash >> shift) & 255) as f32 / 255.0;
        let azimuth = n as f32 * 137.507_76_f32.to_radians();
        let share = 0.35 + 0.6 * ((n as f32 + 0.5) / 70.0).sqrt();
        let out = Vec3::new(azimuth.cos(), 0.0, azimuth.sin());
        let mut p = Vec3::new(sway * 0.1 * size, size * 0.57, 0.0) + out * (size * 0.38 * share);
        let mut nodes = Vec::new();
        let length = size * (0.75 + 0.25 * unit(3));
        for i in 0..10 {
            let t = i as f32 / 9.0;
            nodes.push((p, size * 0.055 * (1.0 - 0.55 * t)));
            let bend = (0.25 + 0.9 * share) * (0.35 + 0.9 * t) + 0.25 * (unit(11) - 0.5) * t;
            let lean = Vec3::new((sway + 0.3 * (unit(5) - 0.5)) * t, 0.0, 0.25 * (unit(19) - 0.5) * t);
            p += (out * bend.sin() + Vec3::Y * bend.cos() + lean).normalize_or(Vec3::Y) * (length / 9.0);
        }
        push(
            outputs,
            &nodes,
            abi::Fibre {
                material: materials[1],
                sides: 8,
                variation: hash,
                normal: [-azimuth.sin(), 0.0, azimuth.cos()],
                ..abi::Fibre::default()
            },
        );
    }
}

/// A tuft of seagrass.
pub fn grass(outputs: &mut Outputs, id: u64, origin: [f64; 3], material: u32, sway: f32) {
    let object = outputs.objects.len() as u32;
    outputs.objects.push(abi::Object { id, origin, bounds_radius: 0.5, ..abi::Object::default() });
    for n in 0..24_u32 {
        let hash = (n + 3).wrapping_mul(0x9e37_79b1) ^ (id as u32).wrapping_mul(0x85eb_ca6b);
        let unit = |shift: u32| ((hash >> shift) & 255) as f32 / 255.0;
        let first_node = outputs.fibre_nodes.len() as u32;
        let turn = unit(1) * std::f32::consts::TAU;
        let mut p = Vec3::new(0.25 * (unit(9) - 0.5), -0.02, 0.25 * (unit(17) - 0.5));
        let length = 0.35 + 0.35 * unit(5);
        for i in 0..8 {
            let t = i as f32 / 7.0;
            outputs
                .fibre_nodes
                .push(abi::FibreNode { position: p.to_array(), radius: 0.006 * (1.05 - t) + 0.001 });
            let bend = (0.15 + 0.3 * unit(21)) * t + sway * t;
            p += (length / 7.0)
                * Vec3::new(bend.sin() + 0.1 * turn.cos() * t, bend.cos(), 0.3 * turn.sin() * t)
                    .normalize_or(Vec3::Y);
        }
        outputs.fibres.push(abi::Fibre {
            object,
            first_node,
            node_count: 8,
            material,
            flags: abi::FIBRE_BLADE,
            sides: 6,
            variation: hash,
            flatness: 0.15,
            normal: [turn.cos(), 0.0, turn.sin()],
            ..abi::Fibre::default()
        });
    }
}

/// A small garden on the bed of [`environment`]: three anemones, seagrass, more anemones far away.
pub fn garden(environment: &Environment, sway: f32) -> Outputs {
    let foot = abi::Material {
        base: [0.42, 0.30, 0.16, 1.0],
        tip: [0.60, 0.46, 0.26, 0.7],
        accent: [0.62, 0.55, 0.30, 0.25],
        pattern: abi::PATTERN_SPOTS,
        pattern_scale: 90.0,
        pattern_softness: 0.3,
        translucency: 0.2,
        wrap: 0.4,
        rim: 0.4,
        ..abi::Material::default()
    };
    let red = abi::Material {
        base: [0.27, 0.015, 0.04, 1.0],
        tip: [0.60, 0.05, 0.09, 0.4],
        translucency: 0.9,
        wrap: 0.5,
        rim: 0.6,
        ..abi::Material::default()
    };
    let red_foot = abi::Material {
        base: [0.39, 0.01, 0.02, 1.0],
        tip: [0.30, 0.01, 0.03, 0.6],
        accent: [0.34, 0.43, 0.07, 0.12],
        pattern: abi::PATTERN_SPOTS,
        pattern_scale: 160.0,
        pattern_softness: 0.2,
        translucency: 0.2,
        wrap: 0.4,
        rim: 0.4,
        ..abi::Material::default()
    };
    let mut outputs =
        Outputs { materials: vec![foot, tissue(), red_foot, red, blade_material()], ..Outputs::default() };
    let ground = |x: f64, z: f64| match &environment.terrain {
        Some(terrain) => f64::from(super::boulder::ground_height(terrain, x, z)),
        None => -4.0,
    };
    let mut id = 0;
    let mut place = |outputs: &mut Outputs, x: f64, z: f64, size: f32, materials: [u32; 2]| {
        id += 1;
        anemone(outputs, id, [x, ground(x, z), z], size, materials, sway + 0.1 * (id as f32).sin());
    };
    place(&mut outputs, 0.0, 0.0, 0.22, [0, 1]);
    place(&mut outputs, 0.75, -0.5, 0.12, [2, 3]);
    place(&mut outputs, -0.8, -0.7, 0.14, [2, 3]);
    for i in 0..14 {
        let angle = f64::from(i) * 2.4;
        let r = 2.0 + 0.55 * f64::from(i);
        place(
            &mut outputs,
            r * angle.cos(),
            -2.5 - r * angle.sin().abs(),
            0.18,
            [(i % 2) as u32 * 2, 1 + (i % 2) as u32 * 2],
        );
    }
    for i in 0..12_u64 {
        let (x, z) = (-2.6 + 0.45 * i as f64, -2.0 - 0.4 * ((i * 7) % 5) as f64);
        grass(&mut outputs, 100 + i, [x, ground(x, z), z], 4, 0.3 + sway);
    }
    outputs
}

/// Specks that hang in a box (two corners [m]), of 0.3 to 1 times a size [m], all turned to the viewer; the
/// same for the same count.
pub fn snow(count: usize, corners: [DVec3; 2], size: f32) -> Outputs {
    let [low, high] = corners;
    let mut outputs = Outputs::default();
    let middle = (low + high) * 0.5;
    outputs.objects.push(abi::Object { id: 1, origin: middle.to_array(), ..abi::Object::default() });
    let half = ((high - low) * 0.5).as_vec3();
    // The plastic number's sequence fills a box evenly.
    let unit = |i: usize, step: f64| ((i as f64 + 0.5) * step).fract() as f32;
    outputs.billboards = (0..count)
        .map(|i| {
            let at = Vec3::new(unit(i, 0.819_172_513), unit(i, 0.671_043_607), unit(i, 0.549_700_478));
            abi::Billboard {
                position: ((at * 2.0 - 1.0) * half).to_array(),
                size: size * (0.3 + 0.7 * unit(i, 0.380_277)),
                opacity: 0.6,
                velocity: [0.02, -0.01, 0.0],
                roll: unit(i, 0.618_034) * std::f32::consts::TAU,
                color: 0xffc8_d8e0,
                flags: abi::BILLBOARD_FACING,
                ..abi::Billboard::default()
            }
        })
        .collect();
    outputs
}

/// A frame that holds one instance's outputs.
pub fn frame(step: u64, camera: CameraPose, outputs: Outputs) -> Frame {
    Frame {
        step,
        time: step as f64 / 60.0,
        camera,
        outputs: vec![Arc::new(outputs)],
        tags: ModuleTag::all(&["sample"]).into(),
        flow: Arc::new(Vec::new()),
    }
}
