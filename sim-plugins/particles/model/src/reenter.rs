//! Where particles enter again that left with the water.
//!
//! The rule. Where no source or hole acts on a box, a centre that leaves through a wall enters through the opposite wall, at
//! the same place of it. Where one does, it enters so if the water flows on there as fast as it went out; if it is slower,
//! with the odds of the two speeds, and where it does not flow inward at all — a source between the walls pushes water out
//! through both — never. Where water vanishes in a hole, −∇·V of it in a second, centres go with it, with those odds. Each
//! centre that went so is placed anew at once where the box has too few: in a cell of a coarse grid, drawn by the square of
//! what each lacks, and in there rather where water is new: out of nothing, or through a wall.
//!
//! So the water that a source makes brings its particles with it, the water that a hole takes away takes them along, and
//! their number never changes.

use reef_flow::{
    Level, Packed,
    sample::{Points, Velocities, sample},
};

use crate::{
    census::Census,
    drift::{MOST_MEMBERS, SLOTS},
    seed::mix,
};

/// Steps in which each chunk is looked at once for water that vanishes.
pub const LOOK_STEPS: u64 = 32;
/// Where water vanishes more slowly than the first of these, particles go at the second rate at most [1/s]: what only passes,
/// as a fish does, pushes them and lets them go.
const VANISHES: (f32, f32) = (0.5, 0.02);
/// Places that are tried for one who is placed anew.
const TRIES: u64 = 16;
/// Water that was outside of the box so long ago is new [s].
const NEW: f32 = 10.0;
/// The odds of a place grow with the water that is new there; elsewhere they are those of this much [1/s].
const ANYWHERE: f32 = 0.005;
/// Differences for the divergence are taken over this to both sides [m], or this share of the box.
const SPAN: (f32, f32) = (0.02, 0.1);
/// A share of the speed that is no difference: a step crosses the wall somewhere within its own length.
const SAME_SPEED: f32 = 0.999;

/// A share 0..1 by chance.
fn share(chance: u64) -> f32 {
    (chance >> 40) as f32 / 16_777_216.0
}

/// The sea's velocity over a box.
#[derive(Clone, Copy, Debug)]
pub struct Water<'a> {
    /// Relative to the box's middle.
    pub packed: &'a Packed,
    /// Its sources and holes alone: where water comes from and where it goes.
    pub sources: &'a Packed,
    /// The box's extent in 2⁻³² [m].
    pub unit: [f32; 3],
    /// Instruction set.
    pub level: Level,
}

/// Room for many points [m] and the water's velocities there [m/s].
#[derive(Clone, Debug, Default)]
struct Room {
    p: [Vec<f32>; 3],
    v: [Vec<f32>; 3],
    /// [1/s]
    divergence: Vec<f32>,
}

impl Room {
    fn with_capacity(count: usize) -> Self {
        let three = || core::array::from_fn(|_| Vec::with_capacity(count));
        Self { p: three(), v: three(), divergence: Vec::with_capacity(count) }
    }

    fn sample(&mut self, packed: &Packed, level: Level) {
        let count = self.p[0].len();
        for v in &mut self.v {
            v.clear();
            v.resize(count, 0.0);
        }
        let [x, y, z] = &self.p;
        let [vx, vy, vz] = &mut self.v;
        sample(level, packed, Points { x, y, z }, Velocities { x: vx, y: vy, z: vz });
    }

    /// ∇·V of sources and holes at places, by differences to both sides along each axis.
    fn diverge(&mut self, water: &Water<'_>, places: impl Iterator<Item = [i32; 3]> + Clone) {
        let smallest = water.unit.into_iter().fold(f32::INFINITY, f32::min) * 4_294_967_296.0;
        let span = SPAN.0.min(SPAN.1 * smallest);
        for axis in 0..3 {
            self.p[axis].clear();
            for side in 0..6 {
                let off = if side / 2 == axis { span * (2 * (side % 2)) as f32 - span } else { 0.0 };
                self.p[axis].extend(places.clone().map(|place| place[axis] as f32 * water.unit[axis] + off));
            }
        }
        self.sample(water.sources, water.level);
        let count = self.p[0].len() / 6;
        let Self { v, divergence, .. } = self;
        divergence.clear();
        divergence.extend((0..count).map(|i| {
            let along = |axis: usize| v[axis][(2 * axis + 1) * count + i] - v[axis][2 * axis * count + i];
            (along(0) + along(1) + along(2)) / (2.0 * span)
        }));
    }

    /// Which of the water at places came through a wall of late: 1 / [`NEW`], or 0.
    fn enter(&mut self, water: &Water<'_>, places: impl Iterator<Item = [i32; 3]> + Clone) {
        for axis in 0..3 {
            self.p[axis].clear();
            self.p[axis].extend(places.clone().map(|place| place[axis] as f32 * water.unit[axis]));
        }
        self.sample(water.packed, water.level);
    }

    /// How much of the water at one of the places of [`Room::enter`] came through a wall of late [1/s].
    fn entered(&self, water: &Water<'_>, number: usize) -> f32 {
        let outside = (0..3).any(|axis| {
            let before = self.p[axis][number] - NEW * self.v[axis][number];
            before.abs() > water.unit[axis] * 2_147_483_648.0
        });
        if outside { 1.0 / NEW } else { 0.0 }
    }
}

/// The chunks of a box: all its centres.
#[derive(Debug)]
pub struct Chunks<'a> {
    /// Offsets of all slots of the box [2⁻³² of the extent].
    pub at: [&'a mut [i32]; 3],
    /// Slots of a chunk.
    pub slots: usize,
    /// Members of a group.
    pub members: usize,
    /// Groups of a chunk.
    pub groups: usize,
    /// Particles of the box.
    pub count: u64,
    /// What all centres have drifted alike.
    pub now: [i32; 3],
}

impl Chunks<'_> {
    /// Where the centre in a slot of the box is.
    fn place(&self, slot: usize) -> [i32; 3] {
        core::array::from_fn(|axis| self.at[axis][slot].wrapping_add(self.now[axis]))
    }

    fn put(&mut self, slot: usize, place: [i32; 3]) {
        for (axis, place) in place.into_iter().enumerate() {
            self.at[axis][slot] = place.wrapping_sub(self.now[axis]);
        }
    }

    /// Number of the particle in a slot of the box.
    fn number(&self, slot: usize) -> u64 {
        let (chunk, slot) = (slot / self.slots, slot % self.slots);
        ((chunk * self.groups + slot % self.groups) * self.members + slot / self.groups) as u64
    }

    /// Takes the count, unless this step's is there.
    fn count(&self, census: &mut Census) {
        if census.is_taken() {
            return;
        }
        census.begin();
        let per_chunk = (self.groups * self.members) as u64;
        for (chunk, first) in (0..self.count).step_by(per_chunk as usize).enumerate() {
            let alive = alive(self.count - first, self.members, self.groups);
            for (member, living) in alive.iter().enumerate().take(self.members) {
                let slot = chunk * self.slots + member * self.groups;
                let slots = (slot..slot + usize::from(*living)).step_by(census.stride());
                slots.for_each(|slot| census.add(self.place(slot)));
            }
        }
    }
}

/// Groups with a member j among the first groups of `count` particles, for each j.
pub fn alive(count: u64, members: usize, groups: usize) -> [u16; MOST_MEMBERS] {
    let members = members as u64;
    core::array::from_fn(|j| {
        let j = j as u64;
        let with = if j < members { (count + members - 1).saturating_sub(j) / members } else { 0 };
        with.min(groups as u64) as u16
    })
}

/// Those who leave, and room to see to them.
#[derive(Clone, Debug, Default)]
pub struct Leavers {
    /// Slot in the box, and bits of the axes.
    slots: Vec<(u32, u16)>,
    /// Where each is now and, behind all of these, where it left.
    here: Room,
    /// Places that are tried.
    tried: Room,
}

impl Leavers {
    /// With room for `count`.
    pub fn with_capacity(count: usize) -> Self {
        Self {
            slots: Vec::with_capacity(count.max(SLOTS)),
            here: Room::with_capacity((2 * count).max(6 * SLOTS)),
            tried: Room::with_capacity(6 * TRIES as usize),
        }
    }

    /// Begins a list.
    pub fn clear(&mut self) {
        self.slots.clear();
    }

    /// A centre in a slot of the box left through walls across these axes (bit 0: x).
    pub fn push(&mut self, slot: u32, axes: u16) {
        self.slots.push((slot, axes));
    }

    /// Whether nobody left.
    pub fn is_empty(&self) -> bool {
        self.slots.is_empty()
    }

    /// Places those anew who entered where the water does not flow on.
    pub fn settle(&mut self, water: &Water<'_>, chunks: &mut Chunks<'_>, census: &mut Census, seed: u64) {
        let count = self.slots.len();
        for axis in 0..3 {
            let p = &mut self.here.p[axis];
            p.clear();
            let places = self.slots.iter().map(|(slot, _)| chunks.place(*slot as usize)[axis]);
            p.extend(places.map(|place| place as f32 * water.unit[axis]));
            let extent = water.unit[axis] * 4_294_967_296.0;
            for i in 0..count {
                let crossed = self.slots[i].1 >> axis & 1 != 0;
                let out = if crossed { -extent.copysign(p[i]) } else { 0.0 };
                p.push(p[i] + out);
            }
        }
        self.here.sample(water.packed, water.level);
        for (i, (slot, axes)) in self.slots.iter().enumerate() {
            let slot = *slot as usize;
            let chance = mix(seed ^ mix(chunks.number(slot)));
            let odds = share(chance) * SAME_SPEED;
            let flows_on = (0..3).all(|axis| {
                // At the low wall it has to flow upward along the axis, at the high one downward.
                let inward = 1.0_f32.copysign(-self.here.p[axis][i]);
                let (entry, exit) = (inward * self.here.v[axis][i], inward * self.here.v[axis][count + i]);
                axes >> axis & 1 == 0 || (entry > 0.0 && entry > odds * exit)
            });
            if !flows_on {
                place_anew(water, chunks, census, &mut self.tried, slot, mix(chance));
            }
        }
    }

    /// Looks at one chunk of a box, whose slots are `here`, for centres in water that vanishes, and places them anew; calls
    /// `moved` with each one's slot in the box. `period`: time until it is looked at again [s].
    pub fn vanish(
        &mut self,
        water: &Water<'_>,
        chunks: &mut Chunks<'_>,
        census: &mut Census,
        here: &[core::ops::Range<usize>],
        seed: u64,
        period: f32,
        mut moved: impl FnMut(usize),
    ) {
        self.slots.clear();
        self.slots.extend(here.iter().flat_map(Clone::clone).map(|slot| (slot as u32, 0)));
        self.here.diverge(water, self.slots.iter().map(|(slot, _)| chunks.place(*slot as usize)));
        for (i, (slot, _)) in self.slots.iter().enumerate() {
            let rate = -self.here.divergence[i];
            let lost = period * if rate > VANISHES.0 { rate } else { rate.min(VANISHES.1) };
            if lost <= 0.0 {
                continue;
            }
            let slot = *slot as usize;
            let chance = mix(seed ^ mix(chunks.number(slot)));
            // Never more than all.
            if share(chance) < lost / (1.0 + lost) {
                place_anew(water, chunks, census, &mut self.tried, slot, mix(chance));
                moved(slot);
            }
        }
    }
}

/// Gives the centre in a slot of the box a place where centres are missing.
fn place_anew(
    water: &Water<'_>,
    chunks: &mut Chunks<'_>,
    census: &mut Census,
    room: &mut Room,
    slot: usize,
    chance: u64,
) {
    chunks.count(census);
    let cell = census.draw(chunks.place(slot), chance);
    let tries = (0..TRIES).map(|number| census.within(cell, mix(chance ^ number)));
    room.diverge(water, tries.clone());
    room.enter(water, tries);
    let odds =
        |number: usize| room.divergence[number].clamp(0.0, 1e6) + room.entered(water, number) + ANYWHERE;
    let all: f32 = (0..TRIES as usize).map(odds).sum();
    let mut rest = share(mix(chance ^ TRIES)) * all;
    let chosen = (0..TRIES as usize).position(|number| {
        rest -= odds(number);
        rest < 0.0
    });
    chunks.put(slot, census.within(cell, mix(chance ^ chosen.unwrap_or(0) as u64)));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_group_may_lack_slaves() {
        assert_eq!(alive(9, 4, 16)[..5], [3, 2, 2, 2, 0]);
        assert_eq!(alive(400, 4, 16)[..5], [16, 16, 16, 16, 0]);
        assert_eq!(alive(0, 4, 16)[0], 0);
    }
}
