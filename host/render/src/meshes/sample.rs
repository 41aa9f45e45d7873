//! Small seas of meshes made by hand: what tests and benches of the mesh passes look at when they need no
//! plugin.

use glam::Vec3;
use reef_abi as abi;
use reef_shapes::{Shape, bell, bell::Bell, fish, grass, plant};
use reef_streams::{
    Outputs,
    meshes::{MeshList, Meshes, Wanted},
};

/// Meshes of a plant, a body, a bell, grass, and a bell whose levels begin late among its vertices (ids 1 to
/// 5), and what moves them.
pub struct Models {
    /// The meshes.
    pub list: MeshList,
    bell: Bell,
}

impl Default for Models {
    fn default() -> Self {
        let bell = Bell::new();
        let mut meshes = Meshes::default();
        for shape in [&plant::shape(), &fish::shape(), &bell.shape, &grass::shape(), &reversed(&bell.shape)] {
            // The shapes are sound; one that were not would be missed in every picture.
            let made = meshes.add(wanted(shape));
            debug_assert!(matches!(made, Ok(Ok(_))), "{made:?}");
        }
        Self { list: meshes.list().clone(), bell }
    }
}

/// The same shape with its vertices the other way round: what its coarser levels have comes last.
fn reversed(shape: &Shape) -> Shape {
    let mut shape = shape.clone();
    let count = shape.vertices.len() as u32;
    shape.vertices.reverse();
    shape.indices.iter_mut().for_each(|index| *index = count - 1 - *index);
    for level in &mut shape.levels {
        level.first_vertex = count - level.first_vertex - level.vertex_count;
    }
    shape
}

/// As an instance asks for it.
pub fn wanted(shape: &Shape) -> Wanted<'_> {
    Wanted {
        name: shape.name,
        vertices: &shape.vertices,
        indices: &shape.indices,
        levels: &shape.levels,
        rest: &shape.rest,
        influences: shape.influences,
        joints: &shape.joints,
        weights: &shape.weights,
        flags: shape.flags,
    }
}

/// Green leaf, orange scale, clear jelly, grass.
fn materials() -> Vec<abi::Material> {
    let tissue = abi::Material { wrap: 0.5, rim: 0.3, roughness: 1.0, ..abi::Material::default() };
    vec![
        abi::Material {
            base: [0.10, 0.16, 0.03, 1.0],
            tip: [0.34, 0.36, 0.07, 0.3],
            translucency: 0.9,
            ..tissue
        },
        abi::Material {
            base: [0.90, 0.15, 0.01, 1.0],
            tip: [0.88, 0.14, 0.01, 0.9],
            accent: [0.92, 0.90, 0.86, 0.22],
            pattern: abi::PATTERN_BANDS,
            pattern_scale: 3.0,
            pattern_softness: 0.1,
            translucency: 0.6,
            ..tissue
        },
        abi::Material {
            base: [0.62, 0.77, 0.89, 0.14],
            tip: [0.75, 0.85, 0.95, 0.8],
            translucency: 1.0,
            ..tissue
        },
        abi::Material {
            base: [0.10, 0.30, 0.03, 1.0],
            tip: [0.20, 0.40, 0.05, 0.3],
            translucency: 0.8,
            ..tissue
        },
    ]
}

impl Models {
    /// Outputs without anything in them but meshes and materials.
    pub fn empty(&self) -> Outputs {
        Outputs { materials: materials(), meshes: self.list.clone(), ..Outputs::default() }
    }

    /// A plant on the ground.
    pub fn plant(&self, outputs: &mut Outputs, origin: [f64; 3], size: f32, time: f32) {
        let mut joints = [abi::Joint::default(); plant::JOINTS];
        plant::sway(origin[0] as f32, origin[2] as f32, time, size, &mut joints);
        skinned(outputs, 1, origin, (Vec3::Y * (0.5 * size), 0.8 * size), size, &joints);
    }

    /// A shoot of grass whose joints bend by an angle [rad] each.
    pub fn grass(&self, outputs: &mut Outputs, origin: [f64; 3], size: f32, angle: f32) {
        let mut joints = [abi::Joint::default(); grass::JOINTS];
        grass::bend(angle, size, &mut joints);
        skinned(outputs, 4, origin, (Vec3::Y * (0.25 * size), 0.4 * size), size, &joints);
    }

    /// A body that swims.
    pub fn fish(&self, outputs: &mut Outputs, origin: [f64; 3], heading: f32, time: f32) {
        let mut joints = [abi::Joint::default(); fish::JOINTS];
        fish::swim(2.0, time, heading, &mut joints);
        skinned(outputs, 2, origin, (Vec3::ZERO, 0.09), 1.0, &joints);
    }

    /// A bell that pulses.
    pub fn bell(&self, outputs: &mut Outputs, origin: [f64; 3], size: f32, time: f32) {
        self.pulse(outputs, 3, origin, size, time);
    }

    /// The same bell, whose levels begin late among its vertices.
    pub fn late_bell(&self, outputs: &mut Outputs, origin: [f64; 3], size: f32, time: f32) {
        self.pulse(outputs, 5, origin, size, time).reverse();
    }

    /// A bell with this mesh; returns its vertices.
    fn pulse<'a>(
        &self,
        outputs: &'a mut Outputs,
        mesh: u32,
        origin: [f64; 3],
        size: f32,
        time: f32,
    ) -> &'a mut [abi::DrawVertex] {
        let first_vertex = outputs.draw_vertices.len();
        outputs.draw_vertices.resize(first_vertex + bell::VERTICES, abi::DrawVertex::default());
        let object = object(outputs, origin, (Vec3::ZERO, 0.2 * size));
        outputs.mesh_draws.push(abi::MeshDraw {
            object,
            mesh,
            material: 2,
            first_vertex: first_vertex as u32,
            vertex_count: bell::VERTICES as u32,
            ..abi::MeshDraw::default()
        });
        let vertices = &mut outputs.draw_vertices[first_vertex..];
        self.bell.pulse(time, size, vertices);
        vertices
    }
}

fn object(outputs: &mut Outputs, origin: [f64; 3], (center, radius): (Vec3, f32)) -> u32 {
    let number = outputs.objects.len();
    outputs.objects.push(abi::Object {
        id: number as u64 + 1,
        origin,
        bounds_center: center.to_array(),
        bounds_radius: radius,
        ..abi::Object::default()
    });
    number as u32
}

fn skinned(
    outputs: &mut Outputs,
    mesh: u32,
    origin: [f64; 3],
    bounds: (Vec3, f32),
    scale: f32,
    joints: &[abi::Joint],
) {
    let element = abi::Skinned {
        object: object(outputs, origin, bounds),
        mesh,
        material: mesh - 1,
        first_joint: outputs.joints.len() as u32,
        joint_count: joints.len() as u32,
        scale,
        ..abi::Skinned::default()
    };
    outputs.skinned.push(element);
    outputs.joints.extend_from_slice(joints);
}
