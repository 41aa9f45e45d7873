//! States of the whole sea in its past, from which it is brought to any moment by loading one and making the
//! steps that follow it. They are kept in this program's memory without envelopes or hashes; near ones are
//! dense, those further back thinner, the further the thinner. On the last steps of a jump's way a few more
//! are kept for a while: whoever drags the sea's time to and fro comes there again.

use std::{collections::VecDeque, time::Instant};

use reef_plugin::{Health, Loading, Payload, PluginError, load_together};

use super::{
    exchange::{Listed, Said},
    journal::{CameraInput, Entry},
    water::ActivePoke,
    world::World,
};

/// Steps between two states, where memory and time allow.
pub const EVERY: u64 = 8;
/// Time that remembering may take, in the mean of all steps [s]: where a state takes longer to save, states
/// are farther from each other. What a jump ends with does not depend on where it begins.
const COST: f64 = 1e-4;
/// Farthest that they are from each other for that.
const FARTHEST: u64 = 60;
/// Steps for which states are dense: a minute at the usual step.
const DENSE: u64 = 3600;
/// How much farther states just beyond that may be from each other.
const THINNER: u64 = 16;

/// Steps between two states on a jump's way, and how many of these are kept at most: the oldest of them make
/// room for the next.
const WALKED: u64 = 6;
const MOST_WALKED: usize = 6;

/// The sea after a step.
#[derive(Debug)]
struct Past {
    step: u64,
    pokes: Vec<ActivePoke>,
    camera: Option<CameraInput>,
    /// What the modules said in it.
    said: Vec<Said>,
    states: Vec<Payload>,
    /// All of it [bytes].
    size: usize,
}

/// What is remembered, for people.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Memory {
    /// States.
    pub states: usize,
    /// The first step that need not be reached from the start.
    pub from: Option<u64>,
    /// The last step that was reached, and can be again without anything new.
    pub to: u64,
    /// What the states take [bytes].
    pub used: usize,
    /// What they may take at most [bytes].
    pub most: usize,
}

/// The states, in the order of their steps.
#[derive(Debug, Default)]
pub(crate) struct History {
    most: usize,
    past: Vec<Past>,
    used: usize,
    /// The goal of the last jump, and the steps of the states that are kept because of such ways, the oldest
    /// first.
    goal: u64,
    walked: VecDeque<u64>,
    /// Time that one state has taken, about [s].
    cost: f64,
    /// Size of the last one [bytes].
    size: usize,
    /// The step of the last state that was added: where none has room, it is not tried in each step.
    tried: Option<u64>,
    /// Memory of states that were forgotten.
    spare: Vec<Vec<u8>>,
    /// The last step that was reached since the past was another one.
    reached: u64,
    /// What is kept does not follow from the start: the sea was loaded, or edited, or its modules are of
    /// newer builds.
    grafted: bool,
}

impl History {
    pub(crate) fn new(most: usize) -> Self {
        Self { most, ..Self::default() }
    }

    /// The last state before a step.
    fn before(&self, step: u64) -> Option<&Past> {
        self.past[..self.past.partition_point(|past| past.step < step)].last()
    }

    /// Forgets what was at this step and after it.
    pub(crate) fn forget_from(&mut self, step: u64) {
        let kept = self.past.partition_point(|past| past.step < step);
        self.past.truncate(kept);
        self.walked.retain(|walked| *walked < step);
        self.used = self.past.iter().map(|past| past.size).sum();
        self.reached = self.reached.min(step.saturating_sub(1));
    }

    /// Forgets all, and what was tried: the sea begins at its start.
    pub(crate) fn begin_anew(&mut self) {
        self.forget_from(0);
        self.goal = 0;
        self.tried = None;
        self.grafted = false;
    }

    /// Whatever comes does not follow from the start.
    pub(crate) fn graft(&mut self) {
        self.begin_anew();
        self.grafted = true;
    }

    /// The sea is at its start.
    pub(crate) fn root(&mut self) {
        if self.grafted {
            self.begin_anew();
        }
    }

    /// Whether the state after this step is wanted.
    fn wants(&self, step: u64) -> bool {
        self.is_apart(step, self.every()) || self.walks(step)
    }

    /// Whether it is wanted because it is on a jump's way, near the goal.
    fn walks(&self, step: u64) -> bool {
        let last = WALKED * MOST_WALKED as u64;
        step < self.goal && self.goal - step <= last && self.is_apart(step, WALKED)
    }

    /// Whether all states are so many steps away from this one.
    fn is_apart(&self, step: u64, every: u64) -> bool {
        let next = self.past.partition_point(|past| past.step < step);
        let is_far = |tried: u64| !self.past.is_empty() || step.abs_diff(tried) >= every;
        self.most > 0
            && self.tried.is_none_or(is_far)
            && self.past.get(next).is_none_or(|next| next.step - step >= every)
            && next.checked_sub(1).is_none_or(|last| step - self.past[last].step >= every)
    }

    /// How far states are from each other now: as many as the memory holds, and time allows, in the minute in
    /// which they are dense.
    fn every(&self) -> u64 {
        let for_time = (self.cost / COST).ceil() as u64;
        let for_room = (DENSE * self.size as u64).div_ceil(self.most.max(1) as u64);
        for_time.max(for_room).clamp(EVERY, FARTHEST)
    }

    /// One more state has taken this long [s].
    fn took(&mut self, seconds: f64) {
        // A machine that was interrupted once is not slow.
        self.cost += (seconds - self.cost) / 8.0;
    }

    fn add(&mut self, past: Past) {
        if !self.is_apart(past.step, self.every()) {
            self.walked.push_back(past.step);
        }
        self.tried = Some(past.step);
        self.size = past.size;
        self.used += past.size;
        self.past.insert(self.past.partition_point(|other| other.step < past.step), past);
        if self.walked.len() > MOST_WALKED
            && let Some(oldest) = self.oldest_walked()
        {
            self.remove(oldest);
        }
        while self.used > self.most
            && let Some(at) = self.dispensable().or_else(|| self.oldest_walked())
        {
            self.remove(at);
        }
    }

    fn remove(&mut self, at: usize) {
        let Past { step, states, size, .. } = self.past.remove(at);
        self.used -= size;
        self.walked.retain(|walked| *walked != step);
        self.spare = states.into_iter().map(Payload::into_memory).collect();
    }

    /// Where the oldest state is that is kept because of a jump's way.
    fn oldest_walked(&self) -> Option<usize> {
        let step = self.walked.front()?;
        self.past.binary_search_by_key(step, |past| past.step).ok()
    }

    /// The state that is missed least: the gap that it leaves is the least of those that its age allows. None
    /// of those that are kept because of a jump's way.
    fn dispensable(&self) -> Option<usize> {
        let newest = self.past.last()?.step;
        let gap = |at: usize| {
            let before = at.checked_sub(1).map_or(0, |before| self.past[before].step);
            let after = self.past.get(at + 1).map_or(newest, |after| after.step);
            let age = newest - self.past[at].step;
            // In units of the gap that is allowed at this age, as a fraction of whole numbers.
            let allowed = if age <= DENSE { 1.0 } else { (THINNER * age) as f64 / DENSE as f64 };
            (after - before) as f64 / allowed
        };
        // The newest is the way back from a jump.
        let all = 0..self.past.len().saturating_sub(1).max(1);
        let all = all.filter(|at| !self.walked.contains(&self.past[*at].step));
        all.min_by(|a, b| gap(*a).total_cmp(&gap(*b)))
    }
}

impl World {
    /// What is remembered.
    pub fn memory(&self) -> Memory {
        let History { most, past, used, reached, .. } = &self.history;
        let from = past.first().map(|past| past.step + 1);
        Memory { states: past.len(), from, to: *reached.max(&self.clock.step), used: *used, most: *most }
    }

    /// Brings the sea to the last state before `step` that is remembered, or to its start, or leaves it where
    /// it is when that is nearer: the steps to `step` itself are then to be made ([`World::step_to`]); the
    /// frame is that of before until the first of them. Nothing is lost: what came from outside comes again,
    /// each in its step, until something else comes.
    ///
    /// # Errors
    /// A module that stands still; then nothing has changed. Or one that does not take its state back; then
    /// the sea is at its start.
    pub fn go_to(&mut self, step: u64) -> Result<(), PluginError> {
        let now = self.clock.step;
        let nearest = self.history.before(step).map_or(0, |past| past.step);
        if now == step || now < step && nearest <= now {
            self.history.goal = step;
            return Ok(());
        }
        if let Some(member) = self.members.iter().find(|m| *m.instance.health() != Health::Running) {
            let message = "it stands still, so the sea cannot go to another time".to_owned();
            return Err(PluginError::State { plugin: member.name.clone(), message });
        }
        self.settle_pending();
        let taken = self.take_back(step);
        if !matches!(taken, Ok(true)) {
            self.history.root();
            self.begin_again();
        }
        let from = self.clock.step;
        // A way forward leaves what came on it behind, too.
        let mut entries = std::mem::take(&mut self.hands.journal.entries);
        entries.extend(self.hands.replay.drain(..));
        self.hands.replay.extend(entries.drain(entries.partition_point(|entry| entry.step <= from)..));
        self.hands.journal.entries = entries;
        self.hands.relived = true;
        self.hands.journal.header.from_step = self.hands.journal.header.from_step.min(from);
        self.hands.journal.end = from;
        self.faults.clear();
        self.history.goal = step;
        taken.map(|_| ())
    }

    /// Makes the steps from here to one that lies ahead; all but that one unseen.
    pub fn step_to(&mut self, step: u64) {
        while self.clock.step < step {
            self.step_toward(step);
        }
    }

    /// One step of the way to one that lies ahead.
    pub fn step_toward(&mut self, step: u64) {
        if self.clock.step + 1 < step {
            self.step_unseen();
        } else {
            self.step();
        }
    }

    /// What waits for the next step belongs to the present, and ends the future that is known.
    fn settle_pending(&mut self) {
        if self.hands.pending.is_empty() {
            return;
        }
        let step = self.clock.step + 1;
        self.turn(step);
        let waiting = std::mem::take(&mut self.hands.pending).into_iter();
        self.hands.replay.extend(waiting.map(|input| Entry { step, input }));
    }

    /// Loads the last state before a step; false: there is none.
    fn take_back(&mut self, step: u64) -> Result<bool, PluginError> {
        let Some(past) = self.history.before(step) else { return Ok(false) };
        let members = self.members.iter_mut().zip(&past.states).enumerate();
        let mut loadings: Vec<Loading<'_>> = members
            .map(|(at, (member, state))| {
                member.begin_anew();
                Loading::new(at, &mut member.instance, state)
            })
            .collect();
        load_together(&mut loadings);
        loadings.into_iter().try_for_each(|loading| loading.loaded)?;
        self.clock.step = past.step;
        self.hands.pokes.clone_from(&past.pokes);
        self.hands.camera = past.camera;
        self.exchange.said.clone_from(&past.said);
        self.forget_inputs();
        Ok(true)
    }

    /// Something new comes with this step: what came in it and later, in this run's own future, is no more.
    pub(crate) fn turn(&mut self, step: u64) {
        if std::mem::take(&mut self.hands.relived) {
            self.hands.replay.clear();
        }
        self.history.forget_from(step);
    }

    /// Keeps the present state, if it is wanted.
    pub(crate) fn remember(&mut self) {
        let step = self.clock.step;
        self.history.reached = self.history.reached.max(step);
        let running = |member: &super::member::Member| member.is_savable() && !member.standing;
        if !self.history.wants(step) || !self.members.iter().all(running) {
            return;
        }
        let began = Instant::now();
        let mut spare = std::mem::take(&mut self.history.spare).into_iter();
        let saved = self.save_payloads(|| spare.next().unwrap_or_default());
        let mut states = Vec::with_capacity(saved.len());
        for (at, saved) in saved.into_iter().enumerate() {
            match saved {
                Ok(state) => states.push(state),
                Err(error) => return self.note_unsaved(at, &error),
            }
        }
        let said: Vec<Said> = self.exchange.said.iter().map(kept).collect();
        let heard = said.iter().map(|said| {
            size_of_val(&*said.flows)
                + size_of_val(&*said.actors)
                + said.objects.len() * size_of::<(u64, [f64; 3])>()
        });
        let size = heard.sum::<usize>()
            + states.iter().map(Payload::size).sum::<usize>()
            + size_of_val(&*self.hands.pokes)
            + size_of::<Past>();
        let (pokes, camera) = (self.hands.pokes.clone(), self.hands.camera);
        self.history.add(Past { step, pokes, camera, said, states, size });
        self.history.took(began.elapsed().as_secs_f64());
    }
}

/// What a module said, without a hold on the memory of its outputs.
fn kept(said: &Said) -> Said {
    let objects = Listed::Loaded(said.objects.iter().collect());
    Said { flows: said.flows.clone(), actors: said.actors.clone(), objects }
}

#[cfg(test)]
mod tests {
    use reef_abi as abi;

    use super::*;

    fn history(most: usize) -> History {
        History::new(most)
    }

    fn walk(history: &mut History, steps: std::ops::RangeInclusive<u64>) {
        for step in steps {
            history.reached = history.reached.max(step);
            if history.wants(step) {
                let (pokes, camera, said, states) = (Vec::new(), None, Vec::new(), Vec::new());
                history.add(Past { step, pokes, camera, said, states, size: 1000 });
            }
        }
    }

    #[test]
    fn states_stay_within_their_memory_dense_in_the_last_minute() {
        let mut history = history(120_000);
        for end in [3600, 36_000, 216_000] {
            let next = history.reached + 1;
            walk(&mut history, next..=end);
            assert!(history.used <= 120_000 && history.used == 1000 * history.past.len());
            let farthest = |from: u64, to: u64| {
                let steps = history.past.iter().map(|past| past.step).filter(|s| (from..=to).contains(s));
                let steps: Vec<u64> = steps.collect();
                steps.windows(2).map(|pair| pair[1] - pair[0]).max().unwrap_or(u64::MAX)
            };
            let near = farthest(end.saturating_sub(3600), end);
            // Half of the memory may be of what is older.
            assert!(near <= 2 * history.every(), "{end}: {near}");
            // Further back a gap is a share of the age.
            let far = farthest(0, end.saturating_sub(3600));
            assert!(end == 3600 || far < end / 4, "{end}: {far}");
        }
    }

    #[test]
    fn a_step_is_reached_from_the_last_state_before_it() {
        let mut history = history(usize::MAX);
        walk(&mut history, 1..=100);
        let from = |step: u64| history.before(step).map(|past| past.step);
        assert_eq!([1, 2, 17, 18, 100].map(from), [None, Some(1), Some(9), Some(17), Some(97)]);
    }

    #[test]
    fn the_end_of_a_way_is_dense_until_other_ways_are_walked() {
        let mut history = history(100_000);
        walk(&mut history, 1..=1000);
        let from = |history: &History, step: u64| history.before(step).map_or(0, |past| past.step);
        // The longest way that a jump can need.
        let gap = history.every();
        let farthest = |history: &mut History, goal: u64| {
            history.goal = goal;
            let begin = from(history, goal) + 1;
            walk(history, begin..=goal);
            (begin..=goal).map(|step| step - from(history, step)).max()
        };
        let goal = from(&history, 700) + gap;
        assert_eq!(farthest(&mut history, goal), Some(WALKED));
        assert!(history.used <= history.most && history.walked.len() <= MOST_WALKED);
        for goal in [300, 500, 900].map(|near| from(&history, near) + gap) {
            assert_eq!(farthest(&mut history, goal), Some(WALKED));
            assert!(history.used <= history.most && history.walked.len() <= MOST_WALKED);
        }
        // The first one's states have made room; what playing keeps is there.
        let gaps = history.past.windows(2).map(|pair| pair[1].step - pair[0].step);
        assert_eq!(gaps.clone().max(), Some(gap));
        assert_eq!(gaps.filter(|it| *it < gap).count(), 2 + MOST_WALKED);
        history.forget_from(1);
        assert!(history.walked.is_empty());
    }

    #[test]
    fn a_state_is_kept_once_and_what_comes_after_a_turn_is_forgotten() {
        let mut history = history(usize::MAX);
        walk(&mut history, 1..=100);
        let count = history.past.len();
        walk(&mut history, 20..=100);
        assert_eq!(history.past.len(), count);
        history.forget_from(49);
        assert_eq!((history.past.last().map(|past| past.step), history.reached), (Some(41), 48));
        assert_eq!(history.used, 1000 * history.past.len());
    }

    #[test]
    fn states_that_take_long_are_farther_from_each_other() {
        for (seconds, gap) in [(1e-4, EVERY), (4e-3, 40), (1.0, FARTHEST)] {
            let mut history = history(usize::MAX);
            (0..60).for_each(|_| history.took(seconds));
            walk(&mut history, 1..=2000);
            assert!(history.past.windows(2).all(|pair| pair[1].step - pair[0].step == gap), "{seconds} s");
        }
    }

    #[test]
    fn states_are_as_dense_as_the_memory_holds_of_them_in_a_minute() {
        for (states, gap) in [(1000, EVERY), (100, 36), (10, FARTHEST)] {
            let mut history = history(1000 * states);
            walk(&mut history, 1..=500);
            let gaps = history.past.windows(2).map(|pair| pair[1].step - pair[0].step);
            // The size of a state is known with the first.
            assert!(gaps.clone().count() >= 8 && gaps.clone().all(|it| it == gap), "{states} states");
        }
    }

    #[test]
    fn without_memory_nothing_is_kept() {
        let mut history = history(0);
        walk(&mut history, 1..=100);
        assert!(history.past.is_empty());
    }

    #[test]
    fn a_state_that_has_no_room_is_not_tried_in_each_step() {
        let mut history = history(500);
        let mut tried = 0;
        for step in 1..=160 {
            tried += u64::from(history.wants(step));
            walk(&mut history, step..=step);
        }
        assert_eq!((tried, history.past.len(), history.used), (160_u64.div_ceil(history.every()), 0, 0));
        // Another past is another try.
        assert!(!history.wants(160));
        history.graft();
        assert!(history.wants(160));
    }

    #[test]
    fn what_was_said_is_kept_without_its_outputs() {
        let outputs = std::sync::Arc::new(reef_streams::Outputs {
            objects: vec![abi::Object { id: 7, origin: [1.0, 2.0, 3.0], ..Default::default() }],
            ..Default::default()
        });
        let said = Said { objects: Listed::Emitted(outputs.clone()), ..Said::default() };
        let kept = kept(&said);
        drop(said);
        assert_eq!(std::sync::Arc::strong_count(&outputs), 1);
        assert_eq!(kept.objects.iter().collect::<Vec<_>>(), [(7, [1.0, 2.0, 3.0])]);
    }
}
