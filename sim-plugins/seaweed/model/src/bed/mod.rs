//! All plants of a module, stepped together.
//!
//! Plants of one species that stand near one another are packs of eight. Where they stand is told by a
//! lattice over the world: who is in the same cell feels currents and trains relative to the same anchor. So
//! what a plant does depends on its own place alone, not on who came first in its pack.
//!
//! A step goes in two waves: the water of each cell, then each pack. Both are shared among workers in fixed
//! pieces.

mod cell;
mod draw;
mod flows;
mod pack;
mod poses;
mod spacing;
mod state;

use std::collections::BTreeMap;

use glam::{DQuat, DVec3};
use reef_flow::{Field, Level, Packed, view::View, waves::Choice};
use reef_sdk::{
    Chunks, Heightfield, Parts, Workers,
    abi::{self, Camera, Flow, Obstacle, Wave},
};

use crate::{
    kernel::{self, Row},
    levels::Levels,
    skeleton::Skeleton,
};

pub use crate::kernel::Work;
use cell::Cell;
pub use draw::{Drawing, Wear};
use pack::{Pack, Scratch, Sea};
pub use poses::JointPose;
use spacing::Spacing;
pub use state::State;

/// What all plants of a species share.
#[derive(Clone, Debug)]
pub struct Kind {
    /// Its segments, at a size of 1.
    pub skeleton: Skeleton,
    /// Where they are at rest.
    pub rest: Vec<JointPose>,
    /// τ: lag of the procedural method [s].
    pub lag: f64,
    /// What its sources get from its acceleration: Φ over |a| at a size of 1 [m²·s].
    pub disturbance: f64,
}

impl Kind {
    /// A species: its skeleton, the lag of the procedural method [s], and Φ over |a| of its sources [m²·s].
    pub fn new(skeleton: Skeleton, lag: f64, disturbance: f64) -> Self {
        let pose = |(origin, turn): (DVec3, DQuat)| JointPose {
            position: origin.as_vec3().to_array(),
            rotation: turn.normalize().as_quat().normalize().to_array(),
        };
        let rest = skeleton.rest().into_iter().map(pose).collect();
        Self { skeleton, rest, lag, disturbance }
    }
}

/// One plant.
#[derive(Clone, Debug, PartialEq)]
pub struct Plant {
    /// Its species, by its number.
    pub kind: usize,
    /// Its root [m, world].
    pub root: DVec3,
    /// The way up that it stands by, unit.
    pub up: DVec3,
    /// Turn about that [rad].
    pub yaw: f64,
    /// Size over that of the species.
    pub size: f64,
    /// Stiffness and damping over those of the species at this size.
    pub stiff: f64,
    /// Greatest difference of its equilibrium angles from the species' [rad].
    pub bend: f64,
    /// Seed of these differences.
    pub seed: u64,
    /// Normal of the ground under it, unit; None: it stands free.
    pub ground: Option<DVec3>,
}

/// What surrounds the plants in one step.
#[derive(Clone, Copy, Debug)]
pub struct Surroundings<'a> {
    /// All primitives, in the host's order.
    pub flow: &'a [Flow],
    /// All wave trains.
    pub waves: &'a [Wave],
    /// Of the water [m].
    pub depth: f64,
    /// ρ [kg/m³].
    pub density: f64,
    /// Rocks and what moves, as capsules.
    pub obstacles: &'a [Obstacle],
    /// Who looks.
    pub camera: &'a Camera,
    /// Length of the step [s]; 0: nothing moves.
    pub dt: f64,
    /// Instruction set.
    pub level: Level,
    /// Who shares the work.
    pub workers: Workers<'a>,
}

/// All plants.
#[derive(Clone, Debug)]
pub struct Bed {
    kinds: Vec<Kind>,
    plants: Vec<Plant>,
    packs: Vec<Pack>,
    /// Pack by pack, segment by segment.
    rows: Vec<Row>,
    row_bounds: Vec<usize>,
    /// Where each pack's joints begin among the poses.
    pose_bounds: Vec<usize>,
    /// Where each pack's plants begin among the objects.
    plant_bounds: Vec<usize>,
    /// Where each pack's joints begin among those that are drawn in this step.
    drawn_bounds: Vec<usize>,
    /// Pack and lane of each plant.
    places: Vec<[u32; 2]>,
    cells: Vec<Cell>,
    patches: Vec<flows::Patch>,
    field: Field,
    /// The step's flow without what the plants emit themselves.
    flow: Vec<Flow>,
    choice: Choice,
    spacing: Spacing,
    /// The step's trains, in the order of their choice.
    waves: Vec<Wave>,
    /// The same some time ago: for plants that make up for steps.
    before: Vec<Vec<Wave>>,
    scratch: Vec<Scratch>,
    ambient: Packed,
    flows: Vec<Flow>,
    /// Strength of the sources of the step, and whose they are.
    strongest: Vec<(f32, u32)>,
    /// Of each worker.
    bases: Vec<Vec<poses::Bases>>,
}

/// Packs that one job of the workers steps or draws: enough that to be handed out costs it little.
const PACKS: usize = 4;

/// The next part of a slice that is gone through range by range: what lies between two of its bounds.
fn next_of<'a, T>(rest: &mut &'a mut [T], bounds: &[usize], number: usize) -> &'a mut [T] {
    let (own, after) = std::mem::take(rest).split_at_mut(bounds[number + 1] - bounds[number]);
    *rest = after;
    own
}

/// The object that all plants are together: owner of what they emit together.
pub const BED: u64 = 1 << 32;

/// The object that a plant is, by its number.
pub fn id_of(plant: usize) -> u64 {
    plant as u64 + 1
}

/// Steps in which plants make up for time, and how long before the present each begins [s]: long ones first,
/// since what was long ago has nearly been forgotten.
const CATCH_UP: [f64; 10] = [4.0, 3.0, 2.2, 1.6, 1.15, 0.8, 0.55, 0.35, 0.2, 0.1];

/// How long before the present a step of making up for time ends [s].
fn catch_up_end(step: usize) -> f64 {
    CATCH_UP.get(step + 1).copied().unwrap_or(0.0)
}

/// Who may be in a pack together: what a plant gets of the waves follows from these, not from its neighbours.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Group {
    kind: usize,
    cell: [i64; 3],
    /// See [`pack::size_class`].
    size: u64,
    /// How far up they reach, see [`spacing::band`].
    band: usize,
}

impl Group {
    fn of(kinds: &[Kind], plant: &Plant) -> Self {
        let top = plant.root.y + kinds[plant.kind].skeleton.reach() * plant.size;
        let (cell, size) = (cell::key(plant.root), pack::size_class(plant));
        Self { kind: plant.kind, cell, size, band: spacing::band(top) }
    }
}

impl Bed {
    /// Plants of these kinds. What stands where it does keeps its order in everything that comes out.
    pub fn new(kinds: Vec<Kind>, plants: Vec<Plant>) -> Self {
        let known = (0..).zip(&plants).filter(|(_, plant): &(u32, &Plant)| plant.kind < kinds.len());
        let mut order: Vec<(Group, (i64, i64), u32)> =
            known.map(|(i, plant)| (Group::of(&kinds, plant), cell::strip(plant.root), i)).collect();
        order.sort_unstable();
        let mut bed = Self {
            kinds,
            places: vec![[u32::MAX; 2]; plants.len()],
            plants,
            packs: Vec::new(),
            rows: Vec::new(),
            row_bounds: vec![0],
            pose_bounds: vec![0],
            plant_bounds: vec![0],
            drawn_bounds: Vec::new(),
            cells: Vec::new(),
            patches: Vec::new(),
            field: Field::new(),
            flow: Vec::new(),
            choice: Choice::default(),
            spacing: Spacing::default(),
            waves: Vec::new(),
            before: vec![Vec::new(); CATCH_UP.len()],
            scratch: Vec::new(),
            ambient: Packed::new(),
            flows: Vec::new(),
            strongest: Vec::new(),
            bases: Vec::new(),
        };
        bed.patches = flows::patches(&bed.kinds, &bed.plants);
        bed.strongest.reserve(bed.plants.len());
        bed.flows.reserve(flows::MOST_SOURCES + bed.patches.len());
        let mut cells = BTreeMap::new();
        for alike in order.chunk_by(|(a, ..), (b, ..)| a == b) {
            for eight in alike.chunks(crate::lanes::WIDTH) {
                let numbers: Vec<u32> = eight.iter().map(|(_, _, number)| *number).collect();
                bed.add_pack(&eight[0].0, &numbers, &mut cells);
            }
        }
        bed.drawn_bounds.reserve(bed.packs.len() + 1);
        bed
    }

    fn add_pack(&mut self, group: &Group, numbers: &[u32], numbers_of_cells: &mut BTreeMap<[i64; 3], usize>) {
        let kind = group.kind;
        let cell = *numbers_of_cells.entry(group.cell).or_insert_with(|| {
            self.cells.push(Cell::new(group.cell));
            self.cells.len() - 1
        });
        let segments = self.kinds[kind].skeleton.len();
        for (lane, number) in numbers.iter().enumerate() {
            self.places[*number as usize] = [self.packs.len() as u32, lane as u32];
            let plant = &self.plants[*number as usize];
            self.cells[cell].add(plant, &self.kinds[kind]);
        }
        let begin = self.rows.len();
        self.rows.resize(begin + segments, Row::default());
        let anchor = self.cells[cell].anchor();
        let plants: Vec<&Plant> = numbers.iter().map(|number| &self.plants[*number as usize]).collect();
        let rows = &mut self.rows[begin..];
        let pack = Pack::new(group, cell, numbers, &plants, anchor, &self.kinds[kind], rows);
        self.packs.push(pack);
        self.row_bounds.push(self.rows.len());
        let poses = self.pose_bounds.last().copied().unwrap_or(0) + segments * numbers.len();
        self.pose_bounds.push(poses);
        self.plant_bounds.push(self.plant_bounds[self.plant_bounds.len() - 1] + numbers.len());
    }

    /// All plants.
    pub fn plants(&self) -> &[Plant] {
        &self.plants
    }

    /// All species.
    pub fn kinds(&self) -> &[Kind] {
        &self.kinds
    }

    /// Joints of all plants.
    pub fn joint_count(&self) -> usize {
        self.pose_bounds.last().copied().unwrap_or(0)
    }

    /// Bytes of what moves, and of what the plants are.
    pub fn bytes(&self) -> usize {
        size_of_val(self.rows.as_slice())
            + size_of_val(self.packs.as_slice())
            + size_of_val(self.plants.as_slice())
            + size_of_val(self.places.as_slice())
    }

    /// One step. Says what it took.
    pub fn step(&mut self, around: &Surroundings<'_>, levels: &Levels) -> Work {
        if around.dt.is_nan() || around.dt <= 0.0 {
            return Work::default();
        }
        self.prepare(around, levels);
        let view = View::new(around.camera, levels.margin);
        let Self { packs, rows, row_bounds, cells, field, waves, before, scratch, kinds, .. } = self;
        let (field, kinds, before, row_bounds) = (&*field, &*kinds, &*before, &*row_bounds);
        let (choice, spacing) = (&self.choice, &self.spacing);
        let raised: f32 = waves.iter().map(|wave| wave.amplitude.max(0.0)).sum();
        let raised = raised * levels.waves as f32;
        let ordered = &Surroundings { waves, ..*around };
        around.workers.for_each_part(Chunks::new(cells, 1), |_, cell| {
            cell[0].fill(field, ordered, levels, &view);
        });
        let cells = &*cells;
        let split = (Chunks::new(packs, PACKS), Parts::every(rows, row_bounds, PACKS));
        around.workers.for_each_part_with(scratch, split, |scratch, job, (packs, mut rows)| {
            for (number, pack) in (job * PACKS..).zip(packs) {
                let (cell, kind) = (&cells[pack.cell()], &kinds[pack.kind()]);
                let view = &view;
                let sea = Sea { around: ordered, levels, view, cell, kind, choice, spacing, before, raised };
                pack.step(&sea, next_of(&mut rows, row_bounds, number), scratch);
            }
        });
        let mut work = Work::default();
        for pack in &self.packs {
            let own = pack.work();
            work.joints += own.joints;
            work.evaluations += own.evaluations;
            work.plants += own.plants;
        }
        self.emit(around);
        work
    }

    /// What the workers share in this step.
    fn prepare(&mut self, around: &Surroundings<'_>, levels: &Levels) {
        let ours = 1..=self.plants.len() as u64;
        self.flow.clear();
        // A plant does not feel its own source; nor do the plants feel one another's, hundreds of which
        // overlap in a bed.
        let felt = |flow: &&Flow| flow.kind != abi::FLOW_SOURCE || !ours.contains(&flow.owner);
        self.flow.extend(around.flow.iter().filter(felt));
        self.field.refill(&self.flow);
        levels.choose(&mut self.choice, around.waves, around.depth, around.camera);
        self.waves.clear();
        self.waves.extend(self.choice.in_order(around.waves));
        self.spacing.update(&self.waves, around.depth);
        for (i, before) in self.before.iter_mut().enumerate() {
            let ago = catch_up_end(i);
            before.clear();
            before.extend(self.waves.iter().map(|wave| {
                let phase = f64::from(wave.phase) + f64::from(wave.frequency) * ago;
                Wave { phase: reef_flow::math::reduce_phase(phase) as f32, ..*wave }
            }));
        }
        let (longest, workers) =
            (self.kinds.iter().map(|kind| kind.skeleton.len()).max().unwrap_or(0), around.workers.count());
        if self.scratch.len() < workers {
            self.scratch.resize_with(workers, Scratch::default);
        }
        for scratch in &mut self.scratch {
            scratch.fit(longest, around.waves.len());
        }
    }

    /// What the plants emitted in the last step: a source of each that disturbs the water, and shelters of
    /// dense squares.
    pub fn flows(&self) -> &[Flow] {
        &self.flows
    }

    /// Level of detail of a plant (0 near, 1 middle, 2 far, or on the way), and the procedural method's
    /// share.
    pub fn detail(&self, plant: usize) -> Option<[f32; 2]> {
        let [pack, lane] = *self.places.get(plant)?;
        Some(self.packs.get(pack as usize)?.detail(lane as usize))
    }

    /// Whether a plant made up for steps in the last one: no picture blends its pose with the one before.
    pub fn jumped(&self, plant: usize) -> bool {
        let [pack, lane] = self.places[plant];
        self.packs.get(pack as usize).is_some_and(|pack| pack.jumped(lane as usize))
    }

    /// Centre of gravity [m, world] of a plant, its velocity [m/s] and its acceleration [m/s²] in its last
    /// step.
    pub fn gravity(&self, plant: usize) -> Option<[DVec3; 3]> {
        let [pack, lane] = *self.places.get(plant)?;
        let pack = self.packs.get(pack as usize)?;
        Some(pack.gravity(lane as usize, self.cells[pack.cell()].anchor()))
    }
}

/// The ground under (x, z): its height and its normal.
pub fn ground_at(ground: &Heightfield<'_>, x: f64, z: f64) -> (f64, DVec3) {
    let e = f64::from(ground.cell);
    let slope = |dx: f64, dz: f64| {
        f64::from(ground.height(x + dx, z + dz) - ground.height(x - dx, z - dz)) / (2.0 * e)
    };
    let normal = DVec3::new(-slope(e, 0.0), 1.0, -slope(0.0, e)).normalize_or(DVec3::Y);
    (f64::from(ground.height(x, z)), normal)
}

pub(crate) use kernel::{Capsule, Pass, Room, Stand};
