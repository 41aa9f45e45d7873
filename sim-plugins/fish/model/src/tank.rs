//! The bodies of all fish of one species, stepped together, eight to a vector.
//!
//! A fish is kept by itself; those that are stepped are put side by side in eights. Since lanes do not touch
//! one another, who swims beside whom changes nothing, and neither does who runs which eight.

use glam::DVec3;
use reef_flow::Level;
use reef_sdk::{Parts, Workers};

use crate::{
    kernel::{Fish8, Pace, Pack, Plan},
    lanes::WIDTH,
    material::{Drive, Method},
};

/// One fish, but for its nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Swimmer {
    /// What its nodes are relative to [m, world]. It follows the fish.
    pub origin: DVec3,
    /// Size over that of the species. A fish of another size is the same fish with all lengths and speeds so
    /// many times as large at the same beat: c, ζ and m grow with its cube, μ with itself.
    pub size: f64,
    /// Where in its beat it is [beats], 0..1.
    pub phase: f32,
    /// What its muscles are told.
    pub drive: Drive,
    /// Velocity of the water around it [m/s].
    pub water: DVec3,
}

impl Swimmer {
    /// One of the species' own size at rest in still water.
    pub fn at(origin: DVec3) -> Self {
        Self { origin, size: 1.0, phase: 0.0, drive: Drive::default(), water: DVec3::ZERO }
    }
}

/// How a step is taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stepping {
    /// The integrator.
    pub method: Method,
    /// Longest sub-step [s]. The thesis's is 4 ms.
    pub longest: f64,
}

impl Default for Stepping {
    /// Four sub-steps in a sixtieth of a second.
    fn default() -> Self {
        Self { method: Method::Implicit, longest: 0.0042 }
    }
}

/// Most sub-steps of a step.
const MOST_SUBSTEPS: f64 = 1000.0;

impl Stepping {
    fn pace(&self, dt: f64) -> Pace {
        // Whole numbers of sub-steps survive rounding.
        let count = (dt / self.longest - 1e-6).ceil().clamp(1.0, MOST_SUBSTEPS);
        Pace { dt: (dt / count) as f32, count: count as u32, method: self.method }
    }
}

/// The bodies of one species.
#[derive(Clone, Debug)]
pub struct Tank {
    plan: Plan,
    swimmers: Vec<Swimmer>,
    /// Relative to each one's origin, at the species' own size [m, m/s]: fish by fish.
    positions: Vec<[f32; 3]>,
    velocities: Vec<[f32; 3]>,
    /// Of each worker.
    packs: Vec<Pack>,
    bounds: Vec<usize>,
    node_bounds: Vec<usize>,
    all: Vec<u32>,
}

impl Tank {
    /// Fish at rest whose noses point by `headings`, a turn about the vertical [rad] from +x toward −z.
    pub fn new(plan: Plan, swimmers: Vec<Swimmer>, headings: &[f64]) -> Self {
        let mut positions = Vec::with_capacity(swimmers.len() * plan.rest.len());
        for i in 0..swimmers.len() {
            let (cosine, sine) = reef_flow::math::cos_sin_f64(headings.get(i).copied().unwrap_or(0.0));
            let (cosine, sine) = (cosine as f32, sine as f32);
            let turned = |[x, y, z]: [f32; 3]| [x * cosine + z * sine, y, z * cosine - x * sine];
            positions.extend(plan.rest.iter().map(|at| turned(*at)));
        }
        let count = swimmers.len();
        Self {
            velocities: vec![[0.0; 3]; positions.len()],
            positions,
            packs: Vec::new(),
            bounds: Vec::with_capacity(count / WIDTH + 2),
            node_bounds: Vec::with_capacity(count / WIDTH + 2),
            all: (0..count as u32).collect(),
            plan,
            swimmers,
        }
    }

    /// So many fish more, of the species' own size, all nodes in one place.
    pub(crate) fn add(&mut self, more: usize) {
        let count = self.swimmers.len() + more;
        self.swimmers.resize(count, Swimmer::at(DVec3::ZERO));
        self.positions.resize(count * self.plan.rest.len(), [0.0; 3]);
        self.velocities.resize(count * self.plan.rest.len(), [0.0; 3]);
        self.bounds.reserve(count / WIDTH + 2);
        self.node_bounds.reserve(count / WIDTH + 2);
        self.all.extend((count - more) as u32..count as u32);
    }

    /// The species' body.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Memory that they take [bytes].
    pub(crate) fn bytes(&self) -> usize {
        let nodes = size_of_val(&*self.positions) + size_of_val(&*self.velocities);
        size_of_val(&*self.swimmers) + nodes + size_of_val(&*self.all)
    }

    /// All fish.
    pub fn swimmers(&self) -> &[Swimmer] {
        &self.swimmers
    }

    /// All fish, to be told what to do.
    pub fn swimmers_mut(&mut self) -> &mut [Swimmer] {
        &mut self.swimmers
    }

    fn nodes_of(&self, fish: usize) -> core::ops::Range<usize> {
        let nodes = self.plan.rest.len();
        fish * nodes..(fish + 1) * nodes
    }

    /// Nodes of a fish, relative to its origin and at the species' own size [m].
    pub fn positions(&self, fish: usize) -> &[[f32; 3]] {
        &self.positions[self.nodes_of(fish)]
    }

    /// Their velocities, at the species' own size [m/s].
    pub fn velocities(&self, fish: usize) -> &[[f32; 3]] {
        &self.velocities[self.nodes_of(fish)]
    }

    /// Puts a fish's nodes elsewhere.
    pub fn place(&mut self, fish: usize, positions: &[[f32; 3]], velocities: &[[f32; 3]]) {
        let range = self.nodes_of(fish);
        self.positions[range.clone()].copy_from_slice(positions);
        self.velocities[range].copy_from_slice(velocities);
    }

    /// Both of them, to be changed.
    pub(crate) fn nodes_mut(&mut self, fish: usize) -> (&mut [[f32; 3]], &mut [[f32; 3]]) {
        let range = self.nodes_of(fish);
        (&mut self.positions[range.clone()], &mut self.velocities[range])
    }

    /// Centre of a fish's nodes [m, world].
    pub fn center(&self, fish: usize) -> DVec3 {
        let swimmer = &self.swimmers[fish];
        swimmer.origin + swimmer.size * mean(self.positions(fish)).as_dvec3()
    }

    /// Velocity of a fish's centre [m/s].
    pub fn velocity(&self, fish: usize) -> DVec3 {
        self.swimmers[fish].size * mean(self.velocities(fish)).as_dvec3()
    }

    /// Steps all fish by `dt` [s].
    pub fn step_all(&mut self, dt: f64, stepping: &Stepping, level: Level, workers: Workers<'_>) {
        let all = core::mem::take(&mut self.all);
        self.step(&all, dt, stepping, level, workers);
        self.all = all;
    }

    /// Steps the fish of these numbers, which rise, by `dt` [s].
    pub fn step(&mut self, who: &[u32], dt: f64, stepping: &Stepping, level: Level, workers: Workers<'_>) {
        if who.is_empty() || dt.is_nan() || dt <= 0.0 {
            return;
        }
        let nodes = self.plan.rest.len();
        let pace = stepping.pace(dt);
        self.bounds.clear();
        self.bounds.extend(who.chunks(WIDTH).map(|eight| eight[0] as usize));
        self.bounds[0] = 0;
        self.bounds.push(self.swimmers.len());
        self.node_bounds.clear();
        self.node_bounds.extend(self.bounds.iter().map(|bound| bound * nodes));
        if self.packs.len() < workers.count() {
            self.packs.resize_with(workers.count(), Pack::default);
        }
        for pack in &mut self.packs {
            pack.fit(&self.plan);
        }
        let Self { plan, swimmers, positions, velocities, packs, bounds, node_bounds, .. } = self;
        let (plan, bounds, node_bounds) = (&*plan, &*bounds, &*node_bounds);
        let split = (
            Parts::new(swimmers, bounds),
            (Parts::new(positions, node_bounds), Parts::new(velocities, node_bounds)),
        );
        workers.for_each_part_with(packs, split, |pack, chunk, (swimmers, (positions, velocities))| {
            let eight = &who[chunk * WIDTH..who.len().min((chunk + 1) * WIDTH)];
            let mut eight =
                Eight { first: bounds[chunk], who: eight, nodes, swimmers, positions, velocities };
            let mut fish = eight.gather(pack);
            pack.step(level, plan, &mut fish, pace);
            eight.scatter(pack, &fish, plan.body().length() as f32);
        });
    }
}

/// Eight fish on their way into lanes and out of them.
struct Eight<'a> {
    /// Number of the first fish of the slices.
    first: usize,
    who: &'a [u32],
    nodes: usize,
    swimmers: &'a mut [Swimmer],
    positions: &'a mut [[f32; 3]],
    velocities: &'a mut [[f32; 3]],
}

impl Eight<'_> {
    /// Fills all lanes: those that are left over with the first fish.
    fn gather(&self, pack: &mut Pack) -> Fish8 {
        let mut fish = Fish8::default();
        for lane in 0..WIDTH {
            let at = self.who[if lane < self.who.len() { lane } else { 0 }] as usize - self.first;
            let swimmer = &self.swimmers[at];
            let drive = &swimmer.drive;
            fish.phase.0[lane] = swimmer.phase;
            fish.speed.0[lane] = drive.speed as f32;
            fish.force.0[lane] = drive.force as f32;
            fish.yaw.0[lane] = drive.yaw as f32;
            fish.pitch.0[lane] = drive.pitch as f32;
            let water = (swimmer.water / swimmer.size).as_vec3().to_array();
            fish.water.iter_mut().zip(water).for_each(|(into, from)| into.0[lane] = from);
            let range = at * self.nodes..(at + 1) * self.nodes;
            for (into, from) in pack.positions.iter_mut().zip(&self.positions[range.clone()]) {
                (0..3).for_each(|axis| into[axis].0[lane] = from[axis]);
            }
            for (into, from) in pack.velocities.iter_mut().zip(&self.velocities[range]) {
                (0..3).for_each(|axis| into[axis].0[lane] = from[axis]);
            }
        }
        fish
    }

    /// Takes the fish back, and their origins after those that have swum half a length away.
    fn scatter(&mut self, pack: &Pack, fish: &Fish8, length: f32) {
        for (lane, number) in self.who.iter().enumerate() {
            let at = *number as usize - self.first;
            let swimmer = &mut self.swimmers[at];
            swimmer.phase = fish.phase.0[lane];
            let range = at * self.nodes..(at + 1) * self.nodes;
            let positions = &mut self.positions[range.clone()];
            for (into, from) in positions.iter_mut().zip(&pack.positions) {
                (0..3).for_each(|axis| into[axis] = from[axis].0[lane]);
            }
            for (into, from) in self.velocities[range].iter_mut().zip(&pack.velocities) {
                (0..3).for_each(|axis| into[axis] = from[axis].0[lane]);
            }
            let middle = mean(positions);
            if middle.length_squared() > 0.25 * length * length {
                swimmer.origin += swimmer.size * middle.as_dvec3();
                positions.iter_mut().for_each(|at| *at = (glam::Vec3::from(*at) - middle).to_array());
            }
        }
    }
}

/// The mean of some vectors.
fn mean(vectors: &[[f32; 3]]) -> glam::Vec3 {
    let sum: glam::Vec3 = vectors.iter().map(|v| glam::Vec3::from(*v)).sum();
    sum / vectors.len().max(1) as f32
}
