//! One animal in the sea.

use core::f64::consts::TAU;

use fearless_simd::{Simd, f32x8};
use glam::{DVec2, DVec3, Vec2, Vec3};
use reef_flow::{
    Level, Packed, Sphere,
    math::cos_sin_f64,
    random::{Random, mix},
    simd::splat,
    velocity8,
    waves::{Trains, orbit},
};
use reef_sdk::abi::{DrawVertex, FibreNode, Flow};

use super::{
    Birth, Home, Surroundings,
    apart::{Body, Crowd},
    jet::{Choice, Fit, PRIMITIVES},
    skin::Skin,
};
use crate::{
    slice::{FREQUENCIES, Gait, Slice},
    species::Species,
    surface::{Bell, Frame, Fringe},
    trail::Trail,
    water::CELLS,
};

/// A step of the sea with one step of the slice [s].
const STEP: f64 = 1.0 / 60.0;
/// Longest step of what is near and of what is far, as a share of its period. Far animals swim a tenth less
/// far.
const LONGEST_SHARES: [f64; 2] = [0.00625, 0.0125];
/// Most steps in 1/60 s.
const MOST_STEPS: f64 = 16.0;
/// Links of a trail.
const LINKS: usize = 16;
/// How fast trails sink, in lengths of their own a second.
const SINK: f64 = 0.3;
/// No current or wave carries an animal faster [m/s].
const FASTEST: f32 = 100.0;
/// Where arms stand around the mouth, and how far apart their tips drift, in widths of the bell.
const MOUTH: f64 = 0.04;
const ARM_SPREAD: f64 = 0.12;
/// A level changes back when the bell is by this share wider or narrower than where it changed.
const BAND: f64 = 0.15;
/// Periods that an animal idles, or swims, in the mean.
const SPELL: f64 = 6.0;
/// Share of a home's height in which an animal turns round.
const TURNING: f64 = 0.1;
/// Share of a home's height, from its top, in which an animal stays at dusk.
const DUSK: f64 = 0.3;
/// Width of the square around an animal in which there is dye, in widths of the bell.
const DYED: f64 = 5.0;
/// How far an animal leans homeward, as a share of upright, for each metre beyond its home; and the most.
const HOMEWARD: f64 = 2.0;
const LEANS: f64 = 0.7;
/// How near the surface and the bed the middle of a bell comes, in widths of it.
const CLEAR: f64 = 0.75;

/// An animal with its water, its surface and its place.
#[derive(Clone, Debug)]
pub(super) struct Animal {
    pub(super) id: u64,
    pub(super) species: usize,
    seed: u64,
    pub(super) slice: Slice<f32>,
    /// Cells of the grid that its species asks for, and its width [m].
    own_cells: usize,
    window: f64,
    /// Where the slice's first place stands in the world [m].
    pub(super) base: DVec3,
    /// That place in the slice.
    first: DVec2,
    frame: Frame,
    /// Of the tentacles on both sides, and of the arms.
    pub(super) trails: [Trail; 3],
    /// Near and far.
    skins: [Skin; 2],
    packed: Packed,
    trains: Trains,
    pub(super) flows: [Flow; PRIMITIVES],
    pub(super) fit: Fit,
    pub(super) diameter: f64,
    /// Contractions a second, and how far they go, before the tuning.
    frequency: f64,
    strength: f64,
    /// Weight less buoyancy of its own, and for each kg/m³ more [N per metre of depth].
    weight: [f64; 2],
    pub(super) aim: DVec3,
    /// Across its aim in its slice, in this step: out of the way of others.
    lean: f64,
    home: Option<Home>,
    /// It does not contract before the next period begins.
    pub(super) idles: bool,
    /// It is drawn and stepped coarsely.
    pub(super) far: bool,
    /// Dye in its water [m, as [`Slice::chain`]].
    pub(super) tracers: Vec<DVec2>,
    pub(super) velocity: DVec3,
    /// Of its bell, at rest or noisy, beyond the chain [m].
    shell: f32,
}

impl Animal {
    pub(super) fn new(species: &Species, birth: &Birth, choice: &Choice) -> Result<Self, String> {
        let species = species.sized(birth.size);
        species.check_sizes()?;
        let usual = Surroundings::default();
        let grid = species.water(usual.density, usual.viscosity);
        let mut slice = Slice::<f32>::new(species.build(), grid)?;
        let mut random = Random::new(birth.seed, u64::from_le_bytes(*b"swimming"));
        let usual = species.gait();
        let frequency = usual.frequency * (1.0 + species.motion.variation * random.signed());
        let [lowest, highest] = FREQUENCIES;
        let frequency = birth.frequency.unwrap_or(frequency).clamp(lowest, highest);
        slice.set_gait(Gait { frequency, ..usual })?;
        let phase = random.unit();
        slice.set_phase(birth.phase.unwrap_or(phase));
        let chain: Vec<DVec2> = slice.chain().collect();
        let trail = |leader: DVec2, length: f64| Trail::new(leader, LINKS, length, SINK * length);
        let tip = |side: usize| slice.strand(side).last().unwrap_or(chain[0]);
        let hanging = (species.tentacles.length - species.bell.strand).max(0.01 * species.bell.diameter);
        let trails = [
            trail(tip(0), hanging),
            trail(tip(1), hanging),
            trail(mouth(&slice), species.arms.length.max(0.01 * species.bell.diameter)),
        ];
        let points = [slice.strand(0).len() + LINKS, LINKS + 1];
        let skin = |far| Skin::new(&species, &chain, points, birth.seed, far);
        let skins = [skin(false)?, skin(true)?];
        let (cos, sin) = cos_sin_f64(birth.yaw.rem_euclid(TAU));
        let x = Vec3::new(cos as f32, 0.0, sin as f32);
        // Powers of the root of x³ = x + 1 fill a square evenly (M. Roberts 2018).
        let dyed = grid.width().min(DYED * species.bell.diameter);
        let even = |k: usize| {
            let place =
                (DVec2::new(0.754_877_666_246_693, 0.569_840_290_998_053_3) * (k as f64 + 0.5)).fract();
            slice.place() + (place - 0.5) * dyed
        };
        let heights = species.surface.noise + species.surface.structure + species.surface.compression;
        let mut made = Self {
            id: birth.id,
            species: birth.species,
            seed: birth.seed,
            own_cells: grid.n,
            window: grid.width(),
            first: slice.place(),
            base: birth.place,
            frame: Frame { x, y: Vec3::Y, z: x.cross(Vec3::Y) },
            trails,
            skins,
            packed: Packed::new(),
            trains: Trains::new(),
            flows: [Flow::default(); PRIMITIVES],
            fit: Fit::default(),
            diameter: species.bell.diameter,
            frequency,
            strength: usual.strength,
            weight: [species.build().weight, species.weight(1.0)],
            aim: birth.aim,
            lean: 0.0,
            home: birth.home,
            idles: false,
            far: false,
            tracers: (0..birth.tracers).map(even).collect(),
            velocity: DVec3::ZERO,
            shell: ((1.5 + 2.0 * heights) * species.bell.thickness) as f32,
            slice,
        };
        made.emit(choice);
        Ok(made)
    }

    /// A point of the slice in the world [m].
    pub(super) fn world(&self, point: DVec2) -> DVec3 {
        let way = point - self.first;
        self.base + self.frame.x.as_dvec3() * way.x + self.frame.y.as_dvec3() * way.y
    }

    /// Middle of the bell [m, world].
    pub(super) fn place(&self) -> DVec3 {
        self.world(self.slice.place())
    }

    /// Where the apex points, in the world: a unit vector.
    pub(super) fn axis(&self) -> Vec3 {
        self.frame.of(self.slice.axis().as_vec2()).normalize_or(Vec3::Y)
    }

    /// Cells of its grid where the species' number is multiplied by so much.
    fn cells(&self, factor: f64) -> usize {
        let [fewest, most] = CELLS;
        ((self.own_cells as f64 * factor).round() as usize).clamp(fewest, most)
    }

    /// Takes another grid, if it is another one.
    pub(super) fn set_cells(&mut self, n: usize) -> Result<(), String> {
        let mut grid = *self.slice.water().grid();
        if n == grid.n {
            return Ok(());
        }
        (grid.n, grid.cell) = (n, self.window / n as f64);
        self.slice.regrid(grid)
    }

    /// Cells of its grid.
    pub(super) fn grid_cells(&self) -> usize {
        self.slice.water().grid().n
    }

    /// What others see of it.
    pub(super) fn body(&self) -> Body {
        Body { id: self.id, place: self.place(), radius: 0.5 * self.diameter }
    }

    /// `crowd`: all of them, and which one it is.
    pub(super) fn step(
        &mut self,
        around: &Surroundings<'_>,
        field: &reef_flow::Field,
        (crowd, own): (&Crowd, usize),
        choice: &Choice,
    ) {
        let tuning = around.tuning;
        let before = self.place();
        // A grid that does not fit was refused when the animal was made: its width stays.
        let _ = self.set_cells(self.cells(tuning.cells));
        let wide = self.diameter * around.pixels / before.distance(around.eye).max(1e-3);
        let [narrow, broad] = [1.0 - BAND, 1.0 + BAND].map(|share| share * tuning.detail);
        self.far = if self.far { wide < broad } else { wide < narrow };
        self.drift(around, field, before);
        let push = crowd.push(own, self.frame.x.as_dvec3(), self.way(), tuning.apart);
        self.base += push.velocity * around.dt;
        self.lean = push.lean;
        self.swim(around);
        self.keep(around);
        self.emit(choice);
        self.velocity = (self.place() - before) / around.dt;
    }

    fn drift(&mut self, around: &Surroundings<'_>, field: &reef_flow::Field, place: DVec3) {
        let place = place.to_array();
        let bounds = Sphere { center: place, radius: self.diameter };
        self.packed.fill_near(field, bounds, place, self.id);
        self.trains.fill(around.waves, around.depth, place);
        let drift = reef_flow::dispatch!(around.level, simd => felt(simd, &self.packed, &self.trains));
        self.base += DVec3::from(drift.map(f64::from)) * around.dt;
    }

    fn swim(&mut self, around: &Surroundings<'_>) {
        let tuning = around.tuning;
        let [lowest, highest] = FREQUENCIES;
        let gait = Gait {
            frequency: (self.frequency * tuning.frequency).clamp(lowest, highest),
            strength: if self.idles { 0.0 } else { (self.strength * tuning.strength).clamp(0.0, 1.0) },
            ..self.slice.gait()
        };
        // It was taken into its ranges.
        let _ = self.slice.set_gait(gait);
        self.slice.set_water(around.density, around.viscosity);
        self.slice.set_weight(self.weight[0] + self.weight[1] * tuning.excess_density);
        let share = LONGEST_SHARES[usize::from(self.far)];
        let least = if self.far { 1.0 } else { tuning.steps.max(1) as f64 };
        let steps = (gait.frequency * STEP / share).ceil().clamp(least, MOST_STEPS);
        let parts = (around.dt / STEP * steps - 1e-9).ceil().max(1.0);
        let dt = around.dt / parts;
        for part in 0..parts as usize {
            self.slice.steer(self.course(tuning.tilt));
            let phase = self.slice.phase();
            self.slice.step(around.level, dt);
            if self.slice.phase() < phase {
                let moment = around.time + part as f64 * dt;
                self.begin_period(moment, tuning.idle, tuning.dusk);
            }
            let leaders = self.leaders();
            let corner = self.slice.corner();
            for (trail, leader) in self.trails.iter_mut().zip(leaders) {
                trail.step(self.slice.water(), corner, leader, dt);
            }
            for tracer in &mut self.tracers {
                let flow = DVec2::from(self.slice.water().velocity((*tracer - corner).to_array()));
                // What leaves the square around the animal on one side comes in on the other.
                let dyed = self.window.min(DYED * self.diameter);
                let low = self.slice.place() - 0.5 * dyed;
                let inside = (*tracer + flow * dt - low) / dyed;
                *tracer = low + (inside - inside.floor()) * dyed;
            }
        }
    }

    /// Where it aims in its slice: its own way, out of the way of others, leant by the tilt.
    fn course(&self, tilt: f64) -> DVec2 {
        let way = self.way();
        let (cos, sin) = cos_sin_f64(tilt.rem_euclid(TAU));
        // Positive tilt is toward positive x.
        DVec2::new(cos, -sin).rotate(way + way.perp() * self.lean)
    }

    /// Its own way in its slice, and homeward where it has left its home; of length 1.
    fn way(&self) -> DVec2 {
        let x = self.frame.x.as_dvec3();
        let mut aim = self.aim;
        if let Some(home) = self.home {
            let place = self.place();
            let off = place.clamp(home.low, home.high) - place;
            aim += DVec3::new(off.x, 0.0, off.z).clamp_length_max(LEANS / HOMEWARD) * HOMEWARD;
        }
        DVec2::new(aim.dot(x), aim.y).normalize_or(DVec2::Y)
    }

    /// Whether it swims in the period that begins.
    fn begin_period(&mut self, time: f64, idle: f64, dusk: bool) {
        let chance = Random::new(mix(self.seed) ^ self.id, time.to_bits()).unit();
        if let Some(Home { low, high }) = self.home {
            let height = high.y - low.y;
            let margin = TURNING * height;
            let low = if dusk { high.y - DUSK * height } else { low.y };
            let y = self.place().y;
            if y > high.y - margin {
                self.idles = true;
                return;
            }
            if y < low + margin {
                self.idles = false;
                return;
            }
        }
        // The shares of both kinds of periods come out as they are told.
        let ends = if self.idles { (1.0 - idle) / SPELL } else { idle / SPELL };
        let ends = if idle >= 1.0 { f64::from(u8::from(!self.idles)) } else { ends };
        // One that sinks back into its home goes on until it is low enough.
        let sinks = self.idles && self.home.is_some() && idle <= 0.0;
        if !sinks && chance < ends {
            self.idles = !self.idles;
        }
    }

    /// Keeps it below the surface, above the bed, and within its home's walls.
    fn keep(&mut self, around: &Surroundings<'_>) {
        let place = self.place();
        let mut kept = place;
        if let Some(Home { low, high }) = self.home {
            let slack = DVec3::new(self.diameter, 0.0, self.diameter);
            kept.x = kept.x.clamp(low.x - slack.x, high.x + slack.x);
            kept.z = kept.z.clamp(low.z - slack.z, high.z + slack.z);
        }
        let clear = CLEAR * self.diameter;
        let bed = around.bed.map_or(-around.depth, |bed| f64::from(bed.height(kept.x, kept.z)));
        kept.y = kept.y.max(bed + clear).min(-clear);
        let limit = crate::slice::FARTHEST;
        kept = kept.clamp(DVec3::splat(-limit), DVec3::splat(limit));
        self.base += kept - place;
    }

    /// What it does to the sea, from its slice and its place.
    pub(super) fn emit(&mut self, choice: &Choice) {
        self.fit = choice.fit(&self.slice);
        let across = self.frame.z.as_dvec3();
        self.flows = choice.flows(&self.fit, self.id, self.diameter, across, |point| self.world(point));
    }

    /// What the trails follow.
    fn leaders(&self) -> [DVec2; 3] {
        let mouth = mouth(&self.slice);
        let tip = |side: usize| self.slice.strand(side).last().unwrap_or(mouth);
        [tip(0), tip(1), mouth]
    }

    fn skin(&self) -> &Skin {
        &self.skins[usize::from(self.far)]
    }

    /// Vertices of its arms and its bell, as it is drawn now.
    pub(super) fn vertices(&self) -> [usize; 2] {
        let skin = self.skin();
        [skin.arms.vertices(), skin.bell.form().bell_vertices()]
    }

    /// Tentacles, and nodes of each, as it is drawn now.
    pub(super) fn tentacles(&self) -> [usize; 2] {
        let skin = self.skin();
        [skin.tentacles.count(), skin.tentacles.points()]
    }

    /// Its arms and its bell, near or far.
    pub(super) fn parts(&self, far: bool) -> (&Fringe, &Bell) {
        let skin = &self.skins[usize::from(far)];
        (&skin.arms, &skin.bell)
    }

    /// All of its vertices, arms first, and the nodes of its tentacles, relative to its place.
    pub(super) fn write(
        &mut self,
        level: Level,
        time: f64,
        into: &mut [DrawVertex],
        nodes: &mut [FibreNode],
    ) {
        let [arms, _] = self.vertices();
        let (into_arms, into_bell) = into.split_at_mut(arms);
        let Self { slice, frame, trails, skins, far, .. } = self;
        let Skin { bell, tentacles, arms, every } = &mut skins[usize::from(*far)];
        let origin = slice.place();
        let pairs = hanging(slice, trails);
        if *far {
            tentacles.write_nodes(level, pairs.step_by(*every), frame, nodes);
        } else {
            tentacles.write_nodes(level, rounded(pairs), frame, nodes);
        }
        arms.write(level, of_arms(slice, &trails[2]).step_by(*every), frame, into_arms);
        bell.write(level, slice.chain(), origin, frame, time, into_bell);
    }

    /// Nothing of it is farther from its place [m], whether it is written or not.
    pub(super) fn reach(&self) -> f32 {
        let Self { slice, trails, far, .. } = self;
        let Skin { tentacles, arms, every, .. } = self.skin();
        let pairs = hanging(slice, trails);
        let of_tentacles =
            if *far { tentacles.reach(pairs.step_by(*every)) } else { tentacles.reach(rounded(pairs)) };
        let of_arms = arms.reach(of_arms(slice, &trails[2]).step_by(*every));
        let origin = slice.place();
        let square = |point: DVec2| (point - origin).as_vec2().length_squared();
        let of_bell = slice.chain().map(square).fold(0.0, f32::max).sqrt();
        of_tentacles.max(of_arms).max(of_bell) + self.shell
    }
}

/// The pairs of points that tentacles hang along, from the margin on, relative to the animal's place: on the
/// side of positive x, and opposite [m].
fn hanging(slice: &Slice<f32>, trails: &[Trail; 3]) -> impl Iterator<Item = [Vec2; 2]> + Clone {
    let origin = slice.place();
    let near = move |point: DVec2| (point - origin).as_vec2();
    let [left, right] = [0, 1].map(|side| slice.strand(side).chain(trails[side].points().iter().copied()));
    right.zip(left).map(move |(right, left)| [near(right), near(left)])
}

/// The same of arms: they hang from the mouth, and drift apart toward their tips.
fn of_arms(slice: &Slice<f32>, trail: &Trail) -> impl Iterator<Item = [Vec2; 2]> {
    let (origin, diameter) = (slice.place(), slice.build().diameter);
    let points = core::iter::once(mouth(slice)).chain(trail.points().iter().copied());
    points.enumerate().map(move |(k, point)| {
        let spread = MOUTH + ARM_SPREAD * k as f64 / LINKS as f64;
        let aside = Vec2::new((spread * diameter) as f32, 0.0);
        let middle = (point - origin).as_vec2();
        [middle + aside, middle - aside]
    })
}

/// Points, and a point between each two neighbours: that of the cubic through four of them.
fn rounded(pairs: impl Iterator<Item = [Vec2; 2]> + Clone) -> impl Iterator<Item = [Vec2; 2]> {
    let before = pairs.clone().take(1).chain(pairs.clone());
    let after = pairs.clone().skip(1);
    let last = pairs.clone().last();
    let beyond = pairs.clone().skip(2).chain(last).chain(last);
    let between = after.zip(before).zip(beyond).map(Some).chain([None]);
    pairs.zip(between).flat_map(|(own, between)| {
        let middle = between.map(|((after, before), beyond)| {
            core::array::from_fn(|i| (9.0 * (own[i] + after[i]) - (before[i] + beyond[i])) / 16.0)
        });
        [Some(own), middle].into_iter().flatten()
    })
}

/// Where the arms hang: the inner apex.
fn mouth(slice: &Slice<f32>) -> DVec2 {
    let chain = slice.chain();
    let middle = chain.len() / 2;
    slice.chain().nth(middle).unwrap_or_default()
}

/// Currents and orbital velocity at the packed forms' own origin [m/s].
#[inline(always)]
fn felt<S: Simd>(simd: S, currents: &Packed, trains: &Trains) -> [f32; 3] {
    let zero = splat(simd, 0.0);
    let mut velocity = velocity8(simd, currents, zero, zero, zero);
    if !trains.is_empty() {
        let orbit = orbit(simd, trains, trains.len(), [zero; 3]);
        for (velocity, own) in velocity.iter_mut().zip(orbit.velocity) {
            *velocity += own;
        }
    }
    velocity.map(|v: f32x8<S>| {
        let lane = v[0];
        if lane.is_nan() { 0.0 } else { lane.clamp(-FASTEST, FASTEST) }
    })
}
