//! Two steps' streams, made ready for the GPU: fibres matched between the steps, origins relative to the eye.

use glam::{DVec3, Vec3};
use reef_abi as abi;
use reef_streams::{Outputs, frame::Frame};

use super::{layers::Catalogue, lod::RIBBON, matched::Matched, steps, view::Lens};

/// A flag of [`GpuFibre`], as `shaders/fibre.glsl` has it: the end is closed.
pub const CAP: u32 = 2;
/// As above: a flat blade.
pub const BLADE: u32 = 4;

reef_gpu::record! {
    /// `Fibre` of `shaders/fibre.glsl`.
    pub struct GpuFibre = "Fibre" {
        /// Index into the objects.
        pub object: u32,
        /// Its first node in the step before.
        pub previous_node: u32,
        /// Its first node in this step.
        pub current_node: u32,
        /// Node count, and [`CAP`] and [`BLADE`] in the high half.
        pub nodes_flags: u32,
        /// Index into the materials.
        pub material: u32,
        /// The contract's hash of differences between neighbours.
        pub variation: u32,
        /// Vertices of a ring at full detail; 2: a blade.
        pub sides: u32,
        /// Thickness over width of a blade.
        pub flatness: f32,
        /// Angle 0 of the first ring in this step.
        pub normal: [f32; 3],
        /// 1: it stands as in this step; 0: it is between the two, as the picture is.
        pub stands: f32,
        /// Angle 0 of the first ring in the step before.
        pub previous_normal: [f32; 3],
        /// 1: round, without a cap, of one opaque tissue without a pattern.
        pub plain: u32,
    }
}

reef_gpu::record! {
    /// `Object` of `shaders/fibre.glsl`: origins relative to the eye [m].
    pub struct GpuObject = "Object" {
        /// In the step before.
        pub previous: [f32; 3],
        /// 0: an object is two texels.
        pub previous_end: u32,
        /// In this step.
        pub current: [f32; 3],
        /// 0.
        pub current_end: u32,
    }
}

reef_gpu::record! {
    /// `Line` of `shaders/line.vert`.
    pub struct GpuLine = "Line" {
        /// Relative to the eye [m].
        pub from: [f32; 3],
        /// sRGB 0xAABBGGRR.
        pub color: u32,
        /// Relative to the eye [m].
        pub to: [f32; 3],
    }
}

/// Something that stands on the ground and keeps light from it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stander {
    /// World position of its object [m]: it stays while the rest of the plant sways.
    pub origin: DVec3,
    /// World position of its base [m].
    pub base: DVec3,
    /// Radius of the base [m].
    pub base_radius: f32,
    /// Radius of what is above [m].
    pub crown_radius: f32,
    /// Height of that above the base [m].
    pub crown_height: f32,
    /// Share of the light that the crown takes away, of what a whole one does.
    pub cover: f32,
    /// How high it is, where its crown goes up from the ground [m]; 0: it is all at one height.
    pub tall: f32,
}

/// What is gathered of two steps for a picture: fibres and lines, and what meshes share with them.
#[derive(Clone, Debug, Default)]
pub struct Gathered {
    /// In the fixed order of instances and streams.
    pub fibres: Vec<GpuFibre>,
    /// Of all instances.
    pub objects: Vec<GpuObject>,
    /// Nodes of the step before: position and radius.
    pub previous_nodes: Vec<abi::FibreNode>,
    /// Nodes of this step.
    pub current_nodes: Vec<abi::FibreNode>,
    /// Of all instances.
    pub materials: Vec<abi::Material>,
    /// Of the channels that are shown.
    pub lines: Vec<GpuLine>,
    /// Where the objects of each instance were in the step before.
    pub matched: Vec<Matched>,
    /// Between the steps: 0 is the step before, 1 this one.
    pub alpha: f32,
    /// Another number whenever fibres and materials were gathered anew.
    pub(crate) generation: u64,
}

impl GpuFibre {
    /// Between the steps, in a picture that is between them by `alpha`: as the shaders have it.
    pub fn blend(&self, alpha: f32) -> f32 {
        alpha.max(self.stands)
    }
}

impl Gathered {
    /// Vertices of all fibres at full detail.
    pub fn full_vertices(&self) -> u64 {
        self.fibres.iter().map(|f| u64::from(super::lod::RINGS) * u64::from(f.sides)).sum()
    }

    /// Whether some material has a texture.
    pub fn is_textured(&self) -> bool {
        self.materials.iter().any(|material| material.texture != 0)
    }

    /// Puts handles in the place of the textures' ids, which only their instances know; 0 for one that has no
    /// room. `current`: the step that was gathered.
    pub fn find_textures(&mut self, current: &Frame, catalogue: &Catalogue) {
        let whose = current.outputs.iter().flat_map(|outputs| outputs.materials.iter().map(move |_| outputs));
        for (material, outputs) in self.materials.iter_mut().zip(whose) {
            if material.texture != 0 {
                let texture = outputs.textures.iter().find(|texture| texture.id == material.texture);
                material.texture = texture.map_or(0, |texture| catalogue.of(texture).index);
            }
        }
    }
}

/// Flattens two steps. `alpha`: 0 shows the step before, 1 this one. `channels`: bits of the debug lines to
/// show.
pub fn gather(previous: &Frame, current: &Frame, alpha: f32, lens: &Lens, channels: u32) -> Gathered {
    let mut all = Gathered::default();
    all.match_steps(previous, current);
    all.look(previous, current, alpha, lens, channels);
    all.previous_nodes = steps::joined(previous, |outputs| &outputs.fibre_nodes);
    all.current_nodes = steps::joined(current, |outputs| &outputs.fibre_nodes);
    all
}

impl Gathered {
    /// What is the same in all pictures between two steps: fibres, materials, what belongs together.
    pub fn match_steps(&mut self, previous: &Frame, current: &Frame) {
        self.generation += 1;
        self.matched = Matched::modules(previous, current);
        self.fibres.clear();
        self.materials.clear();
        let mut bases = Bases::default();
        for (i, now) in current.outputs.iter().enumerate() {
            let before = previous.of_module(i);
            self.gather_instance(&bases, i, [before, now]);
            bases.objects += now.objects.len() as u32;
            bases.materials += now.materials.len() as u32;
            bases.current_nodes += now.fibre_nodes.len() as u32;
            bases.previous_nodes += before.fibre_nodes.len() as u32;
            self.materials.extend_from_slice(&now.materials);
        }
    }

    /// What a picture between the steps that were matched has of its own: where it looks from, what it shows.
    pub fn look(&mut self, previous: &Frame, current: &Frame, alpha: f32, lens: &Lens, channels: u32) {
        self.alpha = alpha.clamp(0.0, 1.0);
        self.objects.clear();
        self.lines.clear();
        for (i, now) in current.outputs.iter().enumerate() {
            let before = previous.of_module(i);
            let matched = &self.matched[i];
            self.objects.extend(now.objects.iter().enumerate().map(|(i, object)| {
                let current = relative(object.origin, lens);
                let previous = match matched.of(i) {
                    Some(j) => relative(before.objects[j].origin, lens),
                    None => current,
                };
                GpuObject {
                    previous: previous.to_array(),
                    current: current.to_array(),
                    ..GpuObject::default()
                }
            }));
            self.lines.extend(
                now.debug_lines
                    .iter()
                    .filter(|line| channels & 1_u32.checked_shl(line.channel).unwrap_or(0) != 0)
                    .map(|line| gpu_line(line, lens)),
            );
        }
    }
}

/// Where an instance's elements begin among those of all.
#[derive(Default)]
struct Bases {
    objects: u32,
    materials: u32,
    previous_nodes: u32,
    current_nodes: u32,
}

fn gpu_line(line: &abi::DebugLine, lens: &Lens) -> GpuLine {
    let from = relative(line.from, lens);
    GpuLine { from: from.to_array(), color: line.color, to: (from + Vec3::from(line.delta)).to_array() }
}

fn relative(origin: [f64; 3], lens: &Lens) -> Vec3 {
    (DVec3::from(origin) - lens.eye).as_vec3()
}

impl Gathered {
    fn gather_instance(&mut self, bases: &Bases, instance: usize, [before, now]: [&Outputs; 2]) {
        let fibres = self.matched[instance]
            .elements(before.fibres.iter().map(|f| f.object), now.fibres.iter().map(|f| f.object));
        for (i, fibre) in now.fibres.iter().enumerate() {
            let then = fibres.of(i).map(|j| &before.fibres[j]).filter(|then| {
                let jumped =
                    (fibre.flags | now.objects[fibre.object as usize].flags) & abi::FLAG_NO_BLEND != 0;
                !jumped && then.node_count == fibre.node_count
            });
            // Without a partner the fibre stands where it is now: no nodes of the step before are read.
            let (previous_node, previous_normal, stands) = match then {
                Some(then) => (bases.previous_nodes + then.first_node, then.normal, 0.0),
                None => (0, fibre.normal, 1.0),
            };
            self.fibres.push(GpuFibre {
                object: bases.objects + fibre.object,
                previous_node,
                current_node: bases.current_nodes + fibre.first_node,
                nodes_flags: fibre.node_count.min(0xffff) | flags_of(fibre) << 16,
                material: bases.materials + fibre.material,
                variation: fibre.variation,
                sides: sides_of(fibre),
                flatness: fibre.flatness,
                normal: fibre.normal,
                stands,
                previous_normal,
                plain: u32::from(is_plain(fibre, now)),
            });
        }
    }
}

fn flags_of(fibre: &abi::Fibre) -> u32 {
    let flag = |theirs, ours| if fibre.flags & theirs != 0 { ours } else { 0 };
    flag(abi::FIBRE_CAP, CAP) | flag(abi::FIBRE_BLADE, BLADE)
}

/// A blade is a ribbon from near, too: its two edges fade, and it has no third side.
fn sides_of(fibre: &abi::Fibre) -> u32 {
    if fibre.flags & abi::FIBRE_BLADE != 0 { RIBBON } else { fibre.sides.clamp(3, 64) }
}

fn is_plain(fibre: &abi::Fibre, outputs: &Outputs) -> bool {
    fibre.flags & (abi::FIBRE_CAP | abi::FIBRE_BLADE) == 0
        && outputs
            .materials
            .get(fibre.material as usize)
            .is_some_and(|m| m.pattern == abi::PATTERN_NONE && m.texture == 0 && m.base[3] >= 1.0)
}

/// What stands on the ground: the wide foot of each object that has one, else the spread of its fibres'
/// roots. Only what does not move while a plant sways goes into it (roots and radii), so that it is the same
/// in every step.
pub fn standers(frame: &Frame) -> Vec<Stander> {
    let mut standers = Vec::new();
    for outputs in &frame.outputs {
        // The roots' middle and reach of each object; None: it has no fibres, or a foot.
        let mut roots: Vec<Option<(Vec3, Vec3, f32)>> = vec![None; outputs.objects.len()];
        let mut footed = vec![false; outputs.objects.len()];
        for fibre in &outputs.fibres {
            let index = fibre.object as usize;
            let nodes = &outputs.fibre_nodes[fibre.first_node as usize..][..fibre.node_count as usize];
            let (Some(root), Some(top)) = (nodes.first(), nodes.last()) else { continue };
            let at = Vec3::from(root.position);
            if fibre.flags & abi::FIBRE_CAP != 0 {
                footed[index] = true;
                let origin = DVec3::from(outputs.objects[index].origin);
                standers.push(Stander {
                    origin,
                    base: origin + at.as_dvec3(),
                    base_radius: root.radius,
                    crown_radius: 2.1 * top.radius.max(root.radius * 0.7),
                    crown_height: 1.2 * root.radius,
                    cover: 1.0,
                    tall: 0.0,
                });
            } else {
                let seen = roots[index].get_or_insert((at, at, root.radius));
                *seen = (seen.0.min(at), seen.1.max(at), seen.2.max(root.radius));
            }
        }
        for ((object, roots), footed) in outputs.objects.iter().zip(&roots).zip(&footed) {
            let (Some((low, high, radius)), false) = (roots, footed) else { continue };
            let reach = low.distance(*high) * 0.5 + radius * 2.0;
            // A whole meadow in one object has no one place.
            if reach < 1.0 {
                let origin = DVec3::from(object.origin);
                standers.push(Stander {
                    origin,
                    base: origin + ((*low + *high) * 0.5).as_dvec3(),
                    base_radius: reach,
                    crown_radius: reach * 1.6,
                    crown_height: reach,
                    cover: 1.0,
                    tall: 0.0,
                });
            }
        }
    }
    standers
}

#[cfg(test)]
mod tests {

    use super::*;
    use crate::sample;

    fn lens() -> Lens {
        Lens::new(&sample::looking_at(DVec3::new(0.0, 0.3, 1.0), DVec3::ZERO), [64, 36], 60.0)
    }

    fn two_objects(ids: [u64; 2], x: f32) -> Outputs {
        let mut out = Outputs { materials: vec![sample::tissue()], ..Outputs::default() };
        for (i, id) in ids.into_iter().enumerate() {
            out.objects.push(abi::Object {
                id,
                origin: [f64::from(x) + id as f64, 0.0, 0.0],
                ..Default::default()
            });
            out.fibres.push(abi::Fibre {
                object: i as u32,
                first_node: out.fibre_nodes.len() as u32,
                node_count: 2,
                sides: 8,
                flatness: 1.0,
                normal: [1.0, 0.0, 0.0],
                ..Default::default()
            });
            for y in [0.0, 0.1] {
                out.fibre_nodes
                    .push(abi::FibreNode { position: [id as f32 * 0.01 + x, y, 0.0], radius: 0.01 });
            }
        }
        out
    }

    fn gathered(before: Outputs, now: Outputs) -> Gathered {
        let camera = sample::looking_at(DVec3::ONE, DVec3::ZERO);
        gather(&sample::frame(1, camera, before), &sample::frame(2, camera, now), 0.25, &lens(), u32::MAX)
    }

    #[test]
    fn objects_are_matched_by_id_when_their_order_changes() {
        let g = gathered(two_objects([5, 9], 0.0), two_objects([9, 5], 0.5));
        let eye = lens().eye.as_vec3();
        assert!((g.objects[0].previous[0] + eye.x - 9.0).abs() < 1e-5);
        assert!((g.objects[0].current[0] + eye.x - 9.5).abs() < 1e-5);
        let first = g.fibres[0];
        assert_eq!(first.blend(g.alpha), 0.25);
        assert_eq!(g.previous_nodes[first.previous_node as usize].position[0], 9.0 * 0.01);
    }

    #[test]
    fn a_new_object_and_a_jumping_fibre_are_not_blended() {
        let mut now = two_objects([5, 7], 0.5);
        now.fibres[0].flags |= abi::FLAG_NO_BLEND;
        let g = gathered(two_objects([5, 9], 0.0), now);
        assert_eq!(g.fibres[0].blend(g.alpha), 1.0, "it jumped");
        assert_eq!(g.fibres[1].blend(g.alpha), 1.0, "nothing had this id before");
        assert_eq!(g.objects[1].previous, g.objects[1].current);
    }

    #[test]
    fn a_fibre_that_got_more_nodes_is_not_blended() {
        let mut now = two_objects([5, 9], 0.5);
        now.fibre_nodes.push(abi::FibreNode { position: [0.0, 0.2, 0.0], radius: 0.01 });
        now.fibres[1].node_count = 3;
        let g = gathered(two_objects([5, 9], 0.0), now);
        assert_eq!([0, 1].map(|i| g.fibres[i].blend(g.alpha)), [0.25, 1.0]);
    }

    #[test]
    fn what_stands_on_the_ground_is_the_same_while_it_sways() {
        let environment = sample::environment();
        let camera = sample::looking_at(DVec3::ONE, DVec3::ZERO);
        let [still, swaying] = [0.0, 0.4].map(|sway| {
            // The sample's roots of tentacles move with the foot; its feet do not.
            let mut outputs = sample::garden(&environment, sway);
            outputs.fibres.retain(|fibre| fibre.flags != 0);
            standers(&sample::frame(1, camera, outputs))
        });
        assert!(still.len() > 20);
        assert_eq!(still, swaying);
    }

    #[test]
    fn debug_lines_of_hidden_channels_stay_out() {
        let mut now = two_objects([5, 9], 0.0);
        for channel in [0, 3, 40] {
            now.debug_lines.push(abi::DebugLine { channel, delta: [1.0, 0.0, 0.0], ..Default::default() });
        }
        let camera = sample::looking_at(DVec3::ONE, DVec3::ZERO);
        let frame = sample::frame(1, camera, now);
        assert_eq!(gather(&frame, &frame, 1.0, &lens(), 1 << 3).lines.len(), 1);
        assert_eq!(
            gather(&frame, &frame, 1.0, &lens(), u32::MAX).lines.len(),
            2,
            "channel 40 does not exist"
        );
    }
}
