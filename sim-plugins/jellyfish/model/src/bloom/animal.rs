//! One animal in the sea.

use core::f64::consts::TAU;

use fearless_simd::{Simd, f32x8};
use glam::{DVec2, DVec3, Vec3};
use reef_flow::{
    Level, Packed, Sphere,
    math::cos_sin_f64,
    random::{Random, mix},
    simd::splat,
    stronger, velocity8,
    waves::{Trains, orbit},
};
use reef_sdk::abi::{DrawVertex, FibreNode, Flow};

use super::{
    Birth, Home, Surroundings,
    apart::{Body, Crowd},
    jet::{Choice, Fit, PRIMITIVES},
    section::{Section, rounded},
    skin::Skin,
};
use crate::{
    slice::{FREQUENCIES, Gait},
    species::Species,
    surface::{Bell, Frame, Fringe, discs},
    water::CELLS,
};

/// A step of the sea with one step of the slice [s].
const STEP: f64 = 1.0 / 60.0;
/// Longest step of what is near and of what is far, as a share of its period. Far animals swim a tenth less
/// far.
const LONGEST_SHARES: [f64; 2] = [0.00625, 0.0125];
/// Most steps in 1/60 s.
const MOST_STEPS: f64 = 16.0;
/// No current or wave carries an animal faster [m/s].
const FASTEST: f32 = 100.0;
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
/// Time in which two slices of a bell lose half of what one is faster than the other [s].
const PACE: f64 = 1.0 / 120.0;

/// An animal with its water, its surface and its place.
#[derive(Clone, Debug)]
pub(super) struct Animal {
    pub(super) id: u64,
    pub(super) species: usize,
    seed: u64,
    /// The slice along its heading.
    pub(super) own: Section,
    /// The one across it: its y is along the own slice's axis.
    pub(super) cross: Option<Section>,
    /// Cells of the grid that its species asks for, and its width [m].
    own_cells: usize,
    window: f64,
    /// Where the slice's first place stands in the world [m].
    pub(super) base: DVec3,
    /// How its own slice lies in the sea while it is upright.
    pub(super) frame: Frame,
    /// Near and far.
    skins: [Skin; 2],
    packed: Packed,
    trains: Trains,
    /// Of each of its slices.
    flows: [[Flow; PRIMITIVES]; 2],
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
    /// Dye in the water of its own slice [m].
    pub(super) tracers: Vec<DVec2>,
    pub(super) velocity: DVec3,
    /// Nothing of it is farther from its place, whether it is written or not [m].
    pub(super) reach: f32,
    /// Of its bell, at rest or noisy, beyond the chain [m].
    shell: f32,
}

impl Animal {
    pub(super) fn new(species: &Species, birth: &Birth, choice: &Choice) -> Result<Self, String> {
        let species = species.sized(birth.size);
        species.check_sizes()?;
        let usual = Surroundings::default();
        let grid = species.water(usual.density, usual.viscosity);
        let mut own = Section::new(&species, grid)?;
        let mut random = Random::new(birth.seed, u64::from_le_bytes(*b"swimming"));
        let usual = species.gait();
        let frequency = usual.frequency * (1.0 + species.motion.variation * random.signed());
        let [lowest, highest] = FREQUENCIES;
        let frequency = birth.frequency.unwrap_or(frequency).clamp(lowest, highest);
        own.slice.set_gait(Gait { frequency, ..usual })?;
        let phase = random.unit();
        own.slice.set_phase(birth.phase.unwrap_or(phase));
        let chain: Vec<DVec2> = own.slice.chain().collect();
        let skin = |far| Skin::new(&species, (&chain, birth.slices), own.points(), birth.seed, far);
        let skins = [skin(false)?, skin(true)?];
        let (cos, sin) = cos_sin_f64(birth.yaw.rem_euclid(TAU));
        let x = Vec3::new(cos as f32, 0.0, sin as f32);
        // Powers of the root of x³ = x + 1 fill a square evenly (M. Roberts 2018).
        let dyed = grid.width().min(DYED * species.bell.diameter);
        let even = |k: usize| {
            let place =
                (DVec2::new(0.754_877_666_246_693, 0.569_840_290_998_053_3) * (k as f64 + 0.5)).fract();
            own.first + (place - 0.5) * dyed
        };
        let heights = species.surface.noise + species.surface.structure + species.surface.compression;
        let mut made = Self {
            id: birth.id,
            species: birth.species,
            seed: birth.seed,
            own_cells: grid.n,
            window: grid.width(),
            base: birth.place,
            frame: Frame { x, y: Vec3::Y, z: x.cross(Vec3::Y) },
            skins,
            packed: Packed::new(),
            trains: Trains::new(),
            flows: [[Flow::default(); PRIMITIVES]; 2],
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
            reach: 0.0,
            shell: ((1.5 + 2.0 * heights) * species.bell.thickness) as f32,
            cross: (birth.slices > 1).then(|| own.clone()),
            own,
        };
        made.emit(choice);
        Ok(made)
    }

    /// Its slices.
    pub(super) fn sections(&self) -> impl Iterator<Item = &Section> {
        [Some(&self.own), self.cross.as_ref()].into_iter().flatten()
    }

    /// Its slices.
    pub(super) fn sections_mut(&mut self) -> impl Iterator<Item = &mut Section> {
        [Some(&mut self.own), self.cross.as_mut()].into_iter().flatten()
    }

    /// What it does to the sea.
    pub(super) fn flows(&self) -> &[Flow] {
        self.flows[..self.sections().count()].as_flattened()
    }

    /// Cells of its grid where the species' number is multiplied by so much.
    fn cells(&self, factor: f64) -> usize {
        let [fewest, most] = CELLS;
        ((self.own_cells as f64 * factor).round() as usize).clamp(fewest, most)
    }

    /// Takes another grid, if it is another one.
    pub(super) fn set_cells(&mut self, n: usize) -> Result<(), String> {
        let mut grid = *self.own.slice.water().grid();
        if n == grid.n {
            return Ok(());
        }
        (grid.n, grid.cell) = (n, self.window / n as f64);
        self.sections_mut().try_for_each(|section| section.slice.regrid(grid))
    }

    /// Cells of its grid.
    pub(super) fn grid_cells(&self) -> usize {
        self.own.slice.water().grid().n
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
        let push = crowd.push(own, self.frame.x.as_dvec3(), self.ways()[0], tuning.apart);
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
            ..self.own.slice.gait()
        };
        let forward = self.own.slice.axis().y;
        let weight = self.weight[0] + self.weight[1] * tuning.excess_density;
        for (section, share) in self.sections_mut().zip([1.0, forward]) {
            // It was taken into its ranges.
            let _ = section.slice.set_gait(gait);
            section.slice.set_water(around.density, around.viscosity);
            section.slice.set_weight(share * weight);
        }
        let share = LONGEST_SHARES[usize::from(self.far)];
        let least = if self.far { 1.0 } else { tuning.steps.max(1) as f64 };
        let steps = (gait.frequency * STEP / share).ceil().clamp(least, MOST_STEPS);
        let parts = (around.dt / STEP * steps - 1e-9).ceil().max(1.0);
        let dt = around.dt / parts;
        for part in 0..parts as usize {
            let courses = self.courses(tuning.tilt);
            self.sections_mut().zip(courses).for_each(|(section, course)| section.slice.steer(course));
            self.keep_pace(dt);
            let phase = self.own.slice.phase();
            self.sections_mut().for_each(|section| section.step(around.level, dt));
            if self.own.slice.phase() < phase {
                let moment = around.time + part as f64 * dt;
                self.begin_period(moment, tuning.idle, tuning.dusk);
            }
            let slice = &self.own.slice;
            let corner = slice.corner();
            for tracer in &mut self.tracers {
                let flow = DVec2::from(slice.water().velocity((*tracer - corner).to_array()));
                // What leaves the square around the animal on one side comes in on the other.
                let dyed = self.window.min(DYED * self.diameter);
                let low = slice.place() - 0.5 * dyed;
                let inside = (*tracer + flow * dt - low) / dyed;
                *tracer = low + (inside - inside.floor()) * dyed;
            }
        }
    }

    /// Both slices are of one bell: what one of them swims faster forward than the other, they share.
    fn keep_pace(&mut self, dt: f64) {
        let Some(cross) = &mut self.cross else { return };
        let axis = self.own.slice.axis();
        let ahead = 0.5 * dt / (dt + PACE) * (self.own.slice.velocity().dot(axis) - cross.slice.velocity().y);
        self.own.slice.tow(axis * -ahead);
        cross.slice.tow(DVec2::Y * ahead);
    }

    /// Where it aims in its slices: its own way, out of the way of others, leant by the tilt in its own.
    fn courses(&self, tilt: f64) -> [DVec2; 2] {
        let [way, across] = self.ways();
        let (cos, sin) = cos_sin_f64(tilt.rem_euclid(TAU));
        // Positive tilt is toward positive x.
        [DVec2::new(cos, -sin).rotate(way + way.perp() * self.lean), across]
    }

    /// Its own way in its slices, and homeward where it has left its home; of length 1.
    fn ways(&self) -> [DVec2; 2] {
        let x = self.frame.x.as_dvec3();
        let mut aim = self.aim;
        if let Some(home) = self.home {
            let place = self.place();
            let off = place.clamp(home.low, home.high) - place;
            aim += DVec3::new(off.x, 0.0, off.z).clamp_length_max(LEANS / HOMEWARD) * HOMEWARD;
        }
        let across = DVec2::new(aim.dot(self.frame.z.as_dvec3()), aim.dot(self.forward()));
        [DVec2::new(aim.dot(x), aim.y), across].map(|way| way.normalize_or(DVec2::Y))
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

    /// What it does to the sea, from its slice and its place; and where its skin is to be.
    pub(super) fn emit(&mut self, choice: &Choice) {
        self.fit = choice.fit(&self.own.slice);
        let (owner, diameter) = (self.id, self.diameter);
        let across = self.frames().map(|frame| frame.z.as_dvec3());
        let mut flows = [choice.flows(&self.fit, owner, diameter, across[0], self.world()); 2];
        if let Some(cross) = &self.cross {
            let fit = choice.fit(&cross.slice);
            flows[1] = choice.flows(&fit, owner, diameter, across[1], self.world_across(cross));
            // Each tells of half of the water.
            flows.as_flattened_mut().iter_mut().for_each(|flow| *flow = stronger(flow, 0.5));
        }
        self.flows = flows;
        self.pose();
    }

    /// Where tentacles and arms hang, and how far anything is from its place.
    fn pose(&mut self) {
        let frames = self.frames();
        let seen = [&frames[0], &frames[1]];
        let Self { own, cross, skins, far, .. } = self;
        let Skin { tentacles, arms, every, .. } = &mut skins[usize::from(*far)];
        let (pairs, others) = (own.tentacles(), cross.as_ref().map(Section::tentacles));
        if *far {
            tentacles.hang(discs(pairs.step_by(*every), others.map(|pairs| pairs.step_by(*every)), seen));
        } else {
            tentacles.hang(discs(rounded(pairs), others.map(rounded), seen));
        }
        let others = cross.as_ref().map(|cross| cross.arms().step_by(*every));
        arms.hang(discs(own.arms().step_by(*every), others, seen));
        let of_bell = discs(own.bell(), cross.as_ref().map(Section::bell), seen).map(|disc| disc.reach());
        let reach = of_bell.fold(tentacles.reach().max(arms.reach()), f32::max);
        self.reach = reach + self.shell;
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
        let frames = self.frames();
        let Self { own, cross, skins, far, .. } = self;
        let Skin { bell, tentacles, arms, .. } = &mut skins[usize::from(*far)];
        tentacles.write_nodes(level, nodes);
        arms.write(level, into_arms);
        let sections = core::iter::once(&*own).chain(cross.as_ref()).zip(frames);
        let slices = sections.map(|(section, frame)| (section.slice.chain(), section.slice.place(), frame));
        bell.write(level, slices, time, into_bell);
    }
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
