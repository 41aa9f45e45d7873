//! All plants of a scene, stepped together.
//!
//! A step goes in three waves, each spread over the workers in fixed pieces: the feet; the fibres on them,
//! whose roots ride on the feet as they have just become; the fibres that follow guides. Each piece packs the
//! flow around itself once and writes its nodes to where they are emitted.

mod around;
mod emit;
mod ground;
mod jobs;
pub(crate) mod own;
mod pack;
mod trace;
mod waves;

use std::sync::atomic::{AtomicU64, Ordering};

use glam::DVec3;
use reef_flow::{Field, Level, Look, Packed, Sphere, simd::Ahead, waves::Surges};
use reef_sdk::{
    Chunks,
    abi::{self, Material},
};

pub use around::{Settings, Surroundings};
use jobs::{Jobs, each_batch};

use crate::{
    frame::Frame,
    sow::Harvest,
    wide::{self, Blend, Chunk, Contacts, StepConstants, Water},
};

/// Primitives of the sea's that one job looks at.
const LOOK: usize = 1024;

/// Which list of batches a fibre is in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Wave {
    Feet,
    Fibres,
    Followers,
}

/// Where a fibre is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spot {
    pub(crate) batch: u32,
    pub(crate) lane: u16,
    pub(crate) wave: Wave,
}

/// One fibre in the list of all: where it is, and what of it never changes in the streams. Small, since a
/// step reads all of it.
#[derive(Clone, Copy, Debug)]
struct Listed {
    spot: Spot,
    plant: u32,
    first_node: u32,
    variation: u32,
    /// In [`Bed::looks`].
    look: u32,
}

/// What all fibres of a batch stand on. It alone decides what they are relative to, so no fibre's bytes
/// depend on the others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Base {
    /// The foot of this plant: they ride on its top.
    Foot(u32),
    /// By themselves, in one cell of the world's lattice.
    Cell(ground::Cell),
}

/// Fibres that are stepped side by side.
#[derive(Clone, Debug)]
pub(crate) struct Batch {
    pub(crate) chunk: Chunk,
    /// The plant of each fibre.
    pub(crate) plants: Vec<u32>,
    /// The guides of each fibre (followers only).
    blends: Vec<Blend>,
    base: Base,
    /// L_i of each fibre [m], fibre by fibre: exact, where the chunk's are rounded.
    lengths: Vec<f64>,
    /// What offsets and flow are relative to [m, world].
    pub(crate) anchor: DVec3,
    bounds: Sphere,
    pub(crate) packed: Packed,
    contacts: Contacts,
    /// Where each fibre feels the waves, all of those on one foot in one place; and what they feel, as many
    /// to a vector as fibres are, or one for all.
    spots: Vec<u32>,
    surges: Vec<Surges>,
    /// Made when some of its plants, but not all, must be stepped apart.
    apart: Option<Box<own::Apart>>,
}

/// One plant in the bed.
#[derive(Clone, Debug)]
pub(crate) struct Standing {
    position: DVec3,
    grounded: bool,
    yaw: f64,
    /// World position that its nodes are relative to [m].
    pub(crate) origin: DVec3,
    stand: Frame,
    /// Top of the foot, relative to the origin; the stand itself without one.
    top: (DVec3, Frame),
    foot: Option<Spot>,
    reach: f64,
    crown: f64,
    species: u32,
    /// Its fibres in [`Bed::fibres`]: the foot first.
    fibres: core::ops::Range<usize>,
}

/// All plants of a scene.
#[derive(Clone, Debug)]
pub struct Bed {
    pub(crate) plants: Vec<Standing>,
    feet: Vec<Batch>,
    pub(crate) fibres: Vec<Batch>,
    followers: Vec<Batch>,
    /// All fibres, plant by plant, the foot first.
    listed: Vec<Listed>,
    /// What many fibres have in common in the streams.
    looks: Vec<abi::Fibre>,
    /// Origin and reach of each plant [m], as its object has them: what stands still is looked up side by
    /// side.
    bounds: Vec<([f64; 3], f32)>,
    /// The box around all batches' bounds: its corners [m, world].
    extent: [[f64; 3]; 2],
    /// Plants with a foot; plants that others perceive.
    footed: Vec<u32>,
    perceived: Vec<u32>,
    materials: Vec<Material>,
    /// How each wave is cut into jobs.
    jobs: [Jobs; 3],
    nodes: usize,
    /// Some fibre can break off.
    breakable: bool,
    evaluations: (u64, u64),
    field: Field,
    /// What is found in each part of the sea's primitives.
    found: Vec<Look>,
    swaying: waves::Swaying,
    /// The last step had waves.
    swayed: bool,
    /// Plants that emit flow in this step, ascending.
    emitters: Vec<u32>,
    applied: (f64, f64),
    placed: bool,
    /// Poses must be rebuilt from the bends before anything else.
    stale: bool,
}

impl Bed {
    /// Packs the plants.
    pub(crate) fn new(harvest: Harvest) -> Self {
        let mut bed = Self {
            plants: Vec::new(),
            feet: Vec::new(),
            fibres: Vec::new(),
            followers: Vec::new(),
            listed: Vec::new(),
            looks: Vec::new(),
            bounds: Vec::new(),
            extent: NOWHERE,
            footed: Vec::new(),
            perceived: Vec::new(),
            materials: harvest.materials,
            jobs: Default::default(),
            nodes: 0,
            breakable: false,
            evaluations: (0, 0),
            field: Field::new(),
            found: Vec::new(),
            swaying: waves::Swaying::default(),
            swayed: false,
            emitters: Vec::new(),
            applied: (1.0, 0.0),
            placed: false,
            stale: true,
        };
        bed.pack(&harvest.seedlings);
        bed
    }

    fn wave_nodes(&self, wave: usize) -> usize {
        self.jobs[wave].nodes.last().copied().unwrap_or(0)
    }

    /// Nodes of all fibres.
    pub fn node_count(&self) -> usize {
        self.nodes
    }

    /// Fibres, feet included.
    pub fn fibre_count(&self) -> usize {
        self.listed.len()
    }

    /// Plants, bare fibres included.
    pub fn plant_count(&self) -> usize {
        self.plants.len()
    }

    /// Plants that others perceive.
    pub fn perceived_count(&self) -> usize {
        self.perceived.len()
    }

    /// Local flow primitives that were evaluated in the last step, and those that bounding spheres saved,
    /// both times the nodes that they would have been evaluated at.
    pub fn evaluations(&self) -> (u64, u64) {
        self.evaluations
    }

    /// Whether the waves moved the water in the last step.
    pub(crate) fn swayed(&self) -> bool {
        self.swayed
    }

    /// Vertices of all rings at full detail.
    pub fn vertex_count(&self) -> u64 {
        let looks = self.listed.iter().filter_map(|fibre| self.looks.get(fibre.look as usize));
        looks.map(|look| u64::from(look.node_count) * u64::from(look.sides)).sum()
    }

    /// One step; with dt = 0 the poses stay. Writes all nodes to `nodes`, which must have room for
    /// [`Self::node_count`]; where it is empty, nothing is written, and the rest is the same.
    pub fn step(&mut self, around: &Surroundings<'_>, settings: &Settings, nodes: &mut [[f32; 4]]) {
        if !self.placed {
            self.place(around);
        }
        if self.stale {
            self.rebuild(around.level);
        }
        if self.applied != (settings.stiffness, settings.exponent) {
            self.applied = (settings.stiffness, settings.exponent);
            for batch in self.feet.iter_mut().chain(&mut self.fibres) {
                batch.chunk.set_stiffness(settings.stiffness, settings.exponent);
            }
            share(&mut self.feet);
            share(&mut self.fibres);
        }
        let constants = StepConstants {
            density: around.density,
            viscosity: around.viscosity,
            drag: settings.drag,
            current: settings.current,
            contact: settings.contact,
            force: settings.force,
            rigid: settings.rigid,
        };
        let moving = around.dt > 0.0;
        if moving {
            self.look_around(around);
            own::list_emitters(self.field.flows(), self.plants.len(), &mut self.emitters);
        }
        let (feet_nodes, rest) = nodes.split_at_mut(self.wave_nodes(0).min(nodes.len()));
        let (fibre_nodes, follower_nodes) = rest.split_at_mut(self.wave_nodes(1).min(rest.len()));
        let Self { plants, footed, feet, fibres, followers, jobs, field, swaying, emitters, .. } = self;
        let felt = if moving { swaying.feel(around, settings) } else { &[] };
        // Summed by those who have the numbers at hand; whole numbers, so the order is nobody's business.
        let (evaluated, saved) = (AtomicU64::new(0), AtomicU64::new(0));
        let advance = |batch: &mut Batch, nodes: &mut [[f32; 4]], ahead: &mut Ahead| {
            if !felt.is_empty() {
                batch.feel(felt);
            }
            let Batch { chunk, plants, packed, contacts, surges, apart, anchor, bounds, .. } = batch;
            let surges = if felt.is_empty() { &[] } else { &surges[..] };
            chunk.set_gain(around.dt, settings.damping);
            own::step(chunk, plants, emitters, apart, nodes, |chunk, owner, nodes| {
                packed.fill_near(field, *bounds, anchor.to_array(), owner);
                let moving = (chunk.nodes() - chunk.count()) as u64;
                evaluated.fetch_add(moving * u64::from(packed.evaluated()), Ordering::Relaxed);
                saved.fetch_add(moving * u64::from(packed.saved()), Ordering::Relaxed);
                let water = Water { flow: packed, surges };
                wide::step_into(around.level, chunk, water, contacts, &constants, nodes, ahead);
            });
        };
        each_batch(around.workers, feet, feet_nodes, &jobs[0], |batch, nodes, ahead| {
            if moving {
                advance(batch, nodes, ahead);
            } else {
                wide::emit(around.level, &mut batch.chunk, nodes);
            }
        });
        if moving {
            ride(plants, footed, feet);
        }
        let plants = &*plants;
        each_batch(around.workers, fibres, fibre_nodes, &jobs[1], |batch, nodes, ahead| {
            if moving {
                batch.carry(around.level, plants);
                batch.touch(around.obstacles, settings.contact);
                advance(batch, nodes, ahead);
            } else {
                wide::emit(around.level, &mut batch.chunk, nodes);
            }
        });
        let fibres = &*fibres;
        each_batch(around.workers, followers, follower_nodes, &jobs[2], |batch, nodes, _| {
            if moving {
                batch.carry(around.level, plants);
                batch.follow(around.level, fibres);
            }
            wide::emit(around.level, &mut batch.chunk, nodes);
        });
        if moving {
            self.swayed = !felt.is_empty();
            self.evaluations = (evaluated.into_inner(), saved.into_inner());
        }
    }

    /// Takes up the flow around the bed; the look at all of the sea's primitives is shared among the workers.
    fn look_around(&mut self, around: &Surroundings<'_>) {
        let Self { field, found, extent, .. } = self;
        let parts = around.flow.len().div_ceil(LOOK);
        if found.len() < parts {
            found.resize_with(parts, Look::default);
        }
        let found = &mut found[..parts];
        around.workers.for_each_part(Chunks::new(found, 1), |part, look| {
            let first = part * LOOK;
            let own = &around.flow[first..around.flow.len().min(first + LOOK)];
            look[0].find(own, first, *extent);
        });
        field.refill_found(around.flow, &*found);
    }

    /// Puts every plant on the ground, once.
    fn place(&mut self, around: &Surroundings<'_>) {
        for plant in &mut self.plants {
            let buried = plant.foot.map_or(0.0, |spot| {
                ground::BURIED * f64::from(self.feet[spot.batch as usize].chunk.radius(spot.lane as usize, 0))
            });
            plant.stand_on(around.ground.as_ref(), around.obstacles, buried);
        }
        let plants = &self.plants;
        for batch in self.feet.iter_mut().chain(&mut self.fibres).chain(&mut self.followers) {
            batch.settle(plants, around.ground.as_ref());
        }
        self.swaying.place(plants, self.feet.iter_mut().chain(&mut self.fibres));
        self.bounds = self.plants.iter().map(|p| (p.origin.to_array(), p.reach as f32)).collect();
        self.extent = extent(self.feet.iter().chain(&self.fibres).chain(&self.followers));
        self.placed = true;
        self.stale = true;
    }

    /// Poses from bends.
    fn rebuild(&mut self, level: Level) {
        for batch in &mut self.feet {
            wide::rebuild(level, &mut batch.chunk);
        }
        ride(&mut self.plants, &self.footed, &self.feet);
        let plants = &self.plants;
        for batch in &mut self.fibres {
            batch.carry(level, plants);
            wide::rebuild(level, &mut batch.chunk);
        }
        let fibres = &self.fibres;
        for batch in &mut self.followers {
            batch.carry(level, plants);
            batch.follow(level, fibres);
        }
        self.stale = false;
    }

    fn batch(&self, spot: &Spot) -> Option<&Batch> {
        match spot.wave {
            Wave::Feet => self.feet.get(spot.batch as usize),
            Wave::Fibres => self.fibres.get(spot.batch as usize),
            Wave::Followers => self.followers.get(spot.batch as usize),
        }
    }

    /// How many numbers a later step depends on.
    pub fn state_len(&self) -> usize {
        self.feet.iter().chain(&self.fibres).map(|batch| batch.chunk.state_len()).sum()
    }

    /// All of them.
    pub fn save(&self) -> Vec<f32> {
        let mut state = vec![0.0; self.state_len()];
        self.save_to(&mut state);
        state
    }

    /// The same into a list of [`Self::state_len`] numbers.
    pub fn save_to(&self, mut into: &mut [f32]) {
        for batch in self.feet.iter().chain(&self.fibres) {
            let (own, rest) = into.split_at_mut(batch.chunk.state_len());
            batch.chunk.save(own);
            into = rest;
        }
    }

    /// Takes back what [`Self::save`] wrote; says what is wrong with it otherwise.
    pub fn load(&mut self, state: &[f32]) -> Result<(), String> {
        let wanted = self.state_len();
        if state.len() != wanted {
            return Err(format!("holds {} numbers; these plants have {wanted}", state.len()));
        }
        let mut rest = state;
        for batch in self.feet.iter_mut().chain(&mut self.fibres) {
            let (own, after) = rest.split_at(batch.chunk.state_len());
            if !batch.chunk.load(own) {
                return Err("holds a bend, or a break, that no step leaves behind".to_owned());
            }
            rest = after;
        }
        self.stale = true;
        Ok(())
    }
}

/// A box without a place in it.
const NOWHERE: [[f64; 3]; 2] = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];

/// The box around the bounds of batches [m, world]: nothing of a bed asks for the flow outside of it.
fn extent<'a>(batches: impl Iterator<Item = &'a Batch>) -> [[f64; 3]; 2] {
    batches.fold(NOWHERE, |[mut low, mut high], batch| {
        let Sphere { center, radius } = batch.bounds;
        for i in 0..3 {
            low[i] = low[i].min(center[i] - radius);
            high[i] = high[i].max(center[i] + radius);
        }
        [low, high]
    })
}

/// Neighbours that are alike share what never changes in a step.
fn share(batches: &mut [Batch]) {
    for at in 1..batches.len() {
        let (before, rest) = batches.split_at_mut(at);
        if let (Some(before), Some(batch)) = (before.last(), rest.first_mut()) {
            batch.chunk.share_constants(&before.chunk);
        }
    }
}

/// Tells every plant where the top of its foot is.
fn ride(plants: &mut [Standing], footed: &[u32], feet: &[Batch]) {
    for index in footed {
        let Some(plant) = plants.get_mut(*index as usize) else { continue };
        if let Some((chunk, lane)) =
            plant.foot.and_then(|spot| Some((&feet.get(spot.batch as usize)?.chunk, spot.lane as usize)))
        {
            plant.top = (chunk.node(lane, chunk.segments()).as_dvec3(), chunk.tip_frame(lane));
        }
    }
}

impl Batch {
    /// Whether all fibres ride on one foot.
    fn is_riding(&self) -> bool {
        matches!(self.base, Base::Foot(_))
    }

    /// Puts the roots on the foot.
    fn carry(&mut self, level: Level, plants: &[Standing]) {
        let Base::Foot(plant) = self.base else { return };
        if let Some(plant) = plants.get(plant as usize) {
            wide::carry(level, &mut self.chunk, plant.top.0, &plant.top.1);
        }
    }

    fn follow(&mut self, level: Level, guides: &[Self]) {
        let Self { chunk, blends, .. } = self;
        wide::follow(level, chunk, blends, |batch| guides.get(batch as usize).map(|batch| &batch.chunk));
    }
}
