//! Two steps' meshes, made ready for the GPU: instances matched between the steps, those that let light
//! through from far to near.

use glam::{DVec3, Vec3};
use reef_abi as abi;
use reef_streams::{Outputs, frame::Frame, meshes::Mesh};

use super::{
    buffers::Most,
    library::Shelf,
    records::{CUT_OUT, DRAWN_ANEW, FAR_SIDE, GpuInstance, LIT_VEIL, PLAIN, RIGID, SMOOTH, VEIL},
    stand::Canopy,
};
use crate::{matched::Matched, quality::Quality, view::Lens};

/// Everything of meshes that one picture uploads.
#[derive(Clone, Debug, Default)]
pub struct Subject {
    /// First all that hides what is behind it, from near to far, then veils from far to near.
    pub instances: Vec<GpuInstance>,
    /// Joints that all instances are moved by.
    pub palette: u32,
    /// Vertices of all instances at most.
    pub most_vertices: u64,
    /// Indices of all instances at most.
    pub most_indices: u64,
}

/// An instance on its way to its place.
struct Found {
    /// Of its object from the eye [m²].
    distance: f32,
    /// Module and object: what is sorted as one.
    object: (usize, u32),
    instance: GpuInstance,
}

/// What was found: what hides what is behind it, and veils, each in the order of modules and streams.
#[derive(Default)]
struct Finds {
    solids: Vec<Found>,
    veils: Vec<Found>,
    /// Joints so far.
    palette: u32,
}

/// One instance's two steps.
struct Steps<'a> {
    before: &'a Outputs,
    now: &'a Outputs,
    alpha: f32,
    eye: DVec3,
    matched: &'a Matched,
    /// Its meshes by their ids, and their numbers on the shelf; those that are there.
    meshes: Vec<(&'a Mesh, u32)>,
    /// Where its objects and materials begin in the picture's.
    objects: u32,
    materials: u32,
    module: usize,
    /// Where its joints and vertices begin in those of the step before and of this step.
    bases: [[u32; 2]; 2],
}

/// Flattens two steps, whose objects are `matched`. `alpha`: 0 shows the step before, 1 this one. `quality`:
/// at low quality veils are lit at their vertices, where none has a texture.
pub fn gather(
    [previous, current]: [&Frame; 2],
    matched: &[Matched],
    alpha: f32,
    lens: &Lens,
    quality: Quality,
    shelf: &Shelf,
) -> Subject {
    let mut finds = Finds::default();
    let (mut objects, mut materials, mut bases) = (0, 0, [[0; 2]; 2]);
    for (module, (now, matched)) in current.outputs.iter().zip(matched).enumerate() {
        let before = previous.of_module(module);
        let alpha = alpha.clamp(0.0, 1.0);
        let meshes = now.meshes.iter().filter_map(|mesh| Some((&**mesh, shelf.number(mesh)?))).collect();
        let eye = lens.eye;
        let steps = Steps { before, now, alpha, eye, matched, meshes, objects, materials, module, bases };
        steps.gather(&mut finds);
        for (base, outputs) in bases.iter_mut().zip([before, now]) {
            base[0] += outputs.joints.len() as u32;
            base[1] += outputs.draw_vertices.len() as u32;
        }
        objects += now.objects.len() as u32;
        materials += now.materials.len() as u32;
    }
    let Finds { mut solids, mut veils, palette } = finds;
    let mut all = Subject { palette, ..Subject::default() };
    solids.sort_by(|a, b| a.distance.total_cmp(&b.distance));
    all.instances
        .extend((0..).zip(solids).map(|(i, found)| GpuInstance { vertices_of: i, ..found.instance }));
    if quality == Quality::Low && veils.iter().all(|veil| veil.instance.flags & PLAIN != 0) {
        veils.iter_mut().for_each(|veil| veil.instance.flags |= LIT_VEIL);
    }
    hang(&mut all, veils);
    let drawn = all.instances.iter().enumerate().filter(|(i, instance)| instance.vertices_of == *i as u32);
    all.most_vertices = drawn.map(|(_, instance)| shelf.most[instance.mesh as usize][0]).sum();
    all.most_indices = all.instances.iter().map(|instance| shelf.most[instance.mesh as usize][1]).sum();
    all
}

impl Subject {
    /// Leaves out the last of what is more than the device can bind.
    pub(super) fn fit(&mut self, most: &Most) {
        let room = usize::try_from(most.instances).unwrap_or(usize::MAX);
        if self.instances.len() <= room && u64::from(self.palette) <= most.joints {
            return;
        }
        self.instances.truncate(room);
        let count = self.instances.len();
        for instance in &mut self.instances {
            let end = u64::from(instance.palette) + u64::from(instance.joints);
            // Whose vertices it draws may be gone.
            if end > most.joints || instance.vertices_of as usize >= count {
                *instance = GpuInstance { fade: 1.0, joints: 0, ..*instance };
            }
        }
        self.palette = u32::try_from(most.joints).map_or(self.palette, |most| self.palette.min(most));
    }

    /// Takes from instances the light that neighbours in their bed keep.
    pub fn shade(&mut self, canopy: &Canopy, lens: &Lens) {
        let shade = |instance: &mut GpuInstance| instance.shade = canopy.shade(instance.object, lens.eye.y);
        self.instances.iter_mut().for_each(shade);
    }
}

/// Puts veils behind all else, from far to near. What an object's elements turn away from the eye comes
/// first, the outermost before the inner ones; then, the other way round, what faces the eye.
fn hang(all: &mut Subject, mut veils: Vec<Found>) {
    veils.sort_by(|a, b| b.distance.total_cmp(&a.distance).then(a.object.cmp(&b.object)));
    for same in veils.chunk_by(|a, b| a.object == b.object) {
        let first = all.instances.len() as u32;
        let count = same.len() as u32;
        for (i, veil) in same.iter().rev().enumerate() {
            let near = first + 2 * count - 1 - i as u32;
            let flags = veil.instance.flags | FAR_SIDE;
            all.instances.push(GpuInstance { vertices_of: near, flags, ..veil.instance });
        }
        for (i, veil) in same.iter().enumerate() {
            all.instances.push(GpuInstance { vertices_of: first + count + i as u32, ..veil.instance });
        }
    }
}

impl Steps<'_> {
    fn gather(&self, finds: &mut Finds) {
        let (before, now) = (self.before, self.now);
        if now.skinned.is_empty() && now.mesh_draws.is_empty() {
            return;
        }
        let [joints, vertices] = [0, 1].map(|stream| (self.bases[0][stream], self.bases[1][stream]));
        let places = self
            .matched
            .elements(before.skinned.iter().map(|e| e.object), now.skinned.iter().map(|e| e.object));
        for (i, element) in now.skinned.iter().enumerate() {
            let then = places.of(i).map(|j| &before.skinned[j]).filter(|then| {
                then.mesh == element.mesh
                    && then.joint_count == element.joint_count
                    && !self.jumped(element.object, element.flags)
            });
            let look = [element.phase, element.hue, element.value, element.fade];
            let Some(mut instance) = self.instance(element.object, element.mesh, element.material, look)
            else {
                continue;
            };
            instance.flags |= if element.joint_count == 1 { RIGID } else { 0 };
            instance.current = joints.1 + element.first_joint;
            instance.previous = then.map_or(0, |then| joints.0 + then.first_joint);
            instance.blend = if then.is_some() { self.alpha } else { 1.0 };
            instance.joints = element.joint_count;
            instance.palette = finds.palette;
            instance.scale = element.scale;
            finds.palette += element.joint_count;
            self.put(finds, element.object, instance);
        }
        let places = self
            .matched
            .elements(before.mesh_draws.iter().map(|e| e.object), now.mesh_draws.iter().map(|e| e.object));
        for (i, element) in now.mesh_draws.iter().enumerate() {
            let jumped = self.jumped(element.object, element.flags);
            // A mesh of another build may have the same number.
            let then = places.of(i).map(|j| &before.mesh_draws[j]).filter(|then| {
                then.mesh == element.mesh && then.vertex_count == element.vertex_count && !jumped
            });
            let look = [element.phase, element.hue, element.value, element.fade];
            let Some(mut instance) = self.instance(element.object, element.mesh, element.material, look)
            else {
                continue;
            };
            let object = &now.objects[element.object as usize];
            instance.flags |= DRAWN_ANEW;
            instance.current = vertices.1 + element.first_vertex;
            instance.previous = then.map_or(0, |then| vertices.0 + then.first_vertex);
            instance.blend = if then.is_some() { self.alpha } else { 1.0 };
            instance.scale = 1.0;
            instance.center = object.bounds_center;
            instance.radius = object.bounds_radius;
            self.put(finds, element.object, instance);
        }
    }

    fn jumped(&self, object: u32, flags: u32) -> bool {
        (flags | self.now.objects[object as usize].flags) & abi::FLAG_NO_BLEND != 0
    }

    fn mesh(&self, id: u32) -> Option<(&Mesh, u32)> {
        self.meshes.binary_search_by_key(&id, |(mesh, _)| mesh.id).ok().map(|at| self.meshes[at])
    }

    /// What skinned meshes and mesh draws have in common. None: its mesh is not on the device.
    fn instance(&self, object: u32, mesh: u32, material: u32, look: [f32; 4]) -> Option<GpuInstance> {
        let (mesh, number) = self.mesh(mesh)?;
        let surface = self.now.materials.get(material as usize)?;
        let mut flags = match (surface.texture, surface.pattern) {
            (0, abi::PATTERN_NONE) => PLAIN | SMOOTH,
            (0, _) => PLAIN,
            _ => 0,
        };
        if surface.base[3] < 1.0 || !mesh.opaque {
            flags |= VEIL;
        }
        if surface.texture != 0 && mesh.flags & abi::MESH_CUT_OUT != 0 {
            flags |= CUT_OUT;
        }
        let [phase, hue, value, fade] = look;
        Some(GpuInstance {
            object: self.objects + object,
            mesh: number,
            material: self.materials + material,
            flags,
            phase,
            hue,
            value,
            fade,
            ..GpuInstance::default()
        })
    }

    fn put(&self, finds: &mut Finds, object: u32, instance: GpuInstance) {
        let seen = &self.now.objects[object as usize];
        let middle = (DVec3::from(seen.origin) - self.eye).as_vec3() + Vec3::from(seen.bounds_center);
        let found = Found { distance: middle.length_squared(), object: (self.module, object), instance };
        let veil = instance.flags & VEIL != 0;
        if veil { finds.veils.push(found) } else { finds.solids.push(found) }
    }
}
