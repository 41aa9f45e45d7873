//! The sea: steps all modules of a scene, the same for the same scene, seed and inputs.

use std::{collections::VecDeque, path::PathBuf, sync::Arc, time::Instant};

use reef_abi as abi;
use reef_flow::{keyframe::TrackError, waves::WindSeaError};
use reef_plugin::{
    Health, Instance, PluginError, PluginInfo, Registry, StepInput, StepReport, StepStatus, Turn,
    step_together,
};
use reef_streams::{environment::Environment, frame::Frame, identity::ModuleTag};
use smallvec::SmallVec;
use thiserror::Error;

use super::{
    camera::Camera,
    clock::Clock,
    exchange::{Exchange, Said},
    frames::Frames,
    hands::Hands,
    hash::Chain,
    history::History,
    member::{Member, counted, instance_of, param_event},
    recent::Recent,
    setting::Setting,
};
use crate::scene::{Scene, error::SceneError};

/// So many modules step without memory being asked for.
const FEW_MODULES: usize = 8;

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

/// The sea.
#[derive(Debug)]
pub struct World {
    /// What does not change from step to step.
    pub(crate) setting: Setting,
    pub(crate) clock: Clock,
    simd_level: u32,
    debug: bool,
    trace: bool,
    pub(crate) members: Vec<Member>,
    pub(crate) exchange: Exchange,
    pub(crate) hands: Hands,
    /// Waves and obstacles of the present step.
    waves: Vec<abi::Wave>,
    obstacles: Vec<abi::Obstacle>,
    frames: Frames,
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
        let setting = Setting::new(scene, seed)?;
        let clock = Clock::new(setting.scene.file.scene.dt);
        let names: Vec<&str> = members.iter().map(|member| member.name.as_str()).collect();
        let tags: Arc<[ModuleTag]> = ModuleTag::all(&names).into();
        let frame = Frame {
            step: 0,
            time: 0.0,
            camera: setting.camera.pose(0.0),
            outputs: Vec::new(),
            tags: tags.clone(),
            flow: Arc::default(),
        };
        let simd_level = options.simd_level.unwrap_or_else(|| reef_flow::Level::best().code());
        let recent =
            options.remember.map(|every| Recent::new(every, members.len(), setting.fixed(simd_level)));
        let mut world = Self {
            clock,
            simd_level,
            debug: setting.scene.file.scene.debug,
            trace: options.trace,
            exchange: Exchange::new(tags),
            members,
            hands: Hands::new(setting.journal_from(0)),
            waves: Vec::new(),
            obstacles: Vec::new(),
            frames: Frames::new(frame),
            messages: VecDeque::new(),
            step_seconds: 0.0,
            remember_seconds: 0.0,
            recent,
            history: History::new(options.history),
            faults: Vec::new(),
            serial: 0,
            setting,
        };
        world.refresh();
        Ok(world)
    }

    /// The scene.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.setting.scene
    }

    /// All files that it was made of: the scene's, and those that its modules read.
    pub fn files(&self) -> Vec<PathBuf> {
        let own = self.members.iter().flat_map(|member| member.instance.assets()).map(|asset| asset.path);
        self.setting.scene.files.iter().cloned().chain(own).collect()
    }

    /// What the renderer needs of the scene.
    pub fn environment(&self) -> &Arc<Environment> {
        &self.setting.environment
    }

    /// The clock.
    pub fn clock(&self) -> Clock {
        self.clock
    }

    /// The seed of this run.
    pub fn seed(&self) -> u64 {
        self.setting.seed
    }

    /// The scene's camera.
    pub fn camera(&self) -> &Camera {
        &self.setting.camera
    }

    /// The sea after the last step.
    pub fn frame(&self) -> &Arc<Frame> {
        self.frames.newest()
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
        self.write_down();
    }

    /// Back to the start, as if the scene had just been loaded. The journal begins anew.
    pub fn reset(&mut self) {
        self.hands.pending.clear();
        self.hands.replay.clear();
        self.history.begin_anew();
        self.hands.journal = self.setting.journal_from(0);
        self.begin_again();
    }

    /// Back to the start; what came from outside, and what is remembered, stays.
    pub(crate) fn begin_again(&mut self) {
        self.clock.step = 0;
        self.hands.let_go();
        self.exchange.clear();
        for at in 0..self.members.len() {
            self.members[at].begin_anew();
            if let Err(error) = self.members[at].instance.reset() {
                let name = self.members[at].name.clone();
                self.tell(&name, error.to_string());
            }
        }
        self.refresh();
    }

    /// Emits the present state without changing it; at step 0 with the parameters that the scene sets.
    pub(crate) fn refresh(&mut self) {
        for member in &mut self.members {
            member.known &= self.clock.step != 0;
        }
        self.refresh_new();
    }

    /// The same for a sea in which only some modules are new.
    pub(crate) fn refresh_new(&mut self) {
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

    /// Refreshes the sea after these modules said this: that counts, not what they say while it does.
    pub(crate) fn refresh_after(&mut self, said: Vec<(usize, Said)>, refresh: impl FnOnce(&mut Self)) {
        for (at, said) in &said {
            self.exchange.said[*at].clone_from(said);
        }
        refresh(self);
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
    pub(crate) fn install(&mut self, setting: Setting, exchange: Exchange) {
        (self.setting, self.exchange) = (setting, exchange);
        self.hands.replay.clear();
        self.hands.pending.clear();
        self.hands.journal = self.setting.journal_from(self.clock.step);
        self.faults.clear();
        self.history.graft();
        if let Some(recent) = &mut self.recent {
            recent.forget();
            *recent = Recent::new(recent.every(), self.members.len(), self.setting.fixed(self.simd_level));
        }
    }

    /// Saves the state of a module whose turn it is.
    fn save_one(&mut self) {
        let (Some(recent), step) = (&mut self.recent, self.clock.step) else { return };
        let members = &self.members;
        let Some(at) = recent.due(step, |at| members[at].is_savable()) else { return };
        match self.members[at].instance.save() {
            Ok(state) => recent.saved(at, step, state),
            Err(error) => self.note_unsaved(at, &error),
        }
    }

    /// A module did not give its state when it was asked: it is not asked again.
    pub(crate) fn note_unsaved(&mut self, at: usize, error: &PluginError) {
        let member = &mut self.members[at];
        if error.is_fatal() {
            member.instance.condemn(error.to_string());
        }
        if *member.instance.health() != Health::Running {
            return; // The next step tells of the fault, and who takes over is saved again.
        }
        member.unsavable = true;
        let name = member.name.clone();
        self.tell(&name, format!("it does not give its state, so nothing can take over from it: {error}"));
    }

    /// The whole sea, as [`World::save`]; None: some module does not give its state, which is told once.
    pub(crate) fn try_save(&mut self, chain: Option<&Chain>) -> Option<Vec<u8>> {
        if !self.members.iter().all(Member::is_savable) {
            return None;
        }
        let mut states = Vec::with_capacity(self.members.len());
        for (at, state) in self.save_payloads(Vec::new).into_iter().enumerate() {
            match state {
                Ok(state) => states.push(state.seal(&self.members[at].instance.info().id)),
                Err(error) => {
                    self.note_unsaved(at, &error);
                    return None;
                }
            }
        }
        self.encode(&states, chain).ok()
    }

    /// Makes a new frame of the present step: instances took others' places. States of others are no past of
    /// theirs.
    pub(crate) fn show_again(&mut self) {
        self.history.graft();
        let Frame { step, time, camera, ref flow, .. } = **self.frames.newest();
        let (outputs, tags) = (Vec::new(), self.exchange.tags().clone());
        let frame = Frame { step, time, camera, outputs, tags, flow: flow.clone() };
        self.publish(frame);
    }

    /// Calls all modules with the same input, at the same time, then makes a frame of what they said.
    /// `asked`: flags of the step's input beside the sea's own.
    fn run(&mut self, dt: f64, asked: u32) {
        let step = self.clock.step;
        let time = self.clock.time();
        let pose = self
            .hands
            .camera
            .and_then(|camera| camera.pose())
            .unwrap_or_else(|| self.setting.camera.pose(time));
        let camera = self.setting.camera.raw(&pose);
        self.setting.trains.fill(time, &mut self.waves);
        self.obstacles.clear();
        self.setting.water.obstacles(time, &mut self.obstacles);
        self.obstacles.extend_from_slice(&self.setting.rocks);
        let (mut flow, mut attached) = self.exchange.begin();
        self.setting.water.flow(time, &self.exchange, &mut flow, &mut attached);
        for active in &self.hands.pokes {
            flow.extend(active.poke.flow(step.saturating_sub(active.step) as f64 * self.clock.dt));
        }
        self.exchange.pass_on(flow, attached);
        let ground = self.setting.ground.clone();
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
                seed: self.setting.seed,
                simd_level: self.simd_level,
                camera: &camera,
                water: &self.setting.raw_water,
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

    /// Makes a frame the newest, with what the modules put out.
    fn publish(&mut self, frame: Frame) {
        self.frames.publish(frame, self.members.iter().map(|member| member.instance.outputs().clone()));
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
