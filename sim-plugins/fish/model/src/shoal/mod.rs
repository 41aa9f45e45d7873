//! All fish of a module: what each perceives, what it makes up its mind to do, and how it moves.
//!
//! Near fish ask the muscles of their bodies ([`crate::tank`]); far ones are points that move by the baked
//! gait of the same body ([`crate::gait`]), and go over without a jump ([`act`]).
//!
//! A step goes in two waves over fixed chunks: what each fish wants, in the order of the grid; then the
//! bodies, eight fish of a species at once. Nothing depends on who runs a chunk.

mod act;
mod carry;
mod grid;
mod homes;
mod kind;
mod perceive;
mod poses;
mod state;
mod steer;
mod walls;
mod waves;

use glam::{DVec3, Vec3};
use reef_flow::{Field, Level, Packed, Sphere, velocity8};
use reef_sdk::{
    Chunks, Heightfield, Workers,
    abi::{Flow, Obstacle},
};

use crate::tank::{Swimmer, Tank};

use grid::{Grid, Seen};
pub use homes::Home;
use homes::Register;
pub use kind::Kind;
pub use state::State;
use steer::Wish;
use walls::Walls;
pub use waves::Waves;
use waves::{Sixteens, Swaying};

/// A box that fish do not leave.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Habitat {
    /// Its corners [m, world].
    pub low: DVec3,
    /// The other one.
    pub high: DVec3,
}

/// A fish before it swims.
#[derive(Clone, Debug, PartialEq)]
pub struct Start {
    /// Its species, by its number.
    pub kind: u32,
    /// Centre [m, world].
    pub position: DVec3,
    /// A turn about the vertical from +x toward −z [rad].
    pub heading: f64,
    /// Over that of the species.
    pub size: f64,
    /// By its number.
    pub habitat: u32,
    /// Its home, if it is given [m, world].
    pub home: Option<DVec3>,
    /// Of its whims.
    pub seed: u64,
}

/// A fish, but for its body's nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fish {
    /// Its species, by its number.
    pub kind: u32,
    /// Its number among those of its species.
    slot: u32,
    habitat: u32,
    /// A home that is given by hand [m, world].
    given: Option<DVec3>,
    /// The anemone that it lives in.
    home: Option<Home>,
    seed: u64,
    /// Over that of the species.
    pub size: f64,
    /// Centre [m, world].
    pub position: DVec3,
    /// The way that it looks, its beat left out; unit.
    pub course: Vec3,
    /// Through the water along its course [m/s].
    pub speed: f32,
    /// Of the water around it [m/s].
    pub water: Vec3,
    /// Its body is stepped; else it moves by the gait.
    pub near: bool,
    /// How long it has moved by the gait [s], up to when its pose is the gait's alone.
    since: f32,
    /// Bias of its muscles [1].
    bias: [f32; 2],
    /// From 1 on it is hungry.
    pub hunger: f32,
    /// From 1 on it courts.
    pub love: f32,
    /// How long it stays frightened [s].
    pub fright: f32,
    /// How far it takes note of its own kind, in lengths.
    reach: f32,
}

/// An anemone, or what else feels what fish carry.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Host {
    /// By which it is known from step to step.
    pub id: u64,
    /// Of its species' name.
    pub species: u32,
    /// [m, world]
    pub position: DVec3,
    /// [m]
    pub radius: f64,
}

/// What surrounds the fish in one step.
#[derive(Clone, Copy, Debug)]
pub struct Surroundings<'a> {
    /// All primitives, in the host's order.
    pub flow: &'a [Flow],
    /// The sea bed.
    pub bed: Option<Heightfield<'a>>,
    /// Wave trains.
    pub waves: Waves<'a>,
    /// Rocks and what moves, as capsules.
    pub obstacles: &'a [Obstacle],
    /// y of still water [m].
    pub surface: f64,
    /// Anemones.
    pub hosts: &'a [Host],
    /// Who looks [m, world].
    pub eye: DVec3,
    /// Fish nearer than this to the eye are stepped with their bodies [m].
    pub near: f64,
    /// Length of the step [s]; 0: nothing moves.
    pub dt: f64,
    /// Instruction set.
    pub level: Level,
    /// Who shares the work.
    pub workers: Workers<'a>,
}

/// All fish.
#[derive(Clone, Debug)]
pub struct Shoal {
    kinds: Vec<Kind>,
    habitats: Vec<Habitat>,
    fish: Vec<Fish>,
    /// The bodies of each kind.
    tanks: Vec<Tank>,
    /// What a far fish's nodes still are off its gait, at the species' size [m]; of each kind.
    offsets: Vec<Vec<Vec3>>,
    /// The fish of each kind whose bodies are stepped, by their slots.
    stepped: Vec<Vec<u32>>,
    /// Where the fish of each kind begin.
    firsts: Vec<u32>,
    /// What f32 places are relative to [m, world].
    anchor: DVec3,
    grid: Grid,
    register: Register,
    swaying: Swaying,
    wishes: Vec<Wish>,
    field: Field,
    flow: Vec<Flow>,
    scratch: Vec<Scratch>,
    flows: Vec<Flow>,
    time: f64,
}

/// Fish whose wishes one job works out.
const CHUNK: usize = 64;
/// Side of the cells that share their water and their rocks [m].
const CELL: f64 = 4.0;

/// The object that a fish is, by its number.
pub fn id_of(fish: usize) -> u64 {
    fish as u64 + 1
}

/// Water and rocks of a cell, while a worker is in it.
#[derive(Clone, Debug, Default)]
struct Scratch {
    cell: Option<[i64; 3]>,
    water: Packed,
    obstacles: Vec<u32>,
    waves: Sixteens,
}

impl Shoal {
    /// Fish of these kinds at rest. Fish of one kind are put together; within it they keep their order.
    ///
    /// # Errors
    /// Which fish is wrong, what, and what is allowed.
    pub fn new(kinds: Vec<Kind>, habitats: Vec<Habitat>, starts: &[Start]) -> Result<Self, String> {
        for (i, start) in starts.iter().enumerate() {
            if start.kind as usize >= kinds.len() {
                return Err(format!("fish[{i}].kind: there are {} kinds, is {}", kinds.len(), start.kind));
            }
            let Some(habitat) = habitats.get(start.habitat as usize) else {
                let count = habitats.len();
                return Err(format!("fish[{i}].habitat: there are {count} habitats, is {}", start.habitat));
            };
            if !(habitat.low.cmplt(start.position).all() && start.position.cmplt(habitat.high).all()) {
                return Err(format!("fish[{i}].position: must be within its habitat, is {}", start.position));
            }
            if !(start.size.is_finite() && start.size > 0.0) {
                return Err(format!("fish[{i}].size: must be above 0, is {}", start.size));
            }
        }
        let mut order: Vec<&Start> = starts.iter().collect();
        order.sort_by_key(|start| start.kind);
        let mut shoal = Self {
            anchor: anchor(&habitats),
            grid: Grid::new(ranges(&kinds, &order).into_iter()),
            register: Register::default(),
            swaying: Swaying::default(),
            habitats,
            fish: Vec::with_capacity(starts.len()),
            tanks: Vec::new(),
            offsets: Vec::new(),
            stepped: Vec::new(),
            firsts: Vec::new(),
            wishes: vec![Wish::default(); starts.len()],
            field: Field::new(),
            flow: Vec::new(),
            scratch: Vec::new(),
            flows: Vec::with_capacity(starts.len()),
            time: 0.0,
            kinds,
        };
        for (number, kind) in shoal.kinds.iter().enumerate() {
            let own: Vec<&&Start> = order.iter().filter(|start| start.kind as usize == number).collect();
            shoal.firsts.push(shoal.fish.len() as u32);
            let swimmer = |start: &Start| Swimmer {
                size: start.size,
                phase: (start.seed % 1024) as f32 / 1024.0,
                ..Swimmer::at(start.position)
            };
            let headings: Vec<f64> = own.iter().map(|start| start.heading).collect();
            let swimmers = own.iter().map(|start| swimmer(start)).collect();
            shoal.tanks.push(Tank::new(kind.plan.clone(), swimmers, &headings));
            shoal.offsets.push(vec![Vec3::ZERO; own.len() * kind.plan.body().nodes().len()]);
            shoal.stepped.push(Vec::with_capacity(own.len()));
            let range = kind.range();
            shoal.fish.extend(own.iter().enumerate().map(|(slot, start)| fish(start, slot as u32, range)));
        }
        Ok(shoal)
    }

    /// All fish.
    pub fn fish(&self) -> &[Fish] {
        &self.fish
    }

    /// All kinds.
    pub fn kinds(&self) -> &[Kind] {
        &self.kinds
    }

    /// What the fish emitted in the last step.
    pub fn flows(&self) -> &[Flow] {
        &self.flows
    }

    /// One step.
    pub fn step(&mut self, around: &Surroundings<'_>) {
        if around.dt.is_nan() || around.dt <= 0.0 {
            self.carry(around);
            return;
        }
        self.prepare(around);
        self.wish(around);
        self.act(around);
        self.time += around.dt;
        self.carry(around);
    }

    /// What the workers share in this step.
    fn prepare(&mut self, around: &Surroundings<'_>) {
        self.settle(around.hosts);
        self.swaying.fill(&around.waves);
        let Self { fish, kinds, grid, anchor, flow, field, scratch, .. } = self;
        // No fish feels what fish carry: their own would push them for ever.
        let ours = 1..=fish.len() as u64;
        flow.clear();
        flow.extend(around.flow.iter().filter(|flow| !ours.contains(&flow.owner)));
        field.refill(flow);
        grid.fill(fish.iter().enumerate().map(|(number, fish)| {
            let body = kinds[fish.kind as usize].plan.body();
            Seen {
                number: number as u32,
                kind: fish.kind,
                at: (fish.position - *anchor).as_vec3(),
                course: fish.course,
                length: (body.length() * fish.size) as f32,
                width: (body.width() * fish.size) as f32,
                reach: fish.reach,
                hunts: !kinds[fish.kind as usize].prey.is_empty(),
                courts: fish.love >= 1.0,
                ..Seen::default()
            }
        }));
        if scratch.len() < around.workers.count() {
            scratch.resize_with(around.workers.count(), Scratch::default);
        }
        for scratch in scratch {
            scratch.cell = None;
            scratch.water.make_room(field);
            scratch.obstacles.reserve(around.obstacles.len());
        }
    }

    /// What each fish wants, in the order of the grid.
    fn wish(&mut self, around: &Surroundings<'_>) {
        let Self { fish, kinds, habitats, grid, field, swaying, scratch, wishes, time, .. } = self;
        let (fish, kinds, grid, field, swaying, time) = (&*fish, &*kinds, &*grid, &*field, &*swaying, *time);
        let walls = Walls { bed: around.bed, obstacles: around.obstacles, surface: around.surface };
        let longest =
            fish.iter().map(|fish| kinds[fish.kind as usize].length() * fish.size).fold(0.0, f64::max);
        around.workers.for_each_part_with(scratch, Chunks::new(wishes, CHUNK), |scratch, chunk, wishes| {
            let chunk = &grid.sorted()[chunk * CHUNK..][..wishes.len()];
            let own = chunk.iter().map(|seen| (&fish[seen.number as usize], f64::from(seen.length)));
            swaying.feel(&around.waves, around.level, own, &mut scratch.waves);
            for (i, (into, seen)) in wishes.iter_mut().zip(chunk).enumerate() {
                let own = &fish[seen.number as usize];
                let kind = &kinds[own.kind as usize];
                scratch.enter(own.position, field, around, longest);
                let sight = perceive::perceive(grid, kinds, seen);
                let body = walls::Body {
                    at: own.position,
                    course: own.course,
                    length: f64::from(seen.length),
                    height: kind.height() * own.size,
                };
                let habitat = &habitats[own.habitat as usize];
                let off = walls::avoid(&walls, &scratch.obstacles, habitat, &body);
                let home = own.home().filter(|_| kind.mind.home > 0.0);
                let home = home.map(|home| (home - own.position).as_vec3());
                let mut wish = steer::wish(kind, own, &sight, off, home, time);
                wish.number = seen.number;
                wish.water += scratch.water_at(own.position) + swaying.of(&scratch.waves, i);
                *into = wish;
            }
        });
    }
}

impl Scratch {
    /// Takes up water and rocks around a place, unless it is in their cell already: what they are depends on
    /// the cell alone.
    fn enter(&mut self, at: DVec3, field: &Field, around: &Surroundings<'_>, longest: f64) {
        let cell = at.to_array().map(|x| (x / CELL).round() as i64);
        if self.cell == Some(cell) {
            return;
        }
        self.cell = Some(cell);
        let center = DVec3::from(cell.map(|x| x as f64 * CELL));
        let radius = 0.5 * CELL * 3.0_f64.sqrt();
        let bounds = Sphere { center: center.to_array(), radius };
        self.water.fill_near(field, bounds, center.to_array(), NOBODY);
        self.obstacles.clear();
        let reach = radius + walls::reach(longest);
        let near = around.obstacles.iter().enumerate();
        let near = near.filter(|(_, obstacle)| walls::touches(obstacle, center, reach));
        self.obstacles.extend(near.map(|(number, _)| number as u32));
    }

    /// The water at a place of the cell [m/s].
    fn water_at(&self, at: DVec3) -> Vec3 {
        let Some(cell) = self.cell else { return Vec3::ZERO };
        if self.water.is_still() {
            return Vec3::ZERO;
        }
        let [x, y, z] = (at - DVec3::from(cell.map(|x| x as f64 * CELL))).as_vec3().to_array();
        let water = &self.water;
        // One point: the baseline's lanes are enough, and all levels give the same bytes.
        let v: [f32; 3] = reef_flow::dispatch!(Level::scalar(), simd => {
            let splat = |x| reef_flow::simd::splat(simd, x);
            let v = velocity8(simd, water, splat(x), splat(y), splat(z));
            let lane = |lanes: reef_flow::fearless_simd::f32x8<_>| {
                let eight: [f32; 8] = lanes.into();
                eight[0]
            };
            [lane(v[0]), lane(v[1]), lane(v[2])]
        });
        Vec3::from(v).clamp_length_max(FASTEST_WATER)
    }
}

/// No water carries a fish faster [m/s].
const FASTEST_WATER: f32 = 10.0;

/// The owner of what nobody emits.
const NOBODY: u64 = 0;

fn fish(start: &Start, slot: u32, range: f32) -> Fish {
    let (cosine, sine) = reef_flow::math::cos_sin_f64(start.heading);
    // Nobody begins as hungry, or as much in love, as everybody else.
    let share = |purpose: u64| (reef_flow::random::mix(start.seed ^ purpose) >> 40) as f32 / (1 << 24) as f32;
    Fish {
        kind: start.kind,
        slot,
        habitat: start.habitat,
        given: start.home,
        home: None,
        seed: start.seed,
        size: start.size,
        position: start.position,
        course: Vec3::new(cosine as f32, 0.0, -sine as f32),
        speed: 0.0,
        water: Vec3::ZERO,
        near: false,
        since: act::BLEND,
        bias: [0.0; 2],
        hunger: share(1),
        love: share(2),
        fright: 0.0,
        reach: range,
    }
}

impl Fish {
    /// How its hue and its lightness differ from those of its kind, each from −1 to 1.
    pub fn tints(&self) -> [f32; 2] {
        let signed = |bits: u64| (bits >> 40) as f32 / (1 << 23) as f32 - 1.0;
        [signed(reef_flow::random::mix(self.seed ^ HUE)), signed(reef_flow::random::mix(self.seed ^ VALUE))]
    }
}

/// Purposes of a fish's seed: its hue and its lightness.
const HUE: u64 = 3;
const VALUE: u64 = 4;

/// The middle of all habitats.
fn anchor(habitats: &[Habitat]) -> DVec3 {
    let low = habitats.iter().map(|habitat| habitat.low).reduce(DVec3::min).unwrap_or_default();
    let high = habitats.iter().map(|habitat| habitat.high).reduce(DVec3::max).unwrap_or_default();
    (0.5 * (low + high)).round()
}

/// How far the fish of each kind see at most [m].
fn ranges(kinds: &[Kind], starts: &[&Start]) -> Vec<f32> {
    let of = |(number, kind): (usize, &Kind)| {
        let own = starts.iter().filter(|start| start.kind as usize == number);
        let largest = own.map(|start| start.size).fold(0.0, f64::max);
        (kind.mind.range * kind.length() * largest) as f32
    };
    kinds.iter().enumerate().map(of).filter(|range| *range > 0.0).collect()
}
