//! The sea behind the window: a timeline, what the panel has to know of it, and other scenes that can take
//! its place.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use reef_command::{Common, open};
use reef_plugin as plugin;
use reef_plugin::{Health, Registry};
use reef_render::view::between;
use reef_report::failure::Failure;
use reef_sea::{
    Blend, Options, Timeline, World,
    reload::{Live, REMEMBER, Standing},
    step::{
        hash::{Chain, hex},
        rescue::Rescue,
        water::Poke,
    },
};
use reef_streams::{
    environment::{Environment, Terrain},
    frame::{CameraPose, Frame},
};

use super::panel::model::{Level, PanelModel, ParamKind, ParamView, PluginView};
use crate::headless::show;

/// A sea that runs in real time.
pub struct Sea {
    common: Common,
    live: Live,
    timeline: Timeline,
    path: PathBuf,
    journal: Option<PathBuf>,
    choices: Vec<(String, PathBuf)>,
    chain: Option<Chain>,
    /// The chain after each step, for jumps; empty where nothing is hashed.
    chains: Vec<(u64, Chain)>,
    /// Most memory for the past [bytes].
    history: usize,
    /// No time passes: somebody holds the timeline.
    held: bool,
    /// What is left of the run should a plugin take the program down.
    rescue: Rescue,
    /// What is shown, renewed by [`Sea::advance`].
    blend: Blend,
}

/// What a run was, for programs that started it.
#[derive(Debug, serde::Serialize)]
pub struct Summary {
    /// The scene's name.
    pub scene: String,
    /// Pictures that were shown.
    pub frames: u64,
    /// Number of the last step.
    pub steps: u64,
    /// Things that came from outside.
    pub events: usize,
    /// Chained hash of all steps, as `reef sim --hash` prints it.
    pub hash: Option<String>,
}

impl Sea {
    /// Finds plugins, reads the scene, makes its sea. `hashed`: every step is hashed, which costs time.
    /// `history`: most memory for the past [bytes].
    pub fn new(
        common: &Common,
        scene: &Path,
        journal: Option<&Path>,
        hashed: bool,
        history: usize,
    ) -> Result<Self, Failure> {
        let plugins = open::plugins(common)?;
        let (world, path) = make(common, &plugins, scene, history)?;
        let live = open::live(common, plugins, &world)?;
        let timeline = Timeline::new(world);
        let mut sea = Self {
            common: common.clone(),
            live,
            blend: timeline.blend(),
            timeline,
            path,
            journal: journal.map(Path::to_owned),
            choices: choices(common),
            chain: hashed.then(Chain::default),
            chains: Vec::new(),
            history,
            held: false,
            rescue: Rescue::beside(journal),
        };
        sea.begin_journal()?;
        Ok(sea)
    }

    /// Opens another scene in place of this one. A scene that is refused changes nothing.
    pub fn open(&mut self, path: &Path) -> Result<(), Failure> {
        let (world, path) = make(&self.common, self.live.plugins(), path, self.history)?;
        let speed = self.timeline.speed();
        self.timeline = Timeline::new(world);
        self.timeline.set_speed(speed);
        self.path = path;
        self.live.moved(&self.timeline.world);
        self.restart()
    }

    /// Back to the first moment. The journal begins anew.
    pub fn reset(&mut self) -> Result<(), Failure> {
        self.timeline.reset();
        self.restart()
    }

    fn restart(&mut self) -> Result<(), Failure> {
        self.blend = self.timeline.blend();
        if self.chain.is_some() {
            self.chain = Some(Chain::default());
        }
        self.chains.clear();
        self.rescue = Rescue::beside(self.journal.as_deref());
        self.begin_journal()
    }

    fn begin_journal(&mut self) -> Result<(), Failure> {
        match &self.journal {
            Some(path) => self.timeline.world.write_journal_to(path).map_err(Failure::input),
            None => Ok(()),
        }
    }

    /// The scene's name.
    pub fn name(&self) -> &str {
        &self.timeline.world.scene().name
    }

    /// What stands still.
    pub fn environment(&self) -> &Arc<Environment> {
        self.timeline.world.environment()
    }

    /// The ground, if there is one.
    pub fn terrain(&self) -> Option<&Terrain> {
        self.environment().terrain.as_deref()
    }

    /// What is shown: two steps and where between them.
    pub fn blend(&self) -> &Blend {
        &self.blend
    }

    /// The newest step that is shown.
    pub fn newest(&self) -> &Frame {
        &self.blend.current
    }

    /// The scene's camera at the moment that is shown.
    pub fn camera(&self) -> CameraPose {
        between(&self.blend.previous.camera, &self.blend.current.camera, self.blend.alpha)
    }

    /// Whether the sea stands still.
    pub fn is_paused(&self) -> bool {
        self.timeline.paused
    }

    /// Stops the sea, or lets it go on.
    pub fn pause(&mut self, paused: bool) {
        self.timeline.paused = paused;
    }

    /// Sea seconds a second.
    pub fn set_speed(&mut self, speed: f64) {
        self.timeline.set_speed(speed);
    }

    /// One step, standing still.
    pub fn step_once(&mut self) {
        self.timeline.single_step();
        add((&mut self.chain, &mut self.chains), &mut self.timeline.world);
        self.blend = self.timeline.blend();
    }

    /// Takes up what changed since the last frame: newer builds, older ones after a fault, an edited scene.
    /// True: modules are others now, or have other parameters.
    pub fn tend(&mut self) -> bool {
        let tended = self.live.tend(&mut self.timeline.world);
        if tended.edited {
            self.timeline.jump();
        } else if tended.swapped && self.timeline.paused {
            self.timeline.show_newest();
        }
        if tended.swapped || tended.edited {
            self.blend = self.timeline.blend();
        }
        tended.swapped || tended.edited
    }

    /// Gives a module that stands still another chance.
    pub fn retry(&mut self, module: usize) {
        self.live.retry(module);
    }

    /// Real time passes [s].
    pub fn advance(&mut self, seconds: f64) {
        let Self { timeline, chain, chains, .. } = self;
        timeline.whole = chain.is_some();
        if !self.held || timeline.way().is_some() {
            timeline.advance_with(seconds, |world| add((chain, chains), world));
        }
        self.rescue.keep(&mut self.timeline.world, self.chain.as_ref());
        self.blend = self.timeline.blend();
    }

    /// Sets out for another moment. `held`: no time passes there until the next call. What keeps the sea from
    /// it is told.
    pub fn go_to(&mut self, step: u64, held: bool) {
        self.held = held;
        if let Err(error) = self.timeline.go_to(step) {
            tracing::error!("{error}");
        }
        let now = self.timeline.world.clock().step;
        self.chains.truncate(self.chains.partition_point(|(step, _)| *step <= now));
        if self.chain.is_some() {
            self.chain = Some(self.chains.last().map(|(_, chain)| *chain).unwrap_or_default());
        }
        self.blend = self.timeline.blend();
    }

    /// Stays where the way to another moment has led so far.
    pub fn stop(&mut self) {
        let Self { timeline, chain, chains, .. } = self;
        timeline.stop(|world| add((chain, chains), world));
        self.blend = self.timeline.blend();
    }

    /// Changes a parameter with the next step.
    pub fn set_param(&mut self, instance: usize, id: u32, value: f64) {
        if !self.timeline.world.set_param(instance, id, value) {
            tracing::warn!("parameter {id} of module {instance} does not take {value}");
        }
    }

    /// Touches the water with the next step.
    pub fn poke(&mut self, poke: Poke) {
        // What makes no sense was kept back by who made it.
        let _ = self.timeline.world.poke(poke);
    }

    /// Asks the modules for debug lines, or no longer.
    pub fn set_debug(&mut self, on: bool) {
        self.timeline.world.set_debug(on);
    }

    /// Channels of debug lines that the newest step holds (bit set).
    pub fn debug_channels(&self) -> u32 {
        let lines = self.blend.current.outputs.iter().flat_map(|outputs| &outputs.debug_lines);
        lines.fold(0, |set, line| set | 1u32.checked_shl(line.channel).unwrap_or(0))
    }

    /// Ends the run: writes the journal, and tells what it was.
    pub fn finish(mut self, frames: u64) -> Result<Summary, Failure> {
        let world = &mut self.timeline.world;
        world.flush_journal().map_err(Failure::input)?;
        Ok(Summary {
            scene: world.scene().name.clone(),
            frames,
            steps: world.clock().step,
            events: world.journal().entries.len(),
            hash: self.chain.map(|chain| hex(&chain.digest)),
        })
    }

    /// Fills in what changes only with the scene: names, modules, their parameters.
    pub fn describe(&self, model: &mut PanelModel) {
        let world = &self.timeline.world;
        model.scene.name = world.scene().name.clone();
        model.scene.path = self.path.clone();
        model.scene.choices = self.choices.clone();
        model.timing.dt_ms = (world.clock().dt * 1000.0) as f32;
        model.timeline.dt = world.clock().dt;
        model.timeline.duration = world.clock().steps_to(world.scene().file.scene.duration);
        model.clock.speed = self.timeline.speed();
        model.view.debug = world.debug();
        model.view.ask(show::markers(&world.scene().file.scene));
        model.view.debug_present = 0;
        model.plugins = world
            .modules()
            .enumerate()
            .map(|(module, (name, info))| plugin_view(module, name, info, |id| world.param(module, id)))
            .collect();
    }

    /// Fills in what changes with every frame, and passes on what modules tell.
    pub fn measure(&mut self, model: &mut PanelModel) {
        let way = self.timeline.way();
        let world = &mut self.timeline.world;
        for (module, view) in model.plugins.iter_mut().enumerate() {
            let Standing { generation, age, trouble } = self.live.standing(world, module);
            (view.generation, view.age, view.trouble) = (generation, age, trouble);
            let health = world.instance(module).map(|instance| instance.health());
            view.stands = health.is_some_and(|health| *health != Health::Running);
            view.figures = world.instance(module).map(|instance| instance.figures()).unwrap_or_default();
        }
        // The panel has them from the log.
        self.live.take_notices();
        for message in world.take_messages() {
            let who = if message.module.is_empty() { String::new() } else { format!("{}: ", message.module) };
            model.messages.push(Level::Warning, format!("{who}{}", message.text));
        }
        model.scene.step = world.clock().step;
        model.scene.time = world.clock().time();
        model.timeline.memory = world.memory();
        model.timeline.way = way;
        if world.step_seconds() > 0.0 && !self.timeline.paused {
            model.timing.push_step((world.step_seconds() * 1000.0) as f32);
        }
        model.clock.paused = self.timeline.paused;
        model.clock.behind = self.timeline.behind().map(|share| share * self.timeline.speed());
        model.view.debug_present |= self.debug_channels();
    }
}

/// Adds a step to the chain of hashes. A module that cannot save its state has told why; then there is no
/// hash.
fn add((chain, chains): (&mut Option<Chain>, &mut Vec<(u64, Chain)>), world: &mut World) {
    let Some(running) = chain else { return };
    match running.add(world) {
        Ok(_) => chains.push((world.clock().step, *running)),
        Err(error) => {
            tracing::error!("no hash: {error}");
            *chain = None;
        }
    }
}

fn make(
    common: &Common,
    plugins: &Registry,
    scene: &Path,
    history: usize,
) -> Result<(World, PathBuf), Failure> {
    let scene = open::scene(common, scene, plugins)?;
    let path = scene.path.clone();
    let options = Options { seed: common.seed, remember: Some(REMEMBER), history, ..Options::default() };
    Ok((World::new(scene, plugins, &options).map_err(Failure::input)?, path))
}

/// Scenes beside each other in the folder of assets.
fn choices(common: &Common) -> Vec<(String, PathBuf)> {
    let Ok(folder) = open::assets_folder(common) else { return Vec::new() };
    let entries = std::fs::read_dir(folder.join("scenes")).into_iter().flatten().flatten();
    let mut scenes: Vec<_> = entries
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .filter_map(|path| Some((path.file_stem()?.to_str()?.to_owned(), path)))
        .collect();
    scenes.sort();
    scenes
}

fn plugin_view(
    module: usize,
    name: &str,
    info: &plugin::PluginInfo,
    value: impl Fn(u32) -> Option<f64>,
) -> PluginView {
    let params = info.params.iter().map(|param| ParamView {
        id: param.id,
        kind: match param.kind {
            plugin::ParamKind::Float => ParamKind::Float { log: param.logarithmic },
            plugin::ParamKind::Int => ParamKind::Int,
            plugin::ParamKind::Switch => ParamKind::Switch,
            plugin::ParamKind::Choice => ParamKind::Choice(param.choices.clone()),
        },
        label: param.label.clone(),
        group: param.group.clone(),
        unit: param.unit.clone(),
        help: param.help.clone(),
        minimum: param.minimum,
        maximum: param.maximum,
        default_value: param.default,
        value: value(param.id).unwrap_or(param.default),
    });
    let params = params.collect();
    let own = name == info.id || info.name.eq_ignore_ascii_case(name);
    PluginView {
        instance: module,
        name: if own || name.is_empty() { info.name.clone() } else { format!("{} · {name}", info.name) },
        version: info.version.clone(),
        generation: 1,
        description: info.description.clone(),
        params,
        ..PluginView::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_way_that_is_stopped_is_hashed_and_shown_as_if_it_was_played() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sea.toml");
        std::fs::write(&path, "[scene]\nname = \"Sea\"\n").unwrap();
        let common = Common { assets: Some(folder.path().to_owned()), ..Common::default() };
        let mut sea = Sea::new(&common, &path, None, true, 1 << 20).unwrap();
        (0..40).for_each(|_| sea.step_once());
        let played = sea.chains.clone();
        sea.go_to(30, true);
        sea.stop();
        let step = sea.timeline.world.clock().step;
        assert!((2..30).contains(&step), "{step}");
        assert_eq!(sea.blend().current.step, step);
        let chain = sea.chain.expect("all steps are hashed");
        assert!(played.iter().any(|(at, played)| *at == step && played.digest == chain.digest));
    }
}
