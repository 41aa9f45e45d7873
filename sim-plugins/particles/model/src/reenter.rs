//! Where particles enter again that left with the water.
//!
//! The rule. A centre that leaves through a wall enters through the opposite wall, at the same place of it,
//! if the water flows on there as fast as it went out; if it is slower, with the odds of the two speeds, and
//! where it does not flow inward at all — a source between the walls pushes water out through both — never.
//! Where a hole that lasts takes water away, −∇·V of it in a second, centres go with it, with those odds.
//! Each centre that went so is placed anew at once where new water comes in ([`crate::inflow`]).
//!
//! A master that its slaves follow never vanishes from among them, nor comes anew among its own: they would
//! jump with it. In its place the nearest of them vanishes, whose water does, too.
//!
//! So the water that a source makes brings its particles with it, the water that a hole takes away takes them
//! along, and their number never changes. Nor does their density: a cubic metre has as many when it comes as
//! when it goes.

use crate::{
    drift::{MOST_MEMBERS, WORDS},
    inflow::{Inflow, Room, Water, share},
};
use reef_flow::random::mix;

/// A share of the speed that is no difference: a step crosses the wall somewhere within its own length.
const SAME_SPEED: f32 = 0.999;

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
    /// What all centres have drifted alike.
    pub now: [i32; 3],
    /// How many particles there are.
    pub count: u64,
    /// d_pmin, d_pmax [m].
    pub range: [f64; 2],
    /// Of each chunk, who jumped in this step.
    pub jumped: &'a mut [[u64; WORDS]],
}

/// Whose master comes anew is not among them after so many draws.
const DRAWS: u64 = 16;

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

    /// Where it is said whether a slot of the box jumped: chunk, word and bit.
    fn jump_bit(&self, slot: usize) -> (usize, usize, u64) {
        (slot / self.slots, slot % self.slots / 64, 1 << (slot % 64))
    }

    /// Whether one jumped: each that is listed as leaving did.
    fn jumped(&self, slot: usize) -> bool {
        let (chunk, word, bit) = self.jump_bit(slot);
        self.jumped[chunk][word] & bit != 0
    }

    /// Says that another one jumped.
    fn jumps_instead(&mut self, slot: usize, instead: usize) {
        let [(chunk, word, bit), other] = [slot, instead].map(|slot| self.jump_bit(slot));
        self.jumped[chunk][word] &= !bit;
        self.jumped[other.0][other.1] |= other.2;
    }

    fn is_master(&self, slot: usize) -> bool {
        self.members > 1 && slot % self.slots < self.groups
    }

    /// The slave of a master in a slot that is nearest to a place, if it is where slaves follow: d_pmin …
    /// d_pmax away.
    fn nearest_slave(&self, master: usize, place: [i32; 3], water: &Water<'_>) -> Option<usize> {
        let number = self.number(master);
        let here = water.metres(place);
        let slaves = (1..self.members).filter(|j| number + (*j as u64) < self.count);
        let apart = slaves.map(|j| {
            let slave = master + j * self.groups;
            let there = water.metres(self.place(slave));
            let square: f64 = (0..3).map(|axis| f64::from(there[axis] - here[axis]).powi(2)).sum();
            (square, slave)
        });
        let [least, most] = self.range.map(|distance| distance * distance);
        let near = apart.filter(|(square, _)| (least..=most).contains(square));
        near.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, slave)| slave)
    }

    /// Number of the particle in a slot of the box.
    fn number(&self, slot: usize) -> u64 {
        let (chunk, slot) = (slot / self.slots, slot % self.slots);
        ((chunk * self.groups + slot % self.groups) * self.members + slot / self.groups) as u64
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
    /// Where each is now.
    here: Room,
    /// Where each left.
    left: Room,
    inflow: Inflow,
}

impl Leavers {
    /// With room for `count`, of a box of an extent [m].
    pub fn new(extent: [f64; 3], count: usize) -> Self {
        Self {
            slots: Vec::with_capacity(count),
            here: Room::with_capacity(count),
            left: Room::with_capacity(count),
            inflow: Inflow::new(extent),
        }
    }

    /// Begins a list.
    pub fn clear(&mut self) {
        self.slots.clear();
    }

    /// A centre in a slot of the box left through walls across these axes (bit 0: x), or (none) with water
    /// that vanished.
    pub fn push(&mut self, slot: u32, axes: u16) {
        self.slots.push((slot, axes));
    }

    /// Makes room for so many sources and holes.
    pub fn make_room(&mut self, sources: usize) {
        self.inflow.make_room(sources);
    }

    /// Whether nobody left.
    pub fn is_empty(&self) -> bool {
        self.slots.is_empty()
    }

    /// Places those anew who vanished, or entered where the water does not flow on.
    pub fn settle(&mut self, water: &Water<'_>, chunks: &mut Chunks<'_>, seed: u64) {
        self.here.clear();
        self.left.clear();
        for (slot, axes) in &self.slots {
            let here = water.metres(chunks.place(*slot as usize));
            self.here.push(here);
            self.left.push(core::array::from_fn(|axis| {
                let extent = water.unit[axis] * 4_294_967_296.0;
                let crossed = axes >> axis & 1 != 0;
                here[axis] - if crossed { extent.copysign(here[axis]) } else { 0.0 }
            }));
        }
        self.here.sample(water.packed, water.level);
        self.left.sample(water.packed, water.level);
        for (i, (slot, axes)) in self.slots.iter().enumerate() {
            let slot = *slot as usize;
            let chance = mix(seed ^ mix(chunks.number(slot)));
            let odds = share(chance) * SAME_SPEED;
            let flows_on = (0..3).all(|axis| {
                // At the low wall it has to flow upward along the axis, at the high one downward.
                let inward = 1.0_f32.copysign(-self.here.p[axis][i]);
                let (entry, exit) = (inward * self.here.v[axis][i], inward * self.left.v[axis][i]);
                axes >> axis & 1 == 0 || (entry > 0.0 && entry > odds * exit)
            });
            if *axes != 0 && flows_on {
                continue;
            }
            let mut gone = slot;
            if *axes == 0
                && chunks.is_master(slot)
                && let Some(slave) = chunks.nearest_slave(slot, chunks.place(slot), water)
                && !chunks.jumped(slave)
            {
                chunks.jumps_instead(slot, slave);
                gone = slave;
            }
            let mut place = self.inflow.draw(water, mix(chance));
            for draw in 0..DRAWS {
                if !chunks.is_master(gone) || chunks.nearest_slave(gone, place, water).is_none() {
                    break;
                }
                place = self.inflow.draw(water, mix(chance ^ mix(draw)));
            }
            chunks.put(gone, place);
        }
        self.inflow.forget();
    }
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
