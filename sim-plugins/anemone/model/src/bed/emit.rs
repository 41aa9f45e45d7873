//! What a bed looks like in the streams.

use reef_sdk::{
    Chunks, Workers,
    abi::{self, Actor, Material, Object},
};

use reef_flow::simd::{blocks, prefetch};

use super::{Bed, Listed, Spot, own::id_of};

/// Elements of a stream that one job writes.
const ELEMENTS: usize = 512;

impl Bed {
    /// Materials: they never change.
    pub fn materials(&self) -> &[Material] {
        &self.materials
    }

    /// One object a plant, written to `room`, which has room for [`Self::plant_count`] at most.
    pub fn write_objects(&self, workers: Workers<'_>, room: &mut [Object]) {
        workers.for_each_part((Chunks::new(room, ELEMENTS),), |at, (room,)| {
            let first = at * ELEMENTS;
            let mut id = first as u64;
            let mut written = 0;
            for block in blocks(&self.bounds[first..first + room.len()]) {
                prefetch(room.get(written + 2 * block.len()..written + 3 * block.len()).unwrap_or_default());
                for ((origin, reach), slot) in block.iter().zip(&mut room[written..]) {
                    id += 1;
                    *slot = Object { id, origin: *origin, bounds_radius: *reach, ..Object::default() };
                }
                written += block.len();
            }
        });
    }

    /// The plants that others perceive: the crowns.
    pub fn actors(&self) -> impl Iterator<Item = Actor> + '_ {
        let plant = |index: &u32| Some((id_of(*index), self.plants.get(*index as usize)?));
        self.perceived.iter().filter_map(plant).map(|(id, plant)| Actor {
            id,
            position: (plant.origin + plant.top.0).to_array(),
            radius: plant.crown as f32,
            forward: plant.top.1.z.as_vec3().to_array(),
            species: plant.species,
            ..Actor::default()
        })
    }

    /// All fibres that are not broken off, plant by plant, the foot first.
    pub fn fibres(&self) -> impl Iterator<Item = abi::Fibre> + '_ {
        let whole = |fibre: &&Listed| {
            let Spot { lane, .. } = fibre.spot;
            self.batch(&fibre.spot).is_some_and(|batch| !batch.chunk.is_broken(lane.into()))
        };
        self.listed.iter().filter(whole).map(|fibre| {
            let mut into = abi::Fibre::default();
            self.describe(fibre, &mut into);
            into
        })
    }

    /// Writes a fibre to its place: whoever first put it together elsewhere would wait for his own writes.
    #[inline(always)]
    fn describe(&self, fibre: &Listed, into: &mut abi::Fibre) {
        *into = self.looks[fibre.look as usize];
        into.object = fibre.plant;
        into.first_node = fibre.first_node;
        into.variation = fibre.variation;
        let batch = self.batch(&fibre.spot);
        into.normal = batch.map_or([1.0, 0.0, 0.0], |b| b.chunk.normal(fibre.spot.lane.into()).to_array());
    }

    /// Writes [`Self::fibres`] and returns how many that were. `room` has room for [`Self::fibre_count`].
    pub fn write_fibres(&self, workers: Workers<'_>, room: &mut [abi::Fibre]) -> usize {
        let mut batches = self.feet.iter().chain(&self.fibres).chain(&self.followers);
        if self.breakable && batches.any(|batch| batch.chunk.has_broken()) {
            return room.iter_mut().zip(self.fibres()).map(|(slot, fibre)| *slot = fibre).count();
        }
        let count = room.len().min(self.listed.len());
        workers.for_each_part((Chunks::new(&mut room[..count], ELEMENTS),), |part, (room,)| {
            let first = part * ELEMENTS;
            let mut written = 0;
            for block in blocks(&self.listed[first..first + room.len()]) {
                prefetch(room.get(written + block.len()..written + 2 * block.len()).unwrap_or_default());
                for (slot, fibre) in room[written..].iter_mut().zip(block) {
                    self.describe(fibre, slot);
                }
                written += block.len();
            }
        });
        count
    }
}
