//! The sea: steps all modules of a scene, the same for the same scene, seed and inputs.

use std::{
    collections::VecDeque,
    path::{Path, PathBuf},
    sync::Arc,
    time::Instant,
};

use reef_abi as abi;
use reef_files::WriteError;
use reef_flow::{keyframe::TrackError, waves::WindSeaError};
use reef_plugin::{
    Health, Instance, PluginError, PluginInfo, Registry, StepInput, StepReport, StepStatus, Turn, note_saved,
    step_together,
};
use reef_streams::{
    Outputs,
    environment::Environment,
    frame::{CameraPose, Frame},
    identity::ModuleTag,
};
use smallvec::SmallVec;
use thiserror::Error;

use super::{
    camera::Camera,
    clock::Clock,
    exchange::{Exchange, Said},
    ground::Ground,
    history::History,
    journal::{CameraInput, Entry, Input, Journal, ParamInput},
    kept::Kept,
    recent::{Fixed, Recent},
    setting,
    water::{ActivePoke, MOST_POKES, POKE_TIME, Poke, Water},
    waves::Waves,
};
use crate::scene::{Module, Scene, error::SceneError};

/// So many modules step without memory being asked for.
const FEW_MODULES: usize = 8;

/// Frames that are kept for reuse.
const SPARE_FRAMES: usize = 4;
/// A journal's file hears of every step that takes inputs, and of each such step.
const JOURNAL_STEPS: u64 = 60;
/// Messages that nobody took.
const MOST_MESSAGES: usize = 100;

/// How a world is made.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// In place of the scene's seed.
    pub seed: Option<u64>,
    /// In place of the best instruction set (`abi::SIMD_*`).
    pub simd_level: Option<u32>,
    /// Ask the modules for recordings.
    pub trace: bool,
    /// Save each module's state every so many steps, and remember the steps since, so that other instances
    /// can take their places while the sea runs. None: nothing is remembered, and nobody takes over.
    pub remember: Option<u64>,
    /// Most memory for states of the whole sea in its past, from which it can be brought to any moment again
    /// ([`World::go_to`]) [bytes]. 0: every such way begins at the start.
    pub history: usize,
}

/// Why there is no world.
#[derive(Debug, Error)]
pub enum WorldError {
    /// The scene is wrong.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A module could not be made.
    #[error("the module {module:?} could not be made: {source}")]
    Module {
        /// Its name in the scene.
        module: String,
        /// What its plugin said.
        source: PluginError,
    },
    /// The scene asks for a plugin that is gone.
    #[error("there is no plugin {0:?}")]
    NoPlugin(String),
    /// Keyframes in disorder.
    #[error(transparent)]
    Track(#[from] TrackError),
    /// A wind sea that makes no sense.
    #[error(transparent)]
    Waves(#[from] WindSeaError),
}

impl miette::Diagnostic for WorldError {
    fn help<'a>(&'a self) -> Option<Box<dyn std::fmt::Display + 'a>> {
        self.scene().and_then(miette::Diagnostic::help)
    }

    fn source_code(&self) -> Option<&dyn miette::SourceCode> {
        self.scene().and_then(miette::Diagnostic::source_code)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = miette::LabeledSpan> + '_>> {
        self.scene().and_then(miette::Diagnostic::labels)
    }

    fn related<'a>(&'a self) -> Option<Box<dyn Iterator<Item = &'a dyn miette::Diagnostic> + 'a>> {
        self.scene().and_then(miette::Diagnostic::related)
    }
}

impl WorldError {
    fn scene(&self) -> Option<&SceneError> {
        match self {
            Self::Scene(error) => Some(error),
            _ => None,
        }
    }
}

/// Something that a person should know.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// The step in which it happened.
    pub step: u64,
    /// The module; empty for the sea itself.
    pub module: String,
    /// What.
    pub text: String,
}

/// One module at work.
#[derive(Debug)]
pub(crate) struct Member {
    pub(crate) name: String,
    /// What the scene sets from the start.
    params: Vec<(u32, f64)>,
    pub(crate) instance: Instance,
    events: Vec<abi::Event>,
    /// Parameters that changed while it stood still: they come before the next step's events.
    pub(crate) missed: Vec<abi::Event>,
    pub(crate) standing: bool,
    /// Steps that this instance discarded: told the first times, and then at growing distances.
    pub(crate) discards: u64,
    /// It does not give its state: asked once.
    pub(crate) unsavable: bool,
    /// It has made steps: what the scene sets from the start was set.
    known: bool,
}

impl Member {
    pub(crate) fn new(name: &str, params: &[(u32, f64)], instance: Instance) -> Self {
        Self {
            name: name.to_owned(),
            params: params.to_vec(),
            instance,
            events: Vec::new(),
            missed: Vec::new(),
            standing: false,
            discards: 0,
            unsavable: false,
            known: false,
        }
    }

    /// Parameters that an edited scene sets to other values than before.
    pub(crate) fn changed_params<'a>(&self, new: &'a [(u32, f64)]) -> impl Iterator<Item = (u32, f64)> + 'a {
        let old = self.params.clone();
        new.iter().filter(move |param| !old.contains(param)).copied()
    }

    /// Goes on in an edited scene, which sets these parameters from the start. One that stands still is told
    /// about again.
    pub(crate) fn go_on(&mut self, params: &[(u32, f64)]) {
        self.params = params.to_vec();
        self.known = true;
        self.heard_anew();
    }

    /// Whatever it does from now on is told as if for the first time.
    fn heard_anew(&mut self) {
        self.standing = false;
        self.discards = 0;
    }

    /// Begins with another state.
    pub(crate) fn begin_anew(&mut self) {
        self.heard_anew();
        self.unsavable = false;
    }

    /// What the scene sets from the start.
    pub(crate) fn first_events(&self) -> impl Iterator<Item = abi::Event> {
        self.params.iter().map(|&(id, value)| param_event(id, value))
    }
}

/// The sea.
#[derive(Debug)]
pub struct World {
    pub(crate) scene: Arc<Scene>,
    pub(crate) seed: u64,
    pub(crate) clock: Clock,
    environment: Arc<Environment>,
    /// What modules get of it.
    ground: Arc<Ground>,
    camera: Camera,
    water: Water,
    raw_water: abi::Water,
    rocks: Vec<abi::Obstacle>,
    simd_level: u32,
    debug: bool,
    trace: bool,
    pub(crate) members: Vec<Member>,
    pub(crate) exchange: Exchange,
    pub(crate) pokes: Vec<ActivePoke>,
    pub(crate) hand_camera: Option<CameraInput>,
    pub(crate) pending: Vec<Input>,
    pub(crate) replay: VecDeque<Entry>,
    /// What is replayed is this run's own: whatever else comes takes its place.
    pub(crate) relived: bool,
    pub(crate) journal: Journal,
    kept: Option<Kept>,
    trains: Waves,
    /// Those of the present step.
    waves: Vec<abi::Wave>,
    obstacles: Vec<abi::Obstacle>,
    frame: Arc<Frame>,
    spare: Vec<Arc<Frame>>,
    messages: VecDeque<Message>,
    step_seconds: f64,
    remember_seconds: f64,
    pub(crate) recent: Option<Recent>,
    pub(crate) history: History,
    pub(crate) faults: Vec<Fault>,
    /// Counts the scenes that were taken up.
    pub(crate) serial: u64,
}

/// A module failed, and stands still.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Which.
    pub module: usize,
    /// In which step.
    pub step: u64,
    /// It, or its library, is at fault; else it only asked for a reset.
    pub grave: bool,
    /// What it said.
    pub text: String,
}

impl World {
    /// Makes all modules of a scene and looks at the sea before the first step.
    pub fn new(scene: Scene, plugins: &Registry, options: &Options) -> Result<Self, WorldError> {
        let seed = options.seed.unwrap_or(scene.file.scene.seed);
        let mut members = Vec::with_capacity(scene.modules.len());
        for module in &scene.modules {
            let instance = instance_of(module, &module.create_json(&scene, seed), &scene.assets, plugins)?;
            members.push(Member::new(&module.name, &module.params, instance));
        }
        let trains = Waves::new(&scene.file, seed)?;
        let environment = Arc::new(setting::environment(&scene.file, seed, &trains));
        let ground = Ground::new(&environment);
        let clock = Clock::new(scene.file.scene.dt);
        let camera = Camera::new(&scene.file.camera)?;
        let pose = camera.pose(0.0);
        let names: Vec<&str> = members.iter().map(|member| member.name.as_str()).collect();
        let tags: Arc<[ModuleTag]> = ModuleTag::all(&names).into();
        let frame = Frame {
            step: 0,
            time: 0.0,
            camera: pose,
            outputs: Vec::new(),
            tags: tags.clone(),
            flow: Arc::default(),
        };
        let raw_water = raw_water(&scene);
        let simd_level = options.simd_level.unwrap_or_else(|| reef_flow::Level::best().code());
        let recent = options.remember.map(|every| {
            let fixed = Fixed { seed, simd_level, water: raw_water, ground: ground.clone() };
            Recent::new(every, members.len(), fixed)
        });
        let mut world = Self {
            seed,
            clock,
            water: Water::new(&scene)?,
            raw_water,
            rocks: setting::rocks(&environment),
            environment,
            ground,
            camera,
            simd_level,
            debug: scene.file.scene.debug,
            trace: options.trace,
            exchange: Exchange::new(tags),
            members,
            pokes: Vec::new(),
            hand_camera: None,
            pending: Vec::new(),
            replay: VecDeque::new(),
            relived: false,
            journal: Journal::new(&scene.name, seed, clock.dt, 0),
            kept: None,
            trains,
            waves: Vec::new(),
            obstacles: Vec::new(),
            frame: Arc::new(frame),
            spare: Vec::new(),
            messages: VecDeque::new(),
            step_seconds: 0.0,
            remember_seconds: 0.0,
            recent,
            history: History::new(options.history),
            faults: Vec::new(),
            serial: 0,
            scene: Arc::new(scene),
        };
        world.look();
        Ok(world)
    }

    /// The scene.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// All files that it was made of: the scene's, and those that its modules read.
    pub fn files(&self) -> Vec<PathBuf> {
        let own = self.members.iter().flat_map(|member| member.instance.assets()).map(|asset| asset.path);
        self.scene.files.iter().cloned().chain(own).collect()
    }

    /// What the renderer needs of the scene.
    pub fn environment(&self) -> &Arc<Environment> {
        &self.environment
    }

    /// The clock.
    pub fn clock(&self) -> Clock {
        self.clock
    }

    /// The seed of this run.
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// The scene's camera.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// The sea after the last step.
    pub fn frame(&self) -> &Arc<Frame> {
        &self.frame
    }

    /// Real time that the last step took [s].
    pub fn step_seconds(&self) -> f64 {
        self.step_seconds
    }

    /// What of it went into the memory of the past [s].
    pub fn remember_seconds(&self) -> f64 {
        self.remember_seconds
    }

    /// Name and plugin of each module.
    pub fn modules(&self) -> impl ExactSizeIterator<Item = (&str, &Arc<PluginInfo>)> {
        self.members.iter().map(|member| (member.name.as_str(), member.instance.info()))
    }

    /// A module.
    pub fn instance(&self, module: usize) -> Option<&Instance> {
        self.members.get(module).map(|member| &member.instance)
    }

    /// Modules that failed since the last call.
    pub fn take_faults(&mut self) -> Vec<Fault> {
        std::mem::take(&mut self.faults)
    }

    /// What people should know and nobody took yet.
    pub fn take_messages(&mut self) -> Vec<Message> {
        self.messages.drain(..).collect()
    }

    /// Whether modules are asked for debug lines.
    pub fn debug(&self) -> bool {
        self.debug
    }

    /// Asks the modules for debug lines, or no longer.
    pub fn set_debug(&mut self, on: bool) {
        self.debug = on;
    }

    /// Value of a module's parameter in the next step.
    pub fn param(&self, module: usize, id: u32) -> Option<f64> {
        let member = self.members.get(module)?;
        let waiting = self.pending.iter().rev().find_map(|input| match input {
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
        self.pending.retain(|input| !same(input));
        self.pending.push(Input::Param(input));
        true
    }

    /// Touches the water with the next step. False: the numbers make no sense.
    pub fn poke(&mut self, poke: Poke) -> bool {
        let sound = poke.is_sound();
        if sound {
            self.pending.push(Input::Poke(poke));
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
        let waiting = self.pending.iter().rev().find_map(|input| match input {
            Input::Camera(camera) => Some(*camera),
            _ => None,
        });
        if waiting.unwrap_or(self.hand_camera) != camera {
            self.pending.retain(|input| !matches!(input, Input::Camera(_)));
            self.pending.push(Input::Camera(camera));
        }
    }

    /// All that came from outside so far.
    pub fn journal(&self) -> &Journal {
        &self.journal
    }

    /// Keeps the journal in a file from now on.
    pub fn write_journal_to(&mut self, path: &Path) -> Result<(), WriteError> {
        let kept = Kept::begin(path, &self.journal)?;
        if kept.is_whole_at_all_times() {
            note_saved("journal", format!("The journal {} holds all inputs.", path.display()));
        }
        self.kept = Some(kept);
        Ok(())
    }

    /// Writes the journal's file at the end of the run.
    pub fn flush_journal(&mut self) -> Result<(), WriteError> {
        self.kept.as_mut().map_or(Ok(()), |kept| kept.finish(&self.journal))
    }

    /// Feeds a journal's inputs again, each in its step. `Err`: it belongs to another run.
    pub fn replay(&mut self, journal: Journal) -> Result<(), String> {
        let header = &journal.header;
        let differs = |what: &str, there: String, here: String| {
            Err(format!("the journal is of {what} {there}, this run is of {what} {here}"))
        };
        if header.scene != self.scene.name {
            return differs("the scene", format!("{:?}", header.scene), format!("{:?}", self.scene.name));
        }
        if header.seed != self.seed {
            return differs("the seed", header.seed.to_string(), self.seed.to_string());
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
        self.replay = journal.entries.into_iter().filter(|entry| entry.step > now).collect();
        self.relived = false;
        self.history.forget_from(now + 1);
        Ok(())
    }

    /// One step.
    pub fn step(&mut self) {
        self.step_with(0);
    }

    /// One step at which nobody looks: modules may leave out what only shows. The sea afterwards is that of
    /// [`World::step`].
    pub fn step_unseen(&mut self) {
        self.step_with(abi::STEP_UNSEEN);
    }

    fn step_with(&mut self, flags: u32) {
        let began = Instant::now();
        self.clock.step += 1;
        self.take_inputs();
        self.run(self.clock.dt, flags);
        self.save_one();
        let stepped = Instant::now();
        self.remember();
        self.remember_seconds = stepped.elapsed().as_secs_f64();
        self.step_seconds = began.elapsed().as_secs_f64();
        self.journal.end = self.clock.step;
        if let Some(kept) = &mut self.kept
            && (kept.lacks_inputs(&self.journal) || self.clock.step.is_multiple_of(JOURNAL_STEPS))
            && let Err(error) = kept.update(&self.journal)
        {
            self.tell("", error.to_string());
            self.kept = None;
        }
    }

    /// Back to the start, as if the scene had just been loaded. The journal begins anew.
    pub fn reset(&mut self) {
        self.pending.clear();
        self.replay.clear();
        self.history.forget_from(0);
        self.history.root();
        self.journal = Journal::new(&self.scene.name, self.seed, self.clock.dt, 0);
        self.begin_again();
    }

    /// Back to the start; what came from outside, and what is remembered, stays.
    pub(crate) fn begin_again(&mut self) {
        self.clock.step = 0;
        self.pokes.clear();
        self.hand_camera = None;
        self.exchange.clear();
        for at in 0..self.members.len() {
            self.members[at].begin_anew();
            if let Err(error) = self.members[at].instance.reset() {
                let name = self.members[at].name.clone();
                self.tell(&name, error.to_string());
            }
        }
        self.look();
    }

    /// Emits the present state without changing it; at step 0 with the parameters that the scene sets.
    pub(crate) fn look(&mut self) {
        for member in &mut self.members {
            member.known &= self.clock.step != 0;
        }
        self.look_again();
    }

    /// The same for a sea in which only some modules are new.
    pub(crate) fn look_again(&mut self) {
        for member in &mut self.members {
            member.events.clear();
            member.missed.clear();
            if !std::mem::replace(&mut member.known, true) || self.clock.step == 0 {
                let params = std::mem::take(&mut member.params);
                member.events.extend(params.iter().map(|&(id, value)| param_event(id, value)));
                member.params = params;
            }
        }
        self.emit_present();
        for _ in 0..self.members.len() {
            self.save_one();
        }
    }

    /// A state was loaded that a step follows. Whoever would take over from a module begins anew, from its
    /// next saved state.
    pub(crate) fn forget_inputs(&mut self) {
        for member in &mut self.members {
            member.events.clear();
            member.missed.clear();
        }
        if let Some(recent) = &mut self.recent {
            recent.forget();
        }
    }

    /// Looks at the sea after these modules said this: that counts, not what they say while it looks.
    pub(crate) fn look_after(&mut self, said: Vec<(usize, Said)>, look: impl FnOnce(&mut Self)) {
        for (at, said) in &said {
            self.exchange.said[*at].clone_from(said);
        }
        look(self);
        for (at, said) in said {
            self.exchange.said[at] = said;
        }
    }

    fn emit_present(&mut self) {
        if let Some(recent) = &mut self.recent {
            recent.forget();
        }
        self.run(0.0, 0);
    }

    /// The still part of an edited scene, and what was said in it.
    pub(crate) fn settle(
        &mut self,
        seed: u64,
        environment: Arc<Environment>,
        trains: Waves,
        camera: Camera,
        water: Water,
        raw_water: abi::Water,
        exchange: Exchange,
    ) {
        self.seed = seed;
        self.trains = trains;
        self.rocks = setting::rocks(&environment);
        self.ground = Ground::new(&environment);
        self.environment = environment;
        (self.camera, self.water, self.raw_water, self.exchange) = (camera, water, raw_water, exchange);
        self.replay.clear();
        self.pending.clear();
        self.faults.clear();
        self.history.graft();
        if let Some(recent) = &mut self.recent {
            recent.forget();
            let ground = self.ground.clone();
            let fixed = Fixed { seed, simd_level: self.simd_level, water: raw_water, ground };
            *recent = Recent::new(recent.every(), self.members.len(), fixed);
        }
    }

    /// Something from outside, for the next step.
    pub(crate) fn ask(&mut self, input: Input) {
        self.pending.push(input);
    }

    /// Saves the state of a module whose turn it is.
    fn save_one(&mut self) {
        let (Some(recent), step) = (&mut self.recent, self.clock.step) else { return };
        let running = |at: usize| {
            let member = &self.members[at];
            !member.unsavable && *member.instance.health() == Health::Running
        };
        let Some(at) = recent.due(step, running) else { return };
        match self.members[at].instance.save() {
            Ok(state) => recent.saved(at, step, state),
            Err(error) => {
                let instance = &mut self.members[at].instance;
                if error.is_fatal() {
                    instance.condemn(error.to_string());
                }
                if *instance.health() != Health::Running {
                    return; // The next step tells of the fault, and who takes over is saved again.
                }
                let name = self.members[at].name.clone();
                self.members[at].unsavable = true;
                self.tell(
                    &name,
                    format!("it does not give its state, so nothing can take over from it: {error}"),
                );
            }
        }
    }

    /// Makes a new frame of the present step: instances took others' places. States of others are no past of
    /// theirs.
    pub(crate) fn show_again(&mut self) {
        self.history.graft();
        let Frame { step, time, camera, ref flow, .. } = *self.frame;
        let (outputs, tags) = (Vec::new(), self.exchange.tags().clone());
        let frame = Frame { step, time, camera, outputs, tags, flow: flow.clone() };
        self.publish(frame);
    }

    fn take_inputs(&mut self) {
        for member in &mut self.members {
            member.events.clear();
            member.events.append(&mut member.missed);
        }
        let step = self.clock.step;
        let dt = self.clock.dt;
        self.pokes.retain(|active| step.saturating_sub(active.step) as f64 * dt < POKE_TIME);
        if !self.pending.is_empty() {
            self.turn(self.clock.step);
        }
        while self.replay.front().is_some_and(|entry| entry.step <= step) {
            if let Some(entry) = self.replay.pop_front() {
                self.take(entry.input);
            }
        }
        for input in std::mem::take(&mut self.pending) {
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
                if self.pokes.len() < MOST_POKES {
                    self.pokes.push(ActivePoke { step, poke: *poke });
                }
            }
            Input::Camera(camera) => self.hand_camera = *camera,
        }
        self.journal.entries.push(Entry { step, input });
    }

    /// Calls all modules with the same input, at the same time, then makes a frame of what they said.
    /// `asked`: flags of the step's input beside the sea's own.
    fn run(&mut self, dt: f64, asked: u32) {
        let step = self.clock.step;
        let time = self.clock.time();
        let pose =
            self.hand_camera.and_then(|camera| camera.pose()).unwrap_or_else(|| self.camera.pose(time));
        let camera = self.camera.raw(&pose);
        self.trains.fill(time, &mut self.waves);
        self.obstacles.clear();
        self.water.obstacles(time, &mut self.obstacles);
        self.obstacles.extend_from_slice(&self.rocks);
        let (mut flow, mut attached) = self.exchange.begin();
        self.water.flow(time, &self.exchange, &mut flow, &mut attached);
        for active in &self.pokes {
            flow.extend(active.poke.flow(step.saturating_sub(active.step) as f64 * self.clock.dt));
        }
        self.exchange.share(flow, attached);
        let ground = self.ground.clone();
        let heightfield = ground.heightfield();
        let flags = asked
            | if self.trace { abi::STEP_TRACE } else { 0 }
            | if self.debug { abi::STEP_DEBUG } else { 0 };
        let exchange = &self.exchange;
        let mut turns: SmallVec<[Turn<'_>; FEW_MODULES]> = SmallVec::new();
        for (at, member) in self.members.iter_mut().enumerate() {
            let input = StepInput {
                flags,
                step,
                time,
                dt,
                seed: self.seed,
                simd_level: self.simd_level,
                camera: &camera,
                water: &self.raw_water,
                heightfield,
                flow: exchange.flow_for(at),
                waves: &self.waves,
                actors: exchange.actors_for(at),
                obstacles: &self.obstacles,
            };
            turns.push(Turn::new(at, &mut member.instance, input, &member.events));
        }
        step_together(&mut turns);
        let reports: SmallVec<[Option<StepReport>; FEW_MODULES]> =
            turns.into_iter().map(|turn| turn.report).collect();
        let mut told = Vec::new();
        for (at, (member, report)) in self.members.iter_mut().zip(reports).enumerate() {
            let Some(report) = report else { continue };
            let standing = matches!(report.status, StepStatus::Failed | StepStatus::Standing);
            let text = || report.message.unwrap_or_else(|| "it stands still".to_owned());
            if standing && !member.standing {
                let grave = matches!(member.instance.health(), Health::Faulty(_));
                let text = text();
                told.push((member.name.clone(), text.clone()));
                self.faults.push(Fault { module: at, step, grave, text });
                if let Some(recent) = &mut self.recent {
                    recent.freeze(at, step);
                }
            } else if report.status == StepStatus::Discarded {
                member.discards += 1;
                told.extend(counted(member.discards, &text()).map(|text| (member.name.clone(), text)));
            }
            member.standing = standing;
        }
        if let Some(recent) = &mut self.recent {
            let mut moment = recent.begin();
            if let Some(moment) = Arc::get_mut(&mut moment) {
                (moment.step, moment.time, moment.dt) = (step, time, dt);
                (moment.flags, moment.camera) = (flags, camera);
                let events = self.members.iter().map(|member| member.events.as_slice());
                moment.remember(&self.exchange, &self.waves, &self.obstacles, events);
            }
            recent.add(moment);
        }
        for (module, text) in told {
            self.tell(&module, text);
        }
        self.exchange.take(self.members.iter().map(|member| member.instance.outputs()));
        let (outputs, tags, flow) = (Vec::new(), self.exchange.tags().clone(), self.exchange.all());
        self.publish(Frame { step, time, camera: pose, outputs, tags, flow });
    }

    /// Makes a frame the newest; the memory of one that nobody holds any more is used again.
    fn publish(&mut self, mut frame: Frame) {
        let mut free = None;
        for at in 0..self.spare.len() {
            if Arc::get_mut(&mut self.spare[at]).is_some() {
                free = Some(self.spare.swap_remove(at));
                break;
            }
        }
        let outputs = self.members.iter().map(|member| member.instance.outputs().clone());
        let next = match free {
            Some(mut old) => {
                if let Some(old) = Arc::get_mut(&mut old) {
                    let mut list: Vec<Arc<Outputs>> = std::mem::take(&mut old.outputs);
                    list.clear();
                    list.extend(outputs);
                    frame.outputs = list;
                    *old = frame;
                }
                old
            }
            None => {
                frame.outputs = outputs.collect();
                Arc::new(frame)
            }
        };
        let mut old = std::mem::replace(&mut self.frame, next);
        if self.spare.len() < SPARE_FRAMES {
            // The outputs of a frame that only we hold go back to their modules at once.
            if let Some(old) = Arc::get_mut(&mut old) {
                old.outputs.clear();
                old.flow = self.frame.flow.clone();
            }
            self.spare.push(old);
        }
        for spare in &mut self.spare {
            if let Some(spare) = Arc::get_mut(spare) {
                spare.outputs.clear();
                spare.flow = self.frame.flow.clone();
            }
        }
    }

    pub(crate) fn tell(&mut self, module: &str, text: String) {
        tracing::warn!(module, step = self.clock.step, "{text}");
        if self.messages.len() == MOST_MESSAGES {
            self.messages.pop_front();
        }
        self.messages.push_back(Message { step: self.clock.step, module: module.to_owned(), text });
    }
}

impl Drop for World {
    fn drop(&mut self) {
        if let Err(error) = self.flush_journal() {
            tracing::error!("{error}");
        }
    }
}

/// Makes the instance of a module; what its plugin says about the configuration is told at its place in the
/// scene.
pub(crate) fn instance_of(
    module: &Module,
    config: &str,
    assets: &Path,
    plugins: &Registry,
) -> Result<Instance, WorldError> {
    let plugin = plugins.get(&module.plugin).ok_or_else(|| WorldError::NoPlugin(module.plugin.clone()))?;
    plugin.create_among(config, assets).map_err(|error| match error {
        PluginError::Config { path, message, .. } => {
            let told = path.map_or(message.clone(), |path| format!("{path}: {message}"));
            module.create_error(&told).into()
        }
        source => WorldError::Module { module: module.name.clone(), source },
    })
}

/// The scene's water as modules read it.
pub(crate) fn raw_water(scene: &Scene) -> abi::Water {
    let water = &scene.file.water;
    abi::Water {
        density: water.density as f32,
        viscosity: water.viscosity as f32,
        depth: water.depth as f32,
        spare: [0.0; 5],
    }
}

/// How many of a module's discarded steps are told one by one.
const FIRST_DISCARDS: u64 = 3;

/// What is told of a module's discarded step with this number: all of the first ones, then each whose number
/// is twice as great as that of the last one told.
fn counted(number: u64, text: &str) -> Option<String> {
    match number {
        ..FIRST_DISCARDS => Some(text.to_owned()),
        FIRST_DISCARDS => {
            Some(format!("{text} (for the 3rd time: from now on every 2nd, 4th, 8th … time is told)"))
        }
        _ if number.is_power_of_two() => Some(format!("{text} (for the {number}th time)")),
        _ => None,
    }
}

fn param_event(id: u32, value: f64) -> abi::Event {
    abi::Event { kind: abi::EVENT_PARAM, param: id, value, ..abi::Event::default() }
}
