//! What a later step depends on: where the centres are, and where the sources were. And what a picture of the
//! present one does: which of the centres jumped.

use std::ops::Range;

use reef_sdk::{StateError, StateReader, StateWriter};

use super::{Cloud, UNKNOWN, slot_of};
use crate::drift::WORDS;

/// Everything that moves.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct State {
    /// Particles of each box.
    pub counts: Vec<u32>,
    /// What uniform currents have moved the centres of each box by: x, y, z in extents of the box, 0..1.
    pub turns: Vec<f64>,
    /// Length of the last step [s].
    pub dt: f64,
    /// Offsets of all centres, box by box in the order of their numbers, one list an axis [2⁻³² of the
    /// extent].
    pub at: [Vec<i32>; 3],
    /// Particles that jumped in the last step, by their places in these lists, ascending: no picture blends
    /// them.
    pub jumped: Vec<u32>,
    /// Where each source and hole of the sea was in the last step: x, y, z [m, world].
    pub sources: Vec<f64>,
}

impl State {
    /// Into the plugin's state, version 2.
    pub fn write(&self, state: &mut StateWriter) {
        self.write_with(state, |axis, into| into.copy_from_slice(&self.at[axis]));
    }

    /// The same, where `at` writes the offsets along an axis.
    fn write_with(&self, state: &mut StateWriter, at: impl Fn(usize, &mut [i32])) {
        let count = self.counts.iter().map(|count| *count as usize).sum();
        state.put("counts", &self.counts);
        state.put("turns", &self.turns);
        state.put_one("dt", self.dt);
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            state.fill(name, count, |into| at(axis, into));
        }
        state.put("jumped", &self.jumped);
        state.put("sources", &self.sources);
    }

    /// Out of it. Version 1 had no jumps and no sources: nothing jumped, and all sources last until it is
    /// seen that they move.
    pub fn read(state: &mut StateReader) -> Result<Self, StateError> {
        let known = state.version() > 1;
        Ok(Self {
            jumped: if known { state.get("jumped")? } else { Vec::new() },
            sources: if known { state.get("sources")? } else { Vec::new() },
            counts: state.get("counts")?,
            turns: state.get("turns")?,
            dt: state.get_one("dt")?,
            at: [state.get("x")?, state.get("y")?, state.get("z")?],
        })
    }
}

impl Cloud {
    /// The present state.
    pub fn save(&self) -> State {
        let mut state = self.save_all_but_places();
        let count = state.counts.iter().map(|count| *count as usize).sum();
        for (axis, into) in state.at.iter_mut().enumerate() {
            into.resize(count, 0);
            self.save_places(axis, into);
        }
        state
    }

    /// The present state into the plugin's.
    pub fn save_to(&self, state: &mut StateWriter) {
        self.save_all_but_places().write_with(state, |axis, into| self.save_places(axis, into));
    }

    /// The offsets of all centres along an axis: see [`State::at`].
    fn save_places(&self, axis: usize, mut into: &mut [i32]) {
        let slots = self.slots();
        for swarm in &self.swarms {
            let count = swarm.plan.count as usize;
            let (all, rest) = into.split_at_mut(count);
            let own = &self.at[axis][swarm.pieces.start * slots..];
            each_group(count, [self.members, self.groups], |numbers, slot| {
                let own = own[slot..].iter().step_by(self.groups);
                all[numbers].iter_mut().zip(own).for_each(|(all, own)| *all = *own);
            });
            into = rest;
        }
    }

    fn save_all_but_places(&self) -> State {
        let sources = self.lasting.places().as_flattened().to_vec();
        let mut state = State { dt: self.last_dt, sources, ..State::default() };
        let slots = self.slots();
        let mut before = 0;
        for swarm in &self.swarms {
            state.counts.push(swarm.plan.count);
            state.turns.extend(swarm.turns);
            let first = swarm.pieces.start * slots;
            let count = swarm.plan.count as usize;
            for (piece, words) in self.jumped[swarm.pieces.clone()].iter().enumerate() {
                if words.iter().all(|word| *word == 0) {
                    continue;
                }
                let jumped = (piece * slots..((piece + 1) * slots).min(count)).filter(|i| {
                    let (chunk, word, bit) = mark(first + slot_of(*i, self.members, self.groups), slots);
                    self.jumped[chunk][word] & bit != 0
                });
                state.jumped.extend(jumped.map(|i| (before + i) as u32));
            }
            before += count;
        }
        state
    }

    /// Takes back what [`Cloud::save`] gave; says what is wrong with it otherwise, and then has changed
    /// nothing.
    pub fn load(&mut self, state: &State) -> Result<(), String> {
        let counts: Vec<u32> = self.swarms.iter().map(|swarm| swarm.plan.count).collect();
        if state.counts != counts {
            return Err(format!("is of boxes with {:?} particles; here they have {counts:?}", state.counts));
        }
        let total: usize = counts.iter().map(|count| *count as usize).sum();
        if state.at.iter().any(|axis| axis.len() != total) || state.turns.len() != 3 * counts.len() {
            return Err("has not as many places as particles".to_owned());
        }
        if !state.turns.iter().all(|turns| (0.0..=1.0).contains(turns)) {
            return Err("has a drift that is not from 0 to 1".to_owned());
        }
        if !state.dt.is_finite() || state.dt < 0.0 {
            return Err("has a step of no possible length".to_owned());
        }
        if state.jumped.iter().any(|number| *number as usize >= total) {
            return Err("has a jump of a particle that is not there".to_owned());
        }
        let (sources, rest) = state.sources.as_chunks::<3>();
        if !rest.is_empty() || !state.sources.iter().all(|v| v.is_finite()) {
            return Err("has a source that is nowhere".to_owned());
        }
        self.last_dt = state.dt;
        self.lasting.restore(sources);
        self.spheres.fill(UNKNOWN);
        self.jumped.fill([0; WORDS]);
        let slots = self.slots();
        let mut done = 0;
        let mut jumped = state.jumped.iter().map(|number| *number as usize).peekable();
        for (swarm, turns) in self.swarms.iter_mut().zip(state.turns.chunks_exact(3)) {
            swarm.turns.copy_from_slice(turns);
            let first = swarm.pieces.start * slots;
            let count = swarm.plan.count as usize;
            for (own, all) in self.at.iter_mut().zip(&state.at) {
                let (own, all) = (&mut own[first..], &all[done..]);
                each_group(count, [self.members, self.groups], |numbers, slot| {
                    let own = own[slot..].iter_mut().step_by(self.groups);
                    own.zip(&all[numbers]).for_each(|(own, all)| *own = *all);
                });
            }
            while let Some(number) = jumped.next_if(|number| (done..done + count).contains(number)) {
                let (chunk, word, bit) =
                    mark(first + slot_of(number - done, self.members, self.groups), slots);
                self.jumped[chunk][word] |= bit;
            }
            done += count;
        }
        Ok(())
    }
}

/// Calls `each` for each group of so many particles, in the order of their numbers, with these and the slot
/// (of their box) of the first: what [`slot_of`] says of one. The slots of the others follow `groups` apart.
fn each_group(count: usize, [members, groups]: [usize; 2], mut each: impl FnMut(Range<usize>, usize)) {
    for (at, first) in (0..count).step_by(members).enumerate() {
        let slot = at / groups * (members * groups) + at % groups;
        each(first..count.min(first + members), slot);
    }
}

/// Where it is marked that a slot jumped: chunk, word, bit. `slots`: of a chunk.
fn mark(slot: usize, slots: usize) -> (usize, usize, u64) {
    (slot / slots, slot % slots / 64, 1 << (slot % slots % 64))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_particles_have_the_slots_that_each_has() {
        for (count, members, groups) in
            [(0, 4, 8), (1, 4, 8), (31, 4, 8), (100, 4, 8), (64, 1, 16), (50, 3, 5)]
        {
            let mut seen = Vec::new();
            each_group(count, [members, groups], |numbers, slot| {
                seen.extend(numbers.zip((slot..).step_by(groups)));
            });
            let expected: Vec<_> = (0..count).map(|i| (i, slot_of(i, members, groups))).collect();
            assert_eq!(seen, expected, "{count} in {groups} groups of {members}");
        }
    }
}
