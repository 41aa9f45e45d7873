//! The last steps as the modules saw them, and each module's last saved state: what another instance of a
//! module needs to be brought to the present — of a newer build, or of an older one after a fault — while the
//! rest of the sea goes on.
//!
//! States are saved every so many steps, one module a step; steps are remembered from the oldest of these
//! states on.

use std::{collections::VecDeque, sync::Arc};

use reef_abi as abi;
use reef_plugin::StepInput;

use super::{exchange::Exchange, ground::Ground};

/// A state is saved early where the steps since the last one would take more memory than this [bytes].
const MOST_BYTES: usize = 64 << 20;
/// Steps that a module may stand still before what it missed is forgotten.
const MOST_MISSED: usize = 600;

/// What does not change from step to step.
#[derive(Debug)]
pub(crate) struct Fixed {
    pub(crate) seed: u64,
    pub(crate) simd_level: u32,
    pub(crate) water: abi::Water,
    pub(crate) ground: Arc<Ground>,
}

/// All that one step let the modules read.
#[derive(Debug, Default)]
pub(crate) struct Moment {
    pub(crate) step: u64,
    pub(crate) time: f64,
    pub(crate) dt: f64,
    pub(crate) flags: u32,
    pub(crate) camera: abi::Camera,
    waves: Vec<abi::Wave>,
    obstacles: Vec<abi::Obstacle>,
    flow: Vec<abi::Flow>,
    actors: Vec<abi::Actor>,
    heard: Vec<Heard>,
}

/// What one module alone got. Flow and actors are empty where it heard the same as all.
#[derive(Debug, Default)]
struct Heard {
    flow: Vec<abi::Flow>,
    actors: Vec<abi::Actor>,
    events: Vec<abi::Event>,
}

impl Moment {
    /// Remembers the present step's lists.
    pub(crate) fn remember<'a>(
        &mut self,
        exchange: &Exchange,
        waves: &[abi::Wave],
        obstacles: &[abi::Obstacle],
        events: impl Iterator<Item = &'a [abi::Event]>,
    ) {
        renew(&mut self.waves, waves);
        renew(&mut self.obstacles, obstacles);
        renew(&mut self.flow, exchange.common_flow());
        renew(&mut self.actors, exchange.common_actors());
        let mut count = 0;
        for (at, events) in events.enumerate() {
            if self.heard.len() == at {
                self.heard.push(Heard::default());
            }
            let heard = &mut self.heard[at];
            renew(&mut heard.flow, exchange.own_flow(at));
            renew(&mut heard.actors, exchange.own_actors(at));
            renew(&mut heard.events, events);
            count = at + 1;
        }
        self.heard.truncate(count);
    }

    /// The step as a module saw it, and what came from outside for it.
    pub(crate) fn input<'a>(&'a self, module: usize, fixed: &'a Fixed) -> (StepInput<'a>, &'a [abi::Event]) {
        let heard = self.heard.get(module);
        let flow = heard.map(|heard| heard.flow.as_slice()).filter(|flow| !flow.is_empty());
        let actors = heard.map(|heard| heard.actors.as_slice()).filter(|actors| !actors.is_empty());
        let input = StepInput {
            flags: self.flags,
            step: self.step,
            time: self.time,
            dt: self.dt,
            seed: fixed.seed,
            simd_level: fixed.simd_level,
            camera: &self.camera,
            water: &fixed.water,
            heightfield: fixed.ground.heightfield(),
            flow: flow.unwrap_or(&self.flow),
            waves: &self.waves,
            actors: actors.unwrap_or(&self.actors),
            obstacles: &self.obstacles,
        };
        (input, heard.map_or(&[], |heard| heard.events.as_slice()))
    }

    fn bytes(&self) -> usize {
        let heard = self.heard.iter();
        let heard = heard.map(|heard| size_of_val(&*heard.flow) + size_of_val(&*heard.actors));
        size_of_val(&*self.flow) + size_of_val(&*self.actors) + heard.sum::<usize>()
    }
}

fn renew<T: Copy>(list: &mut Vec<T>, from: &[T]) {
    list.clear();
    list.extend_from_slice(from);
}

/// A module's state after a step, in its envelope.
#[derive(Clone, Debug)]
pub(crate) struct Snap {
    pub(crate) step: u64,
    pub(crate) state: Arc<Vec<u8>>,
}

/// What is kept of a module that failed.
#[derive(Clone, Debug)]
pub(crate) struct Frozen {
    /// Its last state that was saved; None: it never was.
    pub(crate) snap: Option<Snap>,
    /// The steps since, the one in which it failed among them, and what it missed.
    pub(crate) moments: Vec<Arc<Moment>>,
    /// The step in which it failed.
    pub(crate) failed_in: u64,
    /// It has missed more than is remembered.
    pub(crate) stale: bool,
}

/// Somebody who wants to hear of every step.
pub(crate) trait Follower: std::fmt::Debug + Send + Sync {
    /// One more step was made. False: it wants to hear of no more.
    fn feed(&self, moment: &Arc<Moment>) -> bool;
    /// The sea is somewhere else now, and there is nothing left to follow.
    fn lose(&self);
}

/// The recent past of a sea.
#[derive(Debug)]
pub(crate) struct Recent {
    /// Steps between two states of a module.
    every: u64,
    pub(crate) fixed: Arc<Fixed>,
    /// The last step of all, whatever its length.
    pub(crate) now: Arc<Moment>,
    moments: VecDeque<Arc<Moment>>,
    spare: Vec<Arc<Moment>>,
    pub(crate) snaps: Vec<Option<Snap>>,
    pub(crate) frozen: Vec<Option<Frozen>>,
    /// Those that want to hear of every step.
    pub(crate) followers: Vec<Arc<dyn Follower>>,
}

impl Recent {
    pub(crate) fn new(every: u64, modules: usize, fixed: Fixed) -> Self {
        Self {
            every: every.max(1),
            fixed: Arc::new(fixed),
            now: Arc::default(),
            moments: VecDeque::new(),
            spare: Vec::new(),
            snaps: vec![None; modules],
            frozen: vec![None; modules],
            followers: Vec::new(),
        }
    }

    /// Steps between two saved states of a module.
    pub(crate) fn every(&self) -> u64 {
        self.every
    }

    /// The sea is somewhere else now: nothing of the past counts, and nobody is to be brought to it.
    pub(crate) fn forget(&mut self) {
        self.moments.clear();
        self.snaps.fill(None);
        self.frozen.fill(None);
        for follower in self.followers.drain(..) {
            follower.lose();
        }
    }

    /// A moment to fill, of memory that is used again where nobody holds it.
    pub(crate) fn begin(&mut self) -> Arc<Moment> {
        let free = self.spare.iter_mut().position(|moment| Arc::get_mut(moment).is_some());
        free.map(|at| self.spare.swap_remove(at)).unwrap_or_default()
    }

    /// A step was made, and this is what it let the modules read.
    pub(crate) fn add(&mut self, moment: Arc<Moment>) {
        self.now = moment.clone();
        if moment.dt == 0.0 {
            return;
        }
        for frozen in self.frozen.iter_mut().flatten() {
            if frozen.moments.len() < MOST_MISSED {
                frozen.moments.push(moment.clone());
            } else {
                frozen.stale = true;
            }
        }
        self.followers.retain(|follower| follower.feed(&moment));
        self.moments.push_back(moment);
        let needed = self.snaps.iter().flatten().map(|snap| snap.step).min().unwrap_or(u64::MAX);
        while self.moments.front().is_some_and(|oldest| oldest.step <= needed) {
            let Some(oldest) = self.moments.pop_front() else { break };
            if self.spare.len() as u64 <= self.every {
                self.spare.push(oldest);
            }
        }
    }

    /// The steps after this one.
    pub(crate) fn since(&self, step: u64) -> Vec<Arc<Moment>> {
        self.moments.iter().filter(|moment| moment.step > step).cloned().collect()
    }

    /// A module failed in this step.
    pub(crate) fn freeze(&mut self, module: usize, step: u64) {
        let snap = self.snaps[module].take();
        if snap.is_none() && self.frozen[module].is_some() {
            return; // It was helped a moment ago, and nothing was saved since.
        }
        let moments = snap.as_ref().map_or(Vec::new(), |snap| self.since(snap.step));
        self.frozen[module] = Some(Frozen { snap, moments, failed_in: step, stale: false });
    }

    /// Whose state is to be saved after this step: the oldest of those that are due.
    pub(crate) fn due(&self, step: u64, running: impl Fn(usize) -> bool) -> Option<usize> {
        let bytes: usize = self.moments.iter().map(|moment| moment.bytes()).sum();
        let every = if bytes > MOST_BYTES { 1 } else { self.every };
        let age = |module: &usize| self.snaps[*module].as_ref().map_or(u64::MAX, |snap| step - snap.step);
        let oldest = (0..self.snaps.len()).filter(|module| running(*module)).max_by_key(age)?;
        (age(&oldest) >= every).then_some(oldest)
    }

    /// A module's state was saved after this step.
    pub(crate) fn saved(&mut self, module: usize, step: u64, state: Vec<u8>) {
        self.snaps[module] = Some(Snap { step, state: Arc::new(state) });
        self.frozen[module] = None;
    }
}
