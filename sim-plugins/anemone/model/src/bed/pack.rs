//! From seedlings to batches: fibres that are alike are stepped side by side.

use glam::{DVec3, Vec3};
use reef_flow::{Packed, Sphere};
use reef_sdk::abi;

use super::{Base, Batch, Bed, Jobs, Listed, Spot, Standing, Wave, ground::Cell, share};
use crate::{
    frame::Frame,
    plant::{self, Strand},
    sow::Seedling,
    wide::{Blend, Chunk, Contacts, Drag, Lane, MOST_FIBRES},
};

impl Bed {
    pub(super) fn pack(&mut self, seedlings: &[Seedling]) {
        let mut feet = Packer::new(Wave::Feet);
        let mut fibres = Packer::new(Wave::Fibres);
        let mut followers = Packer::new(Wave::Followers);
        for (index, seedling) in (0_u32..).zip(seedlings) {
            let plant = &seedling.plant;
            let riding = plant.foot.is_some();
            let first = self.listed.len();
            let foot = plant.foot.as_ref().map(|strand| feet.add(strand, index, seedling, false, None));
            if let (Some(spot), Some(strand)) = (foot, &plant.foot) {
                self.list(spot, strand, index, seedling);
            }
            let mut guides = Vec::with_capacity(plant.guides.len());
            for strand in &plant.guides {
                let spot = fibres.add(strand, index, seedling, riding, None);
                guides.push((spot.batch, u32::from(spot.lane)));
                self.list(spot, strand, index, seedling);
            }
            for (strand, nearest, weights) in &plant.followers {
                let place = |i: u32| guides.get(i as usize).copied().unwrap_or_default();
                let blend = plant::blend(*nearest, *weights, place);
                let spot = followers.add(strand, index, seedling, riding, Some(blend));
                self.list(spot, strand, index, seedling);
            }
            let upright = Frame::upright(seedling.yaw);
            self.plants.push(Standing {
                position: seedling.position,
                grounded: seedling.grounded,
                yaw: seedling.yaw,
                origin: seedling.position,
                stand: upright,
                top: (DVec3::ZERO, upright),
                foot,
                reach: plant.reach,
                crown: plant.crown,
                species: seedling.species,
                fibres: first..self.listed.len(),
            });
        }
        self.feet = feet.finish();
        self.fibres = fibres.finish();
        self.followers = followers.finish();
        for batches in [&mut self.feet, &mut self.fibres, &mut self.followers] {
            share(batches);
            self.breakable |= batches.iter().any(|batch| batch.chunk.is_breakable());
        }
        // Where each batch's nodes begin, from the wave's first.
        let starts = [&self.feet, &self.fibres, &self.followers].map(|batches| {
            let mut starts = vec![0];
            for batch in batches {
                starts.push(starts[starts.len() - 1] + batch.chunk.nodes());
            }
            starts
        });
        self.jobs = starts.each_ref().map(|starts| Jobs::of(starts));
        self.nodes = (0..3).map(|wave| self.wave_nodes(wave)).sum();
        let waves = [0, self.wave_nodes(0), self.wave_nodes(0) + self.wave_nodes(1)];
        for fibre in &mut self.listed {
            let (spot, wave) = (fibre.spot, fibre.spot.wave as usize);
            let nodes = self.looks[fibre.look as usize].node_count as usize;
            let batch = starts[wave][spot.batch as usize];
            fibre.first_node = (waves[wave] + batch + usize::from(spot.lane) * nodes) as u32;
        }
        for plant in &mut self.plants {
            plant.foot = plant.foot.and_then(|_| self.listed.get(plant.fibres.start)).map(|fibre| fibre.spot);
        }
        for (index, plant) in (0..).zip(&self.plants) {
            if plant.foot.is_some() {
                self.footed.push(index);
            }
            if plant.species != 0 {
                self.perceived.push(index);
            }
        }
        self.bounds = self.plants.iter().map(|p| (p.origin.to_array(), p.reach as f32)).collect();
    }
}

impl Jobs {
    /// Few enough batches in a job that workers end together, and as many as that allows: a job asks for the
    /// memory of each but its first batch early. `starts`: where each batch's nodes begin, one more at the
    /// end.
    fn of(starts: &[usize]) -> Self {
        let count = starts.len() - 1;
        let batches = (count / 16).clamp(1, 16);
        let rest = (!count.is_multiple_of(batches)).then_some(&starts[count]);
        let nodes = starts.iter().step_by(batches).chain(rest);
        Self { batches, nodes: nodes.copied().collect() }
    }
}

impl Bed {
    /// Enters a fibre into the list of all, with what of it never changes in the streams.
    fn list(&mut self, spot: Spot, strand: &Strand, plant: u32, seedling: &Seedling) {
        let part = usize::from(spot.wave != Wave::Feet);
        let blade = part == 1 && seedling.flatness < 1.0;
        let look = abi::Fibre {
            node_count: strand.shape.nodes() as u32,
            material: seedling.materials[part],
            flags: if part == 0 { abi::FIBRE_CAP } else { 0 } | if blade { abi::FIBRE_BLADE } else { 0 },
            sides: seedling.sides[part],
            flatness: if part == 1 { seedling.flatness } else { 1.0 },
            ..abi::Fibre::default()
        };
        let known = self.looks.iter().rposition(|known| *known == look);
        let look = known.unwrap_or_else(|| {
            self.looks.push(look);
            self.looks.len() - 1
        }) as u32;
        self.listed.push(Listed { spot, plant, first_node: 0, variation: strand.variation, look });
    }
}

/// What the fibres of one batch have in common.
#[derive(Clone, Copy, PartialEq)]
struct Kin {
    segments: usize,
    drag: Drag,
    weight: f64,
    /// Some rest direction leaves the line of the segment below: then the kernel turns every rest frame.
    curved: bool,
    base: Base,
}

/// Collects fibres into batches.
struct Packer {
    wave: Wave,
    open: Vec<Open>,
}

/// A batch on its way.
struct Open {
    kin: Kin,
    lanes: Vec<Lane>,
    stiffness: Vec<(f64, f64)>,
    plants: Vec<u32>,
    blends: Vec<Blend>,
}

impl Packer {
    fn new(wave: Wave) -> Self {
        Self { wave, open: Vec::new() }
    }

    fn add(
        &mut self,
        strand: &Strand,
        plant: u32,
        seedling: &Seedling,
        riding: bool,
        blend: Option<Blend>,
    ) -> Spot {
        let kin = Kin {
            segments: strand.shape.segments(),
            drag: if self.wave == Wave::Feet { Drag::Area { coefficient: 0.5 } } else { seedling.drag },
            weight: if self.wave == Wave::Feet { 0.0 } else { seedling.weight },
            curved: strand.shape.is_curved(),
            base: if riding { Base::Foot(plant) } else { Base::Cell(Cell::of(seedling)) },
        };
        let lane = Lane {
            shape: strand.shape.clone(),
            place: strand.place,
            offset: Vec3::ZERO,
            relaxation: strand.relaxation,
            break_force: strand.break_force,
        };
        // The newest batch of this kin that has room.
        let at = match self.open.iter().rposition(|open| open.kin == kin && open.lanes.len() < MOST_FIBRES) {
            Some(at) => at,
            None => {
                let (lanes, stiffness, plants, blends) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
                self.open.push(Open { kin, lanes, stiffness, plants, blends });
                self.open.len() - 1
            }
        };
        let open = &mut self.open[at];
        open.lanes.push(lane);
        open.stiffness.push(strand.stiffness);
        open.plants.push(plant);
        open.blends.extend(blend);
        Spot { wave: self.wave, batch: at as u32, lane: open.lanes.len() as u16 - 1 }
    }

    fn finish(self) -> Vec<Batch> {
        let batch = |open: Open| {
            let mut chunk = Chunk::new(&open.lanes, open.kin.drag, &open.stiffness)?;
            chunk.set_load(Vec3::new(0.0, -open.kin.weight as f32, 0.0));
            Some(Batch {
                chunk,
                plants: open.plants,
                blends: open.blends,
                base: open.kin.base,
                lengths: open.lanes.iter().flat_map(|lane| lane.shape.lengths.iter().copied()).collect(),
                anchor: DVec3::ZERO,
                bounds: Sphere { center: [0.0; 3], radius: 0.0 },
                packed: Packed::new(),
                contacts: Contacts::default(),
                spots: Vec::new(),
                surges: Vec::new(),
                apart: None,
            })
        };
        self.open.into_iter().filter_map(batch).collect()
    }
}
