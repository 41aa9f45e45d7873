//! Where new water comes into a box: out of lasting sources in it, and through its walls.
//!
//! A centre that is placed anew is placed there, each place by how much water comes in. Then the density of the box stays
//! what it was: of each cubic metre that flows in, as many centres come as one has that flows out. What flows out through
//! the opposite wall as fast brings its centres by wrapping, and is left out.
//!
//! A table says how much comes in through each panel of the walls and out of each cell of the box, as found at one place of
//! each, another in every step; then, of some places in the panel or cell that is drawn, one is.

use reef_flow::{
    Level, Packed,
    sample::{Points, Velocities, divergence, sample},
};

use crate::seed::mix;

/// Cells along the longest side, as a power of two; a wall has twice as many panels.
const BITS: u32 = 3;
/// Places that are tried in a panel or a cell.
const TRIES: usize = 8;
/// Panels or cells that are drawn before it is any place.
const DRAWS: u64 = 4;

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

/// A panel of a wall, or a cell.
#[derive(Clone, Copy, Debug)]
struct Place {
    /// The walls across this axis; None: a cell.
    across: Option<usize>,
    /// −1: the low wall.
    side: f32,
    /// Number along each axis.
    at: [u32; 3],
    /// How many there are along each.
    bits: [u32; 3],
}

impl Place {
    /// Area of a panel [m²], or volume of a cell [m³], of a box of an extent [m].
    fn size(&self, extent: [f32; 3]) -> f32 {
        let sides = (0..3).filter(|axis| self.across != Some(*axis));
        sides.map(|axis| extent[axis] / (1 << self.bits[axis]) as f32).product()
    }

    /// A point of it by chance [2⁻³² of the extent, from the box's middle]; on a wall's panel the axis across is its wall.
    fn point(&self, chance: u64) -> [i32; 3] {
        let within = words(chance);
        core::array::from_fn(|axis| {
            if self.across == Some(axis) {
                return if self.side < 0.0 { i32::MIN } else { i32::MAX };
            }
            let bits = self.bits[axis];
            let offset = (u64::from(self.at[axis]) << (32 - bits)) | (u64::from(within[axis]) >> bits);
            (offset as u32 ^ 0x8000_0000) as i32
        })
    }
}

/// Where new water comes into a box in one step.
#[derive(Clone, Debug, Default)]
pub struct Inflow {
    extent: [f32; 3],
    places: Vec<Place>,
    /// Sums of what comes in up to and with each place [m³/s].
    sums: Vec<f32>,
    taken: bool,
    here: Room,
    other: Room,
    tried: Room,
    tried_other: Room,
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
            for side in [-1.0, 1.0] {
                let bits = core::array::from_fn(|i| if i == axis { 0 } else { bits[i] + 1 });
                inflow.add(Some(axis), side, bits);
            }
        }
        inflow.add(None, 0.0, bits);
        let count = inflow.places.len();
        inflow.sums = Vec::with_capacity(count);
        (inflow.here, inflow.other) = (Room::with_capacity(count), Room::with_capacity(count));
        (inflow.tried, inflow.tried_other) = (Room::with_capacity(TRIES), Room::with_capacity(TRIES));
        inflow
    }

    fn add(&mut self, across: Option<usize>, side: f32, bits: [u32; 3]) {
        for number in 0..1_u32 << bits.iter().sum::<u32>() {
            let mut rest = number;
            let at = bits.map(|bits| {
                let at = rest & ((1 << bits) - 1);
                rest >>= bits;
                at
            });
            self.places.push(Place { across, side, at, bits });
        }
    }

    /// Forgets the step before.
    pub fn forget(&mut self) {
        self.taken = false;
    }

    /// A place by how much water comes in, and how far inward it flows in this step [2⁻³² of the extent]. `chance`: of the
    /// step, and of the one who is placed.
    pub fn draw(&mut self, water: &Water<'_>, step: u64, chance: u64) -> [i32; 3] {
        if !self.taken {
            self.take(water, step);
            self.taken = true;
        }
        let all = self.sums.last().copied().unwrap_or(0.0);
        for draw in 0..DRAWS {
            let chance = mix(chance ^ draw);
            let part = share(chance) * all;
            let index = self.sums.partition_point(|sum| *sum <= part);
            let Some(place) = self.places.get(index).copied() else { break };
            if let Some(found) = self.within(water, &place, mix(chance)) {
                return found;
            }
        }
        // No water comes in anywhere.
        words(chance).map(|word| word as i32)
    }

    fn take(&mut self, water: &Water<'_>, step: u64) {
        let Self { places, sums, here, other, extent, .. } = self;
        let walls = places.iter().position(|place| place.across.is_none()).unwrap_or(places.len());
        let (walls, cells) = places.split_at(walls);
        here.clear();
        let points = walls.iter().enumerate().map(|(number, place)| place.point(mix(step ^ number as u64)));
        points.for_each(|point| here.push(water.metres(point)));
        through(water, |index| walls[index].across, here, other);
        sums.clear();
        let mut sum = 0.0;
        for (index, place) in walls.iter().enumerate() {
            let Some(axis) = place.across else { continue };
            sum += entering(here, other, index, axis, place.side)[0] * place.size(*extent);
            sums.push(sum);
        }
        if !water.sources.has_sources() {
            return;
        }
        here.clear();
        let points = cells.iter().enumerate().map(|(number, place)| place.point(mix(!step ^ number as u64)));
        points.for_each(|point| here.push(water.metres(point)));
        here.diverge(water.sources, water.level);
        for (place, divergence) in cells.iter().zip(&here.v[0]) {
            sum += divergence.clamp(0.0, 1e6) * place.size(*extent);
            sums.push(sum);
        }
    }

    /// One of some points of a place.
    fn within(&mut self, water: &Water<'_>, place: &Place, chance: u64) -> Option<[i32; 3]> {
        let Self { tried, tried_other, .. } = self;
        tried.clear();
        let point = |number: usize| place.point(mix(chance ^ number as u64));
        (0..TRIES).for_each(|number| tried.push(water.metres(point(number))));
        let mut odds = [0.0; TRIES];
        let mut way = [0.0; TRIES];
        if let Some(axis) = place.across {
            through(water, |_| place.across, tried, tried_other);
            for number in 0..TRIES {
                let [excess, speed] = entering(tried, tried_other, number, axis, place.side);
                odds[number] = excess;
                // It came in at some time of the step.
                way[number] = speed * water.dt * share(mix(!chance ^ number as u64));
            }
        } else {
            tried.diverge(water.sources, water.level);
            for (odds, divergence) in odds.iter_mut().zip(&tried.v[0]) {
                *odds = divergence.clamp(0.0, 1e6);
            }
        }
        let all: f32 = odds.iter().sum();
        if all <= 0.0 {
            return None;
        }
        let mut rest = share(mix(chance ^ 0x6f64)) * all;
        let chosen = odds.iter().position(|odds| {
            rest -= odds;
            rest < 0.0
        });
        let chosen = chosen.unwrap_or(0);
        let mut found = point(chosen);
        if let Some(axis) = place.across {
            // No farther than to the middle.
            let inward = (way[chosen] / water.unit[axis]).min(2_147_483_520.0) as i32;
            found[axis] = if place.side < 0.0 { found[axis] + inward } else { found[axis] - inward };
        }
        Some(found)
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
fn entering(here: &Room, other: &Room, number: usize, axis: usize, side: f32) -> [f32; 2] {
    let (enters, leaves) = (-side * here.v[axis][number], -side * other.v[axis][number]);
    let enters = enters.clamp(0.0, 1e4);
    [(enters - leaves.max(0.0)).max(0.0), enters]
}
