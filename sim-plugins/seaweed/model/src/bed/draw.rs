//! What a step hands to the renderer: an object, an element and joints of each plant.
//!
//! Far plants, and those that nobody sees, are moved as a whole by one joint: the first segment's. On the way
//! there, over the second in which the level of detail changes, all joints go to where that one carries them.

use fearless_simd::{Simd, f32x8};
use glam::{Quat, Vec3};
use reef_flow::{Level, lanes::transposed, simd::splat};
use reef_sdk::{
    Chunks, Parts, Workers,
    abi::{self, Joint, Object, Skinned},
};

use super::{
    BED, Bed, JointPose, Kind, PACKS, Pack, id_of, next_of,
    poses::{Bases, frames, one},
};
use crate::{
    kernel::Row,
    lanes::{WIDTH, load, load3},
    looks::Dress,
};

/// What the renderer knows a mesh and its material by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Wear {
    /// From `mesh_create`.
    pub mesh: u32,
    /// Among the materials.
    pub material: u32,
}

/// How plants are drawn.
#[derive(Clone, Copy, Debug)]
pub struct Drawing<'a> {
    /// What makes the look of each plant.
    pub dresses: &'a [Dress],
    /// What these numbers stand for.
    pub wears: &'a [Wear],
    /// Whether far plants are moved as a whole.
    pub whole: bool,
}

/// Objects that one job writes.
const OBJECTS: usize = 256;

/// How much a plant moves as a whole: 1, by one joint alone.
fn share_of_whole(pack: &Pack, lane: usize, whole: bool) -> f32 {
    match whole {
        false => 0.0,
        true if pack.paused[lane] > 0.0 => 1.0,
        true => (pack.detail(lane)[0] - 1.0).clamp(0.0, 1.0),
    }
}

impl Bed {
    /// How many joints [`Bed::draw`] writes. To be called before it, with the same.
    pub fn plan_joints(&mut self, whole: bool) -> usize {
        let Self { packs, kinds, drawn_bounds, .. } = self;
        drawn_bounds.clear();
        drawn_bounds.push(0);
        let mut joints = 0;
        for pack in packs.iter() {
            let all = kinds[pack.kind()].skeleton.len();
            for (lane, _) in pack.lanes() {
                joints += if share_of_whole(pack, lane, whole) >= 1.0 { 1 } else { all };
            }
            drawn_bounds.push(joints);
        }
        joints
    }

    /// Objects: a plant each, and then the bed itself, which calms the water.
    pub fn object_count(&self) -> usize {
        1 + self.plants.len()
    }

    /// Writes [`Bed::object_count`] objects, in the order of their ids.
    pub fn write_objects(&self, workers: Workers<'_>, objects: &mut [Object]) {
        let Some((bed, objects)) = objects.split_last_mut() else { return };
        *bed = Object { id: BED, ..Object::default() };
        workers.for_each_part(Chunks::new(objects, OBJECTS), |part, objects| {
            for (number, object) in (part * OBJECTS..).zip(objects) {
                let [pack, lane] = self.places[number];
                let (pack, lane) = (&self.packs[pack as usize], lane as usize);
                *object = Object {
                    id: id_of(number),
                    origin: self.plants[number].root.to_array(),
                    bounds_radius: pack.reach(lane),
                    flags: if pack.jumped(lane) { abi::FLAG_NO_BLEND } else { 0 },
                    ..Object::default()
                };
            }
        });
    }

    /// Writes an element of each plant, and the joints that [`Bed::plan_joints`] counted.
    pub fn draw(
        &mut self,
        level: Level,
        workers: Workers<'_>,
        how: &Drawing<'_>,
        (elements, joints): (&mut [Skinned], &mut [Joint]),
    ) {
        let Self { packs, rows, row_bounds, plant_bounds, drawn_bounds, kinds, bases, .. } = self;
        super::poses::fit(bases, kinds, workers.count());
        let (kinds, packs, rows) = (&*kinds, packs.as_slice(), rows.as_slice());
        let (row_bounds, drawn_bounds, plant_bounds) = (&*row_bounds, &*drawn_bounds, &*plant_bounds);
        let split = (Parts::every(elements, plant_bounds, PACKS), Parts::every(joints, drawn_bounds, PACKS));
        workers.for_each_part_with(bases, split, |bases, job, (mut elements, mut room)| {
            for (number, pack) in packs.iter().enumerate().skip(job * PACKS).take(PACKS) {
                let of_pack = Drawn {
                    elements: next_of(&mut elements, plant_bounds, number),
                    room: next_of(&mut room, drawn_bounds, number),
                    first_joint: drawn_bounds[number],
                };
                let rows = &rows[row_bounds[number]..row_bounds[number + 1]];
                of_pack.write(level, how, (pack, &kinds[pack.kind()]), rows, bases);
            }
        });
    }
}

/// Where a pack's elements and joints go.
struct Drawn<'a> {
    elements: &'a mut [Skinned],
    room: &'a mut [Joint],
    /// Number of the first of these joints.
    first_joint: usize,
}

impl Drawn<'_> {
    fn write(
        self,
        level: Level,
        how: &Drawing<'_>,
        (pack, kind): (&Pack, &Kind),
        rows: &[Row],
        bases: &mut [Bases],
    ) {
        let Self { elements, mut room, mut first_joint } = self;
        let segments = &kind.skeleton.joints;
        // Who all move as a whole need their first segments alone.
        let bent = room.len() > elements.len() || segments.len() == 1;
        let computed = if bent { segments.len() } else { 1 };
        let mut rooms: [&mut [Joint]; WIDTH] = Default::default();
        let mut shares = [0.0; WIDTH];
        for ((lane, plant), element) in pack.lanes().zip(elements) {
            shares[lane] = share_of_whole(pack, lane, how.whole);
            let count = if shares[lane] >= 1.0 { 1 } else { segments.len() };
            rooms[lane] = room.split_off_mut(..count).unwrap_or_default();
            let dress = how.dresses.get(plant as usize).copied().unwrap_or_default();
            let wear = how.wears.get(dress.number as usize).copied().unwrap_or_default();
            *element = Skinned {
                object: plant,
                mesh: wear.mesh,
                material: wear.material,
                flags: if pack.jumped(lane) { abi::FLAG_NO_BLEND } else { 0 },
                first_joint: first_joint as u32,
                joint_count: count as u32,
                scale: pack.stand.size.0[lane],
                phase: dress.phase,
                hue: dress.hue,
                value: dress.value,
                ..Skinned::default()
            };
            first_joint += count;
        }
        reef_flow::dispatch!(level, simd => {
            frames(simd, &segments[..computed], pack, rows, bases);
            spread(simd, &bases[..computed], &mut rooms);
        });
        for (lane, _) in pack.lanes().filter(|(lane, _)| shares[*lane] > 0.0) {
            let stiff = Whole::new(&one(&bases[0], lane), &kind.rest[0], pack.stand.size.0[lane]);
            stiff.take_along(rooms[lane], &kind.rest, shares[lane]);
        }
    }
}

/// Writes the joints of a pack's plants, each plant's to its own room, as far as that goes.
#[inline(always)]
fn spread<S: Simd>(simd: S, bases: &[Bases], rooms: &mut [&mut [Joint]; WIDTH]) {
    for (number, ([x, y, z, w], place)) in bases.iter().enumerate() {
        // Not by closures: see [`crate::kernel::pose`].
        let turn = [load(simd, x), load(simd, y), load(simd, z), load(simd, w)];
        let place = load3(simd, place);
        let [a, b, c, d, e, f, g, h] =
            transposed([turn[0], turn[1], turn[2], turn[3], place[0], place[1], place[2], splat(simd, 1.0)]);
        put(&mut rooms[0], number, a);
        put(&mut rooms[1], number, b);
        put(&mut rooms[2], number, c);
        put(&mut rooms[3], number, d);
        put(&mut rooms[4], number, e);
        put(&mut rooms[5], number, f);
        put(&mut rooms[6], number, g);
        put(&mut rooms[7], number, h);
    }
}

/// Writes a joint of a plant: turn, place and scale.
#[inline(always)]
fn put<S: Simd>(room: &mut &mut [Joint], number: usize, joint: f32x8<S>) {
    if let Some(into) = room.get_mut(number) {
        let [x, y, z, w, px, py, pz, scale] = joint.into();
        *into = Joint { rotation: [x, y, z, w], translation: [px, py, pz], scale };
    }
}

/// A plant that is moved as a whole.
struct Whole {
    /// What moves the mesh at rest.
    joint: Joint,
    turn: Quat,
    place: Vec3,
    size: f32,
}

impl Whole {
    /// As its first segment goes. A plant's size is in the element's scale, joints have none.
    fn new(first: &JointPose, rest: &JointPose, size: f32) -> Self {
        let turn = (Quat::from_array(first.rotation) * Quat::from_array(rest.rotation).inverse()).normalize();
        let place = Vec3::from(first.position) - turn * (Vec3::from(rest.position) * size);
        let joint = Joint { rotation: turn.to_array(), translation: place.to_array(), scale: 1.0 };
        Self { joint, turn, place, size }
    }

    /// Lets joints go a share of the way to where the whole carries them; 1: there is one, which moves all.
    fn take_along(&self, joints: &mut [Joint], rest: &[JointPose], share: f32) {
        if share >= 1.0 {
            joints[0] = self.joint;
            return;
        }
        for (joint, rest) in joints.iter_mut().zip(rest) {
            let turn = Quat::from_array(joint.rotation);
            let carried = self.turn * Quat::from_array(rest.rotation);
            let near = if carried.dot(turn) < 0.0 { -carried } else { carried };
            let there = self.place + self.turn * (Vec3::from(rest.position) * self.size);
            joint.rotation = (turn * (1.0 - share) + near * share).normalize().to_array();
            joint.translation = Vec3::from(joint.translation).lerp(there, share).to_array();
        }
    }
}
