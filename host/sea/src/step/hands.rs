//! What comes from outside: hands in the window, a journal that is replayed, and what is written down of
//! both.

use std::{collections::VecDeque, path::Path};

use reef_abi as abi;
use reef_files::WriteError;
use reef_streams::frame::CameraPose;

use super::{
    journal::{CameraInput, Entry, Input, Journal, ParamInput},
    kept::Kept,
    member::param_event,
    water::{ActivePoke, MOST_POKES, POKE_TIME, Poke},
    world::World,
};

/// A journal's file hears of every step that takes inputs, and of each such step.
const JOURNAL_STEPS: u64 = 60;

/// Inputs: those that wait, those that will come again, and those that still act.
#[derive(Debug)]
pub(crate) struct Hands {
    /// For the next step.
    pub(crate) pending: Vec<Input>,
    /// Of a journal, each for its step.
    pub(crate) replay: VecDeque<Entry>,
    /// What is replayed is this run's own: whatever else comes takes its place.
    pub(crate) relived: bool,
    /// All that came.
    pub(crate) journal: Journal,
    /// The journal's file.
    kept: Option<Kept>,
    /// Touches that still move the water.
    pub(crate) pokes: Vec<ActivePoke>,
    /// In place of the scene's camera.
    pub(crate) camera: Option<CameraInput>,
}

impl Hands {
    /// Nobody's yet, with an empty journal.
    pub(crate) fn new(journal: Journal) -> Self {
        Self {
            pending: Vec::new(),
            replay: VecDeque::new(),
            relived: false,
            journal,
            kept: None,
            pokes: Vec::new(),
            camera: None,
        }
    }

    /// Lets go of the water and the camera.
    pub(crate) fn let_go(&mut self) {
        self.pokes.clear();
        self.camera = None;
    }
}

impl World {
    /// Value of a module's parameter in the next step.
    pub fn param(&self, module: usize, id: u32) -> Option<f64> {
        let member = self.members.get(module)?;
        let waiting = self.hands.pending.iter().rev().find_map(|input| match input {
            Input::Param(param) if param.id == id && param.module == member.name => Some(param.value),
            _ => None,
        });
        waiting.or_else(|| member.instance.param(id).ok())
    }

    /// Changes a parameter with the next step. False: there is no such parameter, or the value is outside of
    /// its range.
    pub fn set_param(&mut self, module: usize, id: u32, value: f64) -> bool {
        let Some(member) = self.members.get(module) else { return false };
        let Some(param) = member.instance.info().params.iter().find(|param| param.id == id) else {
            return false;
        };
        if !(param.minimum..=param.maximum).contains(&value) {
            return false;
        }
        let input = ParamInput { module: member.name.clone(), key: param.key.clone(), id, value };
        // A slider that is dragged says much in one step; only the last word counts.
        let same = |input: &Input| matches!(input, Input::Param(p) if p.id == id && p.module == member.name);
        self.hands.pending.retain(|input| !same(input));
        self.hands.pending.push(Input::Param(input));
        true
    }

    /// Touches the water with the next step. False: the numbers make no sense.
    pub fn poke(&mut self, poke: Poke) -> bool {
        let sound = poke.is_sound();
        if sound {
            self.hands.pending.push(Input::Poke(poke));
        }
        sound
    }

    /// What the modules take for the camera from the next step on; None: the scene's own. Written down only
    /// when it changes.
    pub fn set_camera(&mut self, pose: Option<CameraPose>) {
        let camera = pose.map(CameraInput::from);
        if camera.is_some_and(|camera| camera.pose().is_none()) {
            return;
        }
        let waiting = self.hands.pending.iter().rev().find_map(|input| match input {
            Input::Camera(camera) => Some(*camera),
            _ => None,
        });
        if waiting.unwrap_or(self.hands.camera) != camera {
            self.hands.pending.retain(|input| !matches!(input, Input::Camera(_)));
            self.hands.pending.push(Input::Camera(camera));
        }
    }

    /// All that came from outside so far.
    pub fn journal(&self) -> &Journal {
        &self.hands.journal
    }

    /// Keeps the journal in a file from now on.
    pub fn write_journal_to(&mut self, path: &Path) -> Result<(), WriteError> {
        self.hands.kept = Some(Kept::begin(path, &self.hands.journal)?);
        Ok(())
    }

    /// Writes the journal's file at the end of the run; what comes after that is not written down.
    pub fn flush_journal(&mut self) -> Result<(), WriteError> {
        self.hands.kept.take().map_or(Ok(()), |kept| kept.finish(&self.hands.journal))
    }

    /// Writes down that a step was made; its inputs are in the journal already.
    pub(super) fn write_down(&mut self) {
        let Hands { journal, kept, .. } = &mut self.hands;
        journal.end = self.clock.step;
        if let Some(file) = kept
            && (file.lacks_inputs(journal) || self.clock.step.is_multiple_of(JOURNAL_STEPS))
            && let Err(error) = file.update(journal)
        {
            *kept = None;
            self.tell("", error.to_string());
        }
    }

    /// Feeds a journal's inputs again, each in its step. `Err`: it belongs to another run.
    pub fn replay(&mut self, journal: Journal) -> Result<(), String> {
        let header = &journal.header;
        let differs = |what: &str, there: String, here: String| {
            Err(format!("the journal is of {what} {there}, this run is of {what} {here}"))
        };
        if header.scene != self.setting.scene.name {
            return differs(
                "the scene",
                format!("{:?}", header.scene),
                format!("{:?}", self.setting.scene.name),
            );
        }
        if header.seed != self.setting.seed {
            return differs("the seed", header.seed.to_string(), self.setting.seed.to_string());
        }
        if header.dt != self.clock.dt {
            return differs("the step", format!("{} s", header.dt), format!("{} s", self.clock.dt));
        }
        if header.from_step > self.clock.step {
            return Err(format!(
                "the journal begins at step {}, this run is at step {}",
                header.from_step, self.clock.step
            ));
        }
        for entry in &journal.entries {
            if let Input::Param(param) = &entry.input
                && !self.members.iter().any(|member| member.name == param.module)
            {
                return Err(format!(
                    "the journal names the module {:?}, which this scene has not",
                    param.module
                ));
            }
        }
        let now = self.clock.step;
        self.hands.replay = journal.entries.into_iter().filter(|entry| entry.step > now).collect();
        self.hands.relived = false;
        self.history.forget_from(now + 1);
        Ok(())
    }

    /// Something from outside, for the next step.
    pub(crate) fn ask(&mut self, input: Input) {
        self.hands.pending.push(input);
    }

    pub(super) fn take_inputs(&mut self) {
        for member in &mut self.members {
            member.events.clear();
            member.events.append(&mut member.missed);
        }
        let step = self.clock.step;
        let dt = self.clock.dt;
        self.hands.pokes.retain(|active| step.saturating_sub(active.step) as f64 * dt < POKE_TIME);
        if !self.hands.pending.is_empty() {
            self.turn(self.clock.step);
        }
        while self.hands.replay.front().is_some_and(|entry| entry.step <= step) {
            if let Some(entry) = self.hands.replay.pop_front() {
                self.take(entry.input);
            }
        }
        for input in std::mem::take(&mut self.hands.pending) {
            self.take(input);
        }
    }

    fn take(&mut self, input: Input) {
        let step = self.clock.step;
        match &input {
            Input::Param(param) => {
                for member in self.members.iter_mut().filter(|member| member.name == param.module) {
                    member.events.push(param_event(param.id, param.value));
                }
            }
            Input::Poke(poke) => {
                for (member, tag) in self.members.iter_mut().zip(&**self.exchange.tags()) {
                    member.events.push(abi::Event {
                        kind: abi::EVENT_POKE,
                        object: tag.own(poke.object),
                        value: poke.speed,
                        point: poke.point,
                        ..abi::Event::default()
                    });
                }
                if self.hands.pokes.len() < MOST_POKES {
                    self.hands.pokes.push(ActivePoke { step, poke: *poke });
                }
            }
            Input::Camera(camera) => self.hands.camera = *camera,
        }
        self.hands.journal.entries.push(Entry { step, input });
    }
}
