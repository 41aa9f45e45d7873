//! What a step hands to the renderer: an object, an element and the joints of each fish.

use glam::Vec3;
use reef_sdk::{
    Chunks, Parts, Workers,
    abi::{Actor, Joint, Object, Skinned, fnv1a_32},
};

use crate::shoal::{Shoal, id_of};

/// Fish that one job writes.
const CHUNK: usize = 32;
/// How far the skin is at most from the fish's centre, over that at rest: a bent fish is shorter, a squeezed
/// one a little longer.
const SLACK: f64 = 1.25;
/// Hues of individuals differ by ± this [rad], and their lightness by ± this share.
const HUE: f32 = 0.05;
const VALUE: f32 = 0.09;

/// What the renderer knows a species by.
#[derive(Clone, Debug)]
pub(crate) struct Wear {
    /// From `mesh_create`.
    pub(crate) mesh: u32,
    /// Among the materials.
    pub(crate) material: u32,
    /// Of the mesh at a size of 1 [m].
    pub(crate) radius: f64,
    /// Of the species' name.
    pub(crate) hash: u32,
}

impl Wear {
    pub(crate) fn new(name: &str, mesh: u32, material: u32, radius: f64) -> Self {
        Self { mesh, material, radius, hash: fnv1a_32(name.as_bytes()) }
    }
}

/// Draws a shoal, whose fish never come or go.
#[derive(Debug)]
pub(crate) struct Brush {
    /// Where the joints of each chunk of fish begin, and the end.
    bounds: Vec<usize>,
    /// Room for the nodes of a fish, of each worker.
    rooms: Vec<Vec<[f32; 3]>>,
    most_nodes: usize,
}

impl Brush {
    pub(crate) fn new(shoal: &Shoal) -> Self {
        let sections = |kind: u32| shoal.kinds()[kind as usize].plan.body().segments().len();
        let mut bounds = vec![0];
        let fish: Vec<usize> = shoal.fish().iter().map(|fish| sections(fish.kind)).collect();
        for chunk in fish.chunks(CHUNK) {
            bounds.push(bounds[bounds.len() - 1] + chunk.iter().sum::<usize>());
        }
        let bodies = shoal.kinds().iter().map(|kind| kind.plan.body());
        Self {
            bounds,
            rooms: Vec::new(),
            most_nodes: bodies.map(|body| body.nodes().len()).max().unwrap_or(0),
        }
    }

    /// How many joints [`Brush::draw`] writes.
    pub(crate) fn joints(&self) -> usize {
        self.bounds[self.bounds.len() - 1]
    }

    /// Writes an object of each fish: the same in every step, whether anything is drawn or not.
    pub(crate) fn objects(shoal: &Shoal, wears: &[Wear], objects: &mut [Object]) {
        for (number, (object, fish)) in objects.iter_mut().zip(shoal.fish().iter()).enumerate() {
            *object = Object {
                id: id_of(number),
                origin: fish.position.to_array(),
                bounds_radius: (SLACK * wears[fish.kind as usize].radius * fish.size) as f32,
                ..Object::default()
            };
        }
    }

    /// Writes an element of each fish, and their joints. `fade`: which share of the skin is not there.
    pub(crate) fn draw(
        &mut self,
        shoal: &Shoal,
        wears: &[Wear],
        fade: f32,
        workers: Workers<'_>,
        (elements, joints): (&mut [Skinned], &mut [Joint]),
    ) {
        let Self { bounds, rooms, most_nodes } = self;
        if rooms.len() < workers.count() {
            rooms.resize_with(workers.count(), || vec![[0.0; 3]; *most_nodes]);
        }
        let bounds = &*bounds;
        let split = (Chunks::new(elements, CHUNK), Parts::new(joints, bounds));
        workers.for_each_part_with(rooms, split, |room, part, (elements, mut joints)| {
            let mut first_joint = bounds[part];
            for (number, element) in (part * CHUNK..).zip(elements) {
                let fish = shoal.fish().one(number);
                let body = shoal.kinds()[fish.kind as usize].plan.body();
                let wear = &wears[fish.kind as usize];
                let (own, rest) = core::mem::take(&mut joints).split_at_mut(body.segments().len());
                joints = rest;
                let origin = shoal.frames(number, &mut room[..body.nodes().len()], own);
                // Its place is the object's: what a body's nodes are relative to goes along in jumps.
                let off = (origin - fish.position).as_vec3();
                for joint in own.iter_mut() {
                    joint.translation = (Vec3::from(joint.translation) + off).to_array();
                    // The fish's size is the element's.
                    joint.scale /= fish.size as f32;
                }
                let [hue, value] = fish.tints();
                *element = Skinned {
                    object: number as u32,
                    mesh: wear.mesh,
                    material: wear.material,
                    first_joint: first_joint as u32,
                    joint_count: own.len() as u32,
                    scale: fish.size as f32,
                    hue: HUE * hue,
                    value: VALUE * value,
                    fade,
                    ..Skinned::default()
                };
                first_joint += own.len();
            }
        });
    }

    /// Writes what others perceive of each fish.
    pub(crate) fn actors(shoal: &Shoal, wears: &[Wear], actors: &mut [Actor]) {
        for (number, (actor, fish)) in actors.iter_mut().zip(shoal.fish().iter()).enumerate() {
            let kind = &shoal.kinds()[fish.kind as usize];
            *actor = Actor {
                id: id_of(number),
                position: fish.position.to_array(),
                velocity: (fish.course * fish.speed + fish.water).to_array(),
                radius: (0.5 * kind.length() * fish.size) as f32,
                forward: fish.course.to_array(),
                species: wears[fish.kind as usize].hash,
                ..Actor::default()
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Quat};

    use super::*;
    use crate::{
        mesh::shape,
        shoal::{Habitat, Kind, Start},
        species::Species,
    };

    #[test]
    fn at_rest_the_joints_are_those_of_the_mesh_turned_and_enlarged() {
        let species = Species::default();
        let kind = Kind::new(&species, Vec::new()).expect("a kind");
        let mesh = shape(&species, &kind.plan);
        let habitat = Habitat { low: DVec3::splat(-9.0), high: DVec3::splat(9.0) };
        let start = Start {
            kind: 0,
            position: DVec3::new(1.0, -2.0, 3.0),
            heading: 0.5,
            size: 1.5,
            habitat: 0,
            home: None,
            seed: 1,
        };
        let starts = vec![start; 40];
        let shoal = Shoal::new(vec![kind], vec![habitat], &starts).expect("a shoal");
        let wears = [Wear::new("any", 1, 0, mesh.radius)];
        let mut brush = Brush::new(&shoal);
        let mut objects = vec![Object::default(); 40];
        let mut elements = vec![Skinned::default(); 40];
        let mut joints = vec![Joint::default(); brush.joints()];
        Brush::objects(&shoal, &wears, &mut objects);
        brush.draw(&shoal, &wears, 0.0, Workers::inline(), (&mut elements, &mut joints));
        let turn = Quat::from_rotation_y(0.5);
        for (number, (object, element)) in objects.iter().zip(&elements).enumerate() {
            assert_eq!((object.id, object.origin), (number as u64 + 1, [1.0, -2.0, 3.0]));
            assert_eq!((element.object as usize, element.scale), (number, 1.5));
            let own = &joints[element.first_joint as usize..][..element.joint_count as usize];
            assert_eq!(own.len(), mesh.rest.len());
            for (joint, rest) in own.iter().zip(&mesh.rest) {
                let place = turn * (Vec3::from(rest.translation) * 1.5);
                assert!(place.distance(Vec3::from(joint.translation)) < 1e-5, "{joint:?} {place}");
                let wanted = turn * Quat::from_array(rest.rotation);
                assert!(wanted.dot(Quat::from_array(joint.rotation)).abs() > 1.0 - 1e-5, "{joint:?}");
            }
        }
    }
}
