//! Where new water comes into a box: out of lasting sources in it, and through its walls.
//!
//! A centre that is placed anew is placed there, each place by how much water comes in. Then the density of
//! the box stays what it was: of each cubic metre that flows in, as many centres come as one has that flows
//! out. What flows out through the opposite wall as fast brings its centres by wrapping, and is left out.
//!
//! The draw is exact. For each panel of the walls, and for shells around each source, it is known how much
//! comes in there at most ([`reef_flow::bounds`]); places are drawn by these bounds, and one is taken with
//! the odds of what comes in at it over its bound, until one is. A table of what was found at a few points
//! would not do: who is taken from where does not follow the mean of such findings, but that of their shares,
//! and a narrow source, whose water is in few places, would have less than its share and the walls more.

use core::f64::consts::TAU;

use reef_flow::{
    Level, Packed,
    bounds::{self, Part, Shell},
    math::cos_sin_f64,
    random::mix,
    sample::{Points, Velocities, divergence, sample},
};

/// Panels along the longest side, as a power of two.
const BITS: u32 = 3;
/// Candidates that are held against the water side by side.
const TRIES: usize = 8;
/// How often, before it is any place.
const ROUNDS: u64 = 64;
/// Greatest speed that counts [m/s]: keeps the sums finite, whatever the sea's primitives add up to.
const FASTEST: f32 = 1e4;

/// The water over a box.
#[derive(Clone, Copy, Debug)]
pub struct Water<'a> {
    /// The sea's velocity, relative to the box's middle.
    pub packed: &'a Packed,
    /// Sources and holes that last.
    pub sources: &'a Packed,
    /// The box's extent in 2⁻³² [m].
    pub unit: [f32; 3],
    /// Length of the step [s].
    pub dt: f32,
    /// Instruction set.
    pub level: Level,
}

/// Room for many points [m] and what the water does there.
#[derive(Clone, Debug, Default)]
pub struct Room {
    /// Points [m, relative to the box's middle].
    pub p: [Vec<f32>; 3],
    /// Velocities [m/s].
    pub v: [Vec<f32>; 3],
}

impl Room {
    /// For so many points.
    pub fn with_capacity(count: usize) -> Self {
        let three = || core::array::from_fn(|_| Vec::with_capacity(count));
        Self { p: three(), v: three() }
    }

    /// Forgets all points.
    pub fn clear(&mut self) {
        self.p.iter_mut().for_each(Vec::clear);
    }

    /// One more point.
    pub fn push(&mut self, point: [f32; 3]) {
        for (axis, value) in self.p.iter_mut().zip(point) {
            axis.push(value);
        }
    }

    /// Velocities at all points.
    pub fn sample(&mut self, packed: &Packed, level: Level) {
        let count = self.p[0].len();
        for v in &mut self.v {
            v.clear();
            v.resize(count, 0.0);
        }
        let [x, y, z] = &self.p;
        let [vx, vy, vz] = &mut self.v;
        sample(level, packed, Points { x, y, z }, Velocities { x: vx, y: vy, z: vz });
    }

    /// The divergence at all points, in the place of the first velocities [1/s].
    fn diverge(&mut self, packed: &Packed, level: Level) {
        let count = self.p[0].len();
        self.v[0].clear();
        self.v[0].resize(count, 0.0);
        let [x, y, z] = &self.p;
        divergence(level, packed, Points { x, y, z }, &mut self.v[0]);
    }
}

impl Water<'_> {
    /// A place in the box [m, from its middle].
    pub fn metres(&self, place: [i32; 3]) -> [f32; 3] {
        core::array::from_fn(|axis| place[axis] as f32 * self.unit[axis])
    }
}

/// Three words by chance.
fn words(chance: u64) -> [u32; 3] {
    let (first, second) = (mix(chance ^ 0x7265), mix(chance ^ 0x6574));
    [first as u32, (first >> 32) as u32, second as u32]
}

/// A share 0..1 by chance.
pub fn share(chance: u64) -> f32 {
    (chance >> 40) as f32 / 16_777_216.0
}

/// A panel of a wall.
#[derive(Clone, Copy, Debug)]
struct Panel {
    /// The wall lies across this axis.
    axis: usize,
    /// Along the axis into the box: 1 at the low wall.
    inward: f32,
    /// Number along each axis.
    at: [u32; 3],
    /// How many there are along each, as powers of two; across the wall one.
    bits: [u32; 3],
}

impl Panel {
    /// Where it is, of a box of an extent [m].
    fn part(&self, extent: [f32; 3]) -> Part {
        let low = core::array::from_fn(|axis| {
            let share = self.at[axis] as f32 / (1 << self.bits[axis]) as f32 - 0.5;
            extent[axis] * if axis == self.axis { -0.5 * self.inward } else { share }
        });
        let high = core::array::from_fn(|axis| {
            let side = extent[axis] / (1 << self.bits[axis]) as f32;
            low[axis] + if axis == self.axis { 0.0 } else { side }
        });
        Part { low, high }
    }

    /// [m²]
    fn area(&self, extent: [f32; 3]) -> f32 {
        let sides = (0..3).filter(|axis| *axis != self.axis);
        sides.map(|axis| extent[axis] / (1 << self.bits[axis]) as f32).product()
    }

    /// A point of it by chance [2⁻³² of the extent, from the box's middle].
    fn point(&self, chance: u64) -> [i32; 3] {
        let within = words(chance);
        core::array::from_fn(|axis| {
            if self.axis == axis {
                return if self.inward > 0.0 { i32::MIN } else { i32::MAX };
            }
            let bits = self.bits[axis];
            let offset = (u64::from(self.at[axis]) << (32 - bits)) | (u64::from(within[axis]) >> bits);
            (offset as u32 ^ 0x8000_0000) as i32
        })
    }
}

/// A place where water may come in, and the most that it may be.
#[derive(Clone, Copy, Debug)]
enum Candidate {
    /// A panel, and the bound of the speed [m/s].
    Wall(Panel, f32),
    /// Beside sources, and the bound of the divergence [1/s].
    Spring(f32),
    /// Outside of the box.
    Nowhere,
}

/// Where new water comes into a box in one step.
#[derive(Clone, Debug, Default)]
pub struct Inflow {
    extent: [f32; 3],
    panels: Vec<Panel>,
    /// Bounds of the speed through each panel [m/s].
    most: Vec<f32>,
    shells: Vec<Shell>,
    /// Sums of the bounds of what comes in, up to and with each panel and each shell [m³/s].
    sums: Vec<f32>,
    taken: bool,
    here: Room,
    other: Room,
    springs: Room,
}

impl Inflow {
    /// For a box of an extent [m].
    pub fn new(extent: [f64; 3]) -> Self {
        let greatest = extent.into_iter().fold(0.0, f64::max);
        // The power of two nearest to each side's share of the longest, from below.
        let fits = |e: f64, b: u32| e * 1.5 * f64::from(1 << (BITS - b)) >= greatest;
        let bits = extent.map(|e| (0..=BITS).rev().find(|b| fits(e, *b)).unwrap_or(0));
        let mut inflow = Self { extent: extent.map(|e| e as f32), ..Self::default() };
        for axis in 0..3 {
            for inward in [1.0, -1.0] {
                let bits = core::array::from_fn(|i| if i == axis { 0 } else { bits[i] });
                inflow.add(axis, inward, bits);
            }
        }
        let count = inflow.panels.len();
        (inflow.most, inflow.sums) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for room in [&mut inflow.here, &mut inflow.other, &mut inflow.springs] {
            *room = Room::with_capacity(TRIES);
        }
        inflow
    }

    fn add(&mut self, axis: usize, inward: f32, bits: [u32; 3]) {
        for number in 0..1_u32 << bits.iter().sum::<u32>() {
            let mut rest = number;
            let at = bits.map(|bits| {
                let at = rest & ((1 << bits) - 1);
                rest >>= bits;
                at
            });
            self.panels.push(Panel { axis, inward, at, bits });
        }
    }

    /// Makes room for so many sources and holes, so that no later draw allocates.
    pub fn make_room(&mut self, sources: usize) {
        let shells = sources * bounds::MOST_SHELLS;
        self.shells.reserve(shells.saturating_sub(self.shells.len()));
        let sums = self.panels.len() + shells;
        self.sums.reserve(sums.saturating_sub(self.sums.len()));
    }

    /// Forgets the step before.
    pub fn forget(&mut self) {
        self.taken = false;
    }

    /// A place, each by how much water comes in there, and how far inward it flows in this step [2⁻³² of the
    /// extent]. `chance`: of the one who is placed.
    pub fn draw(&mut self, water: &Water<'_>, chance: u64) -> [i32; 3] {
        if !self.taken {
            self.take(water);
            self.taken = true;
        }
        for round in 0..ROUNDS {
            if let Some(found) = self.try_some(water, mix(chance ^ round)) {
                return found;
            }
        }
        // No water comes in anywhere.
        words(chance).map(|word| word as i32)
    }

    /// The bounds of all places.
    fn take(&mut self, water: &Water<'_>) {
        let Self { panels, most, shells, sums, extent, .. } = self;
        most.clear();
        shells.clear();
        sums.clear();
        let mut sum = 0.0;
        for panel in panels.iter() {
            let bound = water
                .packed
                .most_entering(&panel.part(*extent), *extent, panel.axis, panel.inward)
                .min(FASTEST);
            most.push(bound);
            sum += bound * panel.area(*extent);
            sums.push(sum);
        }
        let whole = Part { low: extent.map(|e| -0.5 * e), high: extent.map(|e| 0.5 * e) };
        water.sources.shells(&whole, shells);
        for shell in shells.iter() {
            sum += shell.mass();
            sums.push(sum);
        }
    }

    /// Holds some candidates, each drawn by its bound, against what is there; the first that holds.
    fn try_some(&mut self, water: &Water<'_>, chance: u64) -> Option<[i32; 3]> {
        let all = self.sums.last().copied().filter(|all| *all > 0.0)?;
        let chance_of = |number: usize| mix(chance ^ (number as u64) << 8);
        let mut places = [[0; 3]; TRIES];
        let mut candidates = [Candidate::Nowhere; TRIES];
        self.here.clear();
        self.springs.clear();
        for (number, (place, candidate)) in places.iter_mut().zip(&mut candidates).enumerate() {
            (*place, *candidate) = self.candidate(water, all, chance_of(number));
            let point = water.metres(*place);
            self.here.push(point);
            self.springs.push(point);
        }
        let across = |number: usize| match &candidates[number] {
            Candidate::Wall(panel, _) => Some(panel.axis),
            _ => None,
        };
        through(water, across, &mut self.here, &mut self.other);
        self.springs.diverge(water.sources, water.level);
        for (number, candidate) in candidates.into_iter().enumerate() {
            let chance = chance_of(number);
            let odds = share(mix(chance ^ 0x6f64));
            match candidate {
                Candidate::Wall(panel, most) => {
                    let [excess, speed] = entering(&self.here, &self.other, number, panel.axis, panel.inward);
                    if odds * most < excess {
                        // It came in at some time of the step; no farther than to the middle.
                        let way = speed * water.dt * share(mix(!chance)) / water.unit[panel.axis];
                        let inward = way.min(2_147_483_520.0) as i32;
                        let mut place = places[number];
                        place[panel.axis] += if panel.inward > 0.0 { inward } else { -inward };
                        return Some(place);
                    }
                }
                Candidate::Spring(most) => {
                    if odds * most < self.springs.v[0][number] {
                        return Some(places[number]);
                    }
                }
                Candidate::Nowhere => {}
            }
        }
        None
    }

    /// A place by the bounds.
    fn candidate(&self, water: &Water<'_>, all: f32, chance: u64) -> ([i32; 3], Candidate) {
        let part = share(mix(chance)) * all;
        let index = self.sums.partition_point(|sum| *sum <= part);
        if let Some(panel) = self.panels.get(index) {
            return (panel.point(chance), Candidate::Wall(*panel, self.most[index]));
        }
        let nowhere = ([0; 3], Candidate::Nowhere);
        let Some(shell) = self.shells.get(index - self.panels.len()) else { return nowhere };
        let [first, second, third] = words(chance).map(|word| f64::from(word) / 4_294_967_296.0);
        let y = 2.0 * first - 1.0;
        let level = (1.0 - y * y).max(0.0).sqrt();
        let (cosine, sine) = cos_sin_f64(TAU * second);
        let direction = [level * cosine, y, level * sine].map(|v| v as f32);
        let point = shell.point(direction, third as f32);
        if (0..3).any(|axis| point[axis].abs() >= 0.5 * self.extent[axis]) {
            return nowhere;
        }
        // A cast saturates.
        let place = core::array::from_fn(|axis| (point[axis] / water.unit[axis]) as i32);
        let here = water.metres(place);
        // Each source's own part of the bound: where several reach, each of them draws.
        let most: f32 = self.shells.iter().map(|shell| shell.at(here)).sum();
        (place, Candidate::Spring(most))
    }
}

/// What the water does at points of walls, `here`, and at the same places of the walls opposite.
fn through(water: &Water<'_>, across: impl Fn(usize) -> Option<usize>, here: &mut Room, other: &mut Room) {
    other.clear();
    for number in 0..here.p[0].len() {
        let mut point: [f32; 3] = core::array::from_fn(|axis| here.p[axis][number]);
        if let Some(axis) = across(number) {
            point[axis] = -point[axis];
        }
        other.push(point);
    }
    here.sample(water.packed, water.level);
    other.sample(water.packed, water.level);
}

/// Speed inward at a point of a wall: what does not come by wrapping, and all [m/s].
fn entering(here: &Room, other: &Room, number: usize, axis: usize, inward: f32) -> [f32; 2] {
    let (enters, leaves) = (inward * here.v[axis][number], inward * other.v[axis][number]);
    let enters = enters.clamp(0.0, FASTEST);
    [(enters - leaves.max(0.0)).max(0.0), enters]
}
