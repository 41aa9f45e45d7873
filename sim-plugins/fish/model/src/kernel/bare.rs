//! The least that implicit sub-steps can cost: eight fish over hot data, and nothing else — no gathering, no
//! origins that follow, no behaviour. What everything else is measured against.

use reef_flow::Level;

use super::{Fish8, Pace, Pack, Plan};
use crate::{lanes::Lane, material::Method};

/// Eight fish that swim side by side.
#[derive(Clone, Debug)]
pub struct Bare {
    plan: Plan,
    pack: Pack,
    fish: Fish8,
}

/// Sub-steps of one [`Bare::step`], and their length [s].
const SUBSTEPS: u32 = 4;
const DT: f32 = 1.0 / 240.0;
/// Of their muscles, to the left and upward.
const BIAS: f32 = 0.03;

impl Bare {
    /// Eight fish of a species at rest.
    pub fn new(plan: Plan) -> Self {
        let mut pack = Pack::default();
        pack.fit(&plan);
        for (into, rest) in pack.positions.iter_mut().zip(&plan.rest) {
            *into = rest.map(Lane::all);
        }
        // Each at its own place of a beat, and turning: what would die away in a fish that swims straight on
        // becomes numbers that are too small for processors to be fast with.
        let fish = Fish8 {
            phase: Lane(core::array::from_fn(|lane| lane as f32 / 8.0)),
            speed: Lane::all(2.0),
            force: Lane::all(0.2),
            yaw: Lane::all(BIAS),
            pitch: Lane::all(BIAS),
            ..Fish8::default()
        };
        Self { plan, pack, fish }
    }

    /// Springs times sub-steps that one [`Bare::step`] computes.
    pub fn spring_substeps(&self) -> usize {
        8 * SUBSTEPS as usize * self.plan.springs.len()
    }

    /// One step.
    pub fn step(&mut self, level: Level, method: Method) {
        self.pack.step(level, &self.plan, &mut self.fish, Pace { dt: DT, count: SUBSTEPS, method });
    }
}
