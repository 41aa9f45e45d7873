//! All fish of a module: what each perceives, what it makes up its mind to do, and how it moves.
//!
//! Near fish ask the muscles of their bodies ([`crate::tank`]); far ones are points that move by the baked
//! gait of the same body ([`crate::gait`]), and go over without a jump ([`act`]).
//!
//! A step goes in waves over fixed chunks: what each fish wants, eight fish of a kind at once in the order of
//! its grid ([`decide`]); how points follow; then the bodies, eight fish of a kind at once. Nothing depends
//! on who runs a chunk.

mod act;
pub mod bare;
mod carry;
mod decide;
mod grid;
mod habits;
mod homes;
mod keep;
mod kind;
mod perceive;
mod pool;
mod poses;
mod state;
mod steer;
mod strangers;
mod turn;
mod walls;
mod waves;

use glam::{DVec3, Vec3};
use reef_flow::{Field, Level, waves::Sway};
use reef_sdk::{
    Heightfield, Parts, Workers,
    abi::{Flow, Obstacle},
};

use act::Order;
use decide::{Scene, Scratch, Wish};
use grid::{Grid, Seen};
use habits::Habits;
pub use homes::Home;
use homes::{Lodging, Register};
pub use keep::Everybody;
pub use kind::Kind;
use pool::{BodyId, Pool};
pub use state::State;
use steer::Whims;
use strangers::Standing;
pub use strangers::Stranger;
use turn::Pace;
pub use waves::Waves;

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
    /// Its home, if it is given [m, world]; counts where its species has a `home`.
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
    /// While it is near, or its pose fades into the gait's.
    body: BodyId,
    habitat: u32,
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
    /// While a step goes on: its body is to be stepped in it.
    called: bool,
    /// Where in its beat it is [beats], 0..1.
    phase: f32,
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
    /// Who of other modules is there, but for the hosts.
    pub strangers: &'a [Stranger],
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
    /// Kind by kind; of each kind about in the order of its grid.
    fish: Vec<Fish>,
    /// Where the fish of each number is among these.
    kept: Vec<u32>,
    /// Steps until they are put in the order of their grids again.
    orderly: u32,
    /// Of each kind that has homes, by slots.
    lodgings: Vec<Vec<Lodging>>,
    /// The bodies of each kind.
    pools: Vec<Pool>,
    /// Where the fish of each kind are kept, from its first on, whose bodies are stepped, and what is asked
    /// of these.
    stepped: Vec<Vec<u32>>,
    orders: Vec<Order>,
    /// The bodies that are stepped, ascending.
    swimming: Vec<u32>,
    /// Where the fish of each kind begin.
    firsts: Vec<u32>,
    /// What f32 places are relative to [m, world].
    anchor: DVec3,
    /// Of each kind.
    habits: Vec<Habits>,
    grids: Vec<Grid>,
    paces: Vec<Pace>,
    /// Corners of the habitats, relative to the anchor [m].
    boxes: Vec<[Vec3; 2]>,
    register: Register,
    sway: Sway,
    standing: Standing,
    /// Kind by kind, in the order of its grid; where each job's part begins, and its kind and first place.
    wishes: Vec<Wish>,
    bounds: Vec<usize>,
    parts: Vec<(usize, usize)>,
    /// Bodies are, or are to be, stepped among the fish of each chunk.
    called: Vec<bool>,
    /// Where the fish of a kind that eights of bodies are among begin.
    eights: Vec<usize>,
    field: Field,
    flow: Vec<Flow>,
    scratch: Vec<Scratch>,
    flows: Vec<Flow>,
    time: f64,
}

/// Fish whose wishes one job works out.
const CHUNK: usize = 64;

/// The object that a fish is, by its number.
pub fn id_of(fish: usize) -> u64 {
    fish as u64 + 1
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
            habits: Habits::of(&kinds),
            grids: Vec::new(),
            paces: Vec::with_capacity(kinds.len()),
            boxes: Vec::new(),
            register: Register::default(),
            sway: Sway::default(),
            standing: Standing::default(),
            bounds: vec![0],
            parts: Vec::new(),
            called: vec![false; starts.len().div_ceil(act::CHUNK)],
            eights: Vec::with_capacity(starts.len() / 8 + 2),
            habitats,
            fish: Vec::with_capacity(starts.len()),
            kept: (0..starts.len() as u32).collect(),
            orderly: 0,
            lodgings: Vec::with_capacity(kinds.len()),
            pools: Vec::new(),
            stepped: Vec::new(),
            orders: Vec::with_capacity(starts.len().min(pool::ROOM)),
            swimming: Vec::with_capacity(starts.len().min(pool::ROOM)),
            firsts: Vec::new(),
            wishes: vec![Wish::default(); starts.len()],
            field: Field::new(),
            flow: Vec::new(),
            scratch: Vec::new(),
            flows: Vec::with_capacity(starts.len()),
            time: 0.0,
            kinds,
        };
        let corner = |at: DVec3| (at - shoal.anchor).as_vec3();
        shoal.boxes =
            shoal.habitats.iter().map(|habitat| [corner(habitat.low), corner(habitat.high)]).collect();
        for (number, kind) in shoal.kinds.iter().enumerate() {
            let own: Vec<&&Start> = order.iter().filter(|start| start.kind as usize == number).collect();
            shoal.firsts.push(shoal.fish.len() as u32);
            let sizes: f64 = own.iter().map(|start| start.size).sum();
            let usual = kind.length() * sizes / own.len().max(1) as f64;
            shoal.grids.push(Grid::new(own.len(), (usual * kind.cell()) as f32));
            for first in (0..own.len()).step_by(CHUNK) {
                shoal.parts.push((number, first));
                shoal.bounds.push(shoal.fish.len() + own.len().min(first + CHUNK));
            }
            shoal.pools.push(Pool::new(kind.plan.clone(), own.len()));
            shoal.stepped.push(Vec::with_capacity(own.len()));
            let homes = own.iter().filter(|_| kind.mind.home > 0.0);
            shoal.lodgings.push(homes.map(|start| Lodging::given(start.home)).collect());
            shoal.fish.extend(own.iter().enumerate().map(|(slot, start)| fish(start, slot as u32, kind)));
        }
        Ok(shoal)
    }

    /// All fish.
    pub fn fish(&self) -> Everybody<'_> {
        Everybody::new(&self.fish, &self.kept)
    }

    /// A fish by its number.
    fn one(&self, number: usize) -> &Fish {
        self.fish().one(number)
    }

    /// Where the home of a fish is, if it has one [m, world].
    pub fn home(&self, number: usize) -> Option<DVec3> {
        self.lodging(number).and_then(Lodging::place)
    }

    /// All kinds.
    pub fn kinds(&self) -> &[Kind] {
        &self.kinds
    }

    /// What the fish emitted in the last step.
    pub fn flows(&self) -> &[Flow] {
        &self.flows
    }

    /// Memory that they take: all that grows with their number [bytes].
    pub fn bytes(&self) -> usize {
        let homes: usize = self.lodgings.iter().map(|lodgings| size_of_val(&**lodgings)).sum();
        let fish = size_of_val(&*self.fish) + size_of_val(&*self.kept) + size_of_val(&*self.wishes) + homes;
        let grids: usize = self.grids.iter().map(Grid::bytes).sum();
        let bodies: usize = self.pools.iter().map(Pool::bytes).sum();
        fish + grids + bodies
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
        around.waves.fill(&mut self.sway);
        let Self {
            fish,
            kept,
            orderly,
            kinds,
            grids,
            anchor,
            firsts,
            habits,
            paces,
            flow,
            field,
            standing,
            scratch,
            ..
        } = self;
        // No fish feels what fish carry: their own would push them for ever.
        let ours = 1..=fish.len() as u64;
        flow.clear();
        flow.extend(around.flow.iter().filter(|flow| !ours.contains(&flow.owner)));
        field.refill(flow);
        let anchor = *anchor;
        let reorder = *orderly == 0;
        *orderly = if reorder { ORDERLY - 1 } else { *orderly - 1 };
        for ((grid, kind), first) in grids.iter_mut().zip(kinds.iter()).zip(firsts.iter()) {
            let own = *first as usize..*first as usize + grid.len();
            let (fish, kept) = (&mut fish[own.clone()], &mut kept[own.clone()]);
            let length = kind.length();
            grid.fill(around.workers, (own.start, kept), |at| {
                let fish = &fish[at];
                Seen {
                    at: (fish.position - anchor).as_vec3(),
                    course: fish.course,
                    length: (length * fish.size) as f32,
                    courts: fish.love >= 1.0,
                }
            });
            if reorder {
                keep::put_in_order(fish, own.start, &grid.slots, kept);
            }
        }
        standing.fill(around, habits, grids.iter().map(Grid::shortest));
        paces.clear();
        paces.extend(habits.iter().map(|habits| Pace::of(habits, around.dt as f32)));
        if scratch.len() < around.workers.count() {
            scratch.resize_with(around.workers.count(), Scratch::default);
        }
        scratch.iter_mut().for_each(|scratch| scratch.begin(field, standing));
    }

    /// What each fish wants.
    fn wish(&mut self, around: &Surroundings<'_>) {
        let Self {
            fish,
            kept,
            lodgings,
            habits,
            grids,
            paces,
            firsts,
            boxes,
            anchor,
            field,
            sway,
            standing,
            scratch,
            wishes,
            ..
        } = self;
        // What is far above all of the bed need not look at it, which is worth a look at all of it for many.
        let heights = around.bed.map_or(&[][..], |bed| bed.heights);
        let bed_top = if heights.len() > HEIGHTS_OF_A_FISH * fish.len() {
            f64::INFINITY
        } else {
            f64::from(heights.iter().copied().fold(f32::NEG_INFINITY, f32::max))
        };
        let farthest = grids.iter().zip(&*habits).map(|(grid, own)| f64::from(grid.longest() * own.range));
        let scene = Scene {
            around,
            everybody: Everybody::new(fish, kept),
            lodgings,
            habits,
            grids,
            paces,
            firsts,
            boxes,
            anchor: *anchor,
            field,
            sway,
            standing,
            whims: Whims::at(self.time),
            bed_top,
            longest: grids.iter().map(|grid| f64::from(grid.longest())).fold(0.0, f64::max),
            farthest: farthest.fold(0.0, f64::max),
        };
        let split = Parts::new(wishes, &self.bounds);
        let (scene, parts) = (&scene, &self.parts);
        around.workers.for_each_part_with(scratch, split, |scratch, part, wishes| {
            scene.decide(around.level, scratch, parts[part], wishes);
        });
    }
}

/// Steps after which fish are put in the order of their grids anew: no byte of what they do depends on it.
const ORDERLY: u32 = 64;

/// So many heights of a bed are gone through in the time in which a fish asks for two of them.
const HEIGHTS_OF_A_FISH: usize = 16;

/// No water carries a fish faster [m/s].
const FASTEST_WATER: f32 = 10.0;

/// The owner of what nobody emits.
const NOBODY: u64 = 0;

fn fish(start: &Start, slot: u32, kind: &Kind) -> Fish {
    let (cosine, sine) = reef_flow::math::cos_sin_f64(start.heading);
    // Nobody begins as hungry, or as much in love, as everybody else.
    let share = |purpose: u64| (reef_flow::random::mix(start.seed ^ purpose) >> 40) as f32 / (1 << 24) as f32;
    Fish {
        kind: start.kind,
        slot,
        body: BodyId::NONE,
        habitat: start.habitat,
        seed: start.seed,
        size: start.size,
        position: start.position,
        course: Vec3::new(cosine as f32, 0.0, -sine as f32),
        speed: 0.0,
        water: Vec3::ZERO,
        near: false,
        called: false,
        phase: (start.seed % 1024) as f32 / 1024.0,
        since: act::BLEND,
        bias: [0.0; 2],
        hunger: share(1),
        love: share(2),
        fright: 0.0,
        reach: kind.range(),
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
