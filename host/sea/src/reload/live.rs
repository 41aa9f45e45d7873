//! A sea whose code and scene change while it runs.
//!
//! The sea's thread calls [`Live::tend`] between two steps, which never waits; all that takes time happens on
//! the thread of `workshop`.

use std::{
    collections::VecDeque,
    path::{Path, PathBuf},
    sync::{
        Arc,
        mpsc::{self, Receiver, Sender},
    },
    thread::{self, JoinHandle},
    time::{Duration, Instant},
};

use reef_plugin::{Health, Plugin, Registry};

use super::{
    Standing,
    adopt::Edition,
    files::Files,
    ledger::Ledger,
    news::{Arrival, Counts, Gravity, Notice, Tended},
    swap::{Job, Purpose, Swap},
    workshop::{Found, NewLibrary, Stage, Task, Workshop},
};
use crate::World;

/// Steps between two saved states of a module, for [`crate::Options::remember`].
pub const REMEMBER: u64 = 60;
/// An older build stays loaded for so long after a newer one took its place.
pub const GRACE: Duration = Duration::from_secs(60);
/// Instances that have not reached the present by then are waited for.
const CHASE: Duration = Duration::from_secs(2);

/// Something to be done, one at a time.
#[derive(Debug)]
enum Wish {
    Reload(NewLibrary),
    Takeover(Vec<usize>),
    Retry(usize),
    Scene(Box<Edition>),
}

/// What is being done.
#[derive(Debug)]
struct Running {
    job: Arc<Job>,
    /// The build that is tried; None: it is one that was known before.
    library: Option<NewLibrary>,
    modules: Vec<usize>,
}

/// The sea's side of all that changes while it runs.
pub struct Live {
    tasks: Sender<Task>,
    found: Receiver<Found>,
    thread: Option<JoinHandle<()>>,
    registry: Registry,
    ledger: Ledger,
    wishes: VecDeque<Wish>,
    running: Option<Running>,
    notices: VecDeque<Notice>,
    counts: Counts,
    arrival: Option<Arrival>,
    grace: Duration,
    workers: usize,
    /// Of the command line.
    seed: Option<u64>,
    assets: PathBuf,
}

/// What a sea that may change has to know from the start.
#[derive(Clone, Debug)]
pub struct Setup {
    /// The plugins that were found.
    pub plugins: Registry,
    /// Folders in which more may appear.
    pub folders: Vec<PathBuf>,
    /// Threads that simulate.
    pub workers: usize,
    /// In place of the scenes' seeds.
    pub seed: Option<u64>,
    /// Where species are found.
    pub assets: PathBuf,
}

impl Live {
    /// Begins to watch the files of all plugins and of the scene, and folders for more. Called by the sea's
    /// own thread, which is woken when there is something to tend.
    pub fn new(setup: Setup, world: &World) -> Result<Self, String> {
        let Setup { plugins: registry, folders, workers, seed, assets } = setup;
        let (tasks, received) = mpsc::channel();
        let (telling, found) = mpsc::channel();
        let events = tasks.clone();
        let watcher = notify::recommended_watcher(move |event| {
            // Nobody listens any more at the end.
            let _ = events.send(Task::Event(event));
        });
        let mut files = Files::new(watcher);
        let ledger = Ledger::new(&registry);
        for path in registry.paths() {
            files.add(path);
            watch_twins(&mut files, path);
        }
        for folder in &folders {
            files.add_folder(folder, true);
        }
        // The scene's, too, and here: what is edited before the thread beside has begun must not pass for
        // what was read.
        files.add_all(&world.files());
        let sea = thread::current();
        let workshop = Workshop { files, tasks: received, found: telling, sea, workers, stage: None };
        let thread = thread::Builder::new()
            .name("reef-workshop".to_owned())
            .spawn(move || workshop.run())
            .map_err(|error| format!("no thread to watch files with: {error}"))?;
        let live = Self {
            tasks,
            found,
            thread: Some(thread),
            registry,
            ledger,
            wishes: VecDeque::new(),
            running: None,
            notices: VecDeque::new(),
            counts: Counts::default(),
            arrival: None,
            grace: GRACE,
            workers,
            seed,
            assets,
        };
        live.stage(world, false);
        Ok(live)
    }

    /// Another sea stands in the place of the one that was tended so far.
    pub fn moved(&mut self, world: &World) {
        if let Some(Running { job, library, .. }) = self.running.take() {
            job.cancel();
            library.into_iter().for_each(|new| self.wishes.push_front(Wish::Reload(new)));
        }
        self.wishes.retain(|wish| matches!(wish, Wish::Reload(_)));
        self.ledger.learn(&self.registry);
        self.stage(world, false);
    }

    /// Tells the thread beside what runs now.
    fn stage(&self, world: &World, again: bool) {
        let stage = Stage {
            path: world.scene().path.clone(),
            assets: self.assets.clone(),
            files: world.files(),
            seed: self.seed,
            before: world.before(),
            plugins: self.registry.clone(),
            again,
        };
        let _ = self.tasks.send(Task::Stage(Box::new(stage)));
    }

    /// Keeps older builds for another time than [`GRACE`].
    pub fn set_grace(&mut self, grace: Duration) {
        self.grace = grace;
    }

    /// The plugins as they are now.
    pub fn plugins(&self) -> &Registry {
        &self.registry
    }

    /// What has happened so far.
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// When the build came whose instances were the last to take others' places.
    pub fn arrival(&self) -> Option<Arrival> {
        self.arrival
    }

    /// What people should know and nobody took yet. The log has it already.
    pub fn take_notices(&mut self) -> Vec<Notice> {
        self.notices.drain(..).collect()
    }

    /// How the library of a module stands.
    pub fn standing(&self, world: &World, module: usize) -> Standing {
        let plugin = world.instance(module).map(|instance| instance.plugin());
        plugin.map_or_else(Standing::default, |plugin| self.ledger.standing(plugin))
    }

    /// Gives a module that stands still another chance: a new instance of the newest build, from its last
    /// good state.
    pub fn retry(&mut self, module: usize) {
        self.wishes.push_back(Wish::Retry(module));
    }

    /// Does what is ready to be done between two steps.
    pub fn tend(&mut self, world: &mut World) -> Tended {
        let mut tended = Tended::default();
        while let Ok(found) = self.found.try_recv() {
            self.ledger.learn(&self.registry);
            match found {
                Found::Library(new) => self.wish_for(new),
                Found::Refused { path, problem } => self.refuse(world, &path, &problem),
                Found::Unused { path, ids } => self.learn(world, &path, &ids),
                Found::Scene { edition } => self.wishes.push_back(Wish::Scene(edition)),
                Found::BadScene { problem } => {
                    let text = format!("{problem}: the scene runs on as it was");
                    self.tell(world, Gravity::Trouble, text);
                }
            }
        }
        self.hear_faults(world);
        if let Some(Running { job, .. }) = &self.running {
            let job = job.clone();
            if job.began().elapsed() > CHASE {
                job.wait(world.clock().step, Duration::from_millis(250));
            }
            match world.swap(&job) {
                Swap::NotYet => {}
                Swap::Done(former) => {
                    tended.swapped = true;
                    self.drop_later(former);
                    self.conclude(world);
                }
                Swap::Failed(problem) => self.give_up(world, &problem),
                Swap::Lost => {
                    let library = self.running.take().and_then(|running| running.library);
                    library.into_iter().for_each(|new| self.wishes.push_front(Wish::Reload(new)));
                }
            }
        }
        while self.running.is_none()
            && let Some(wish) = self.wishes.pop_front()
        {
            match wish {
                Wish::Scene(edition) => tended.edited |= self.adopt(world, *edition),
                wish => self.begin(world, wish),
            }
        }
        for retired in self.ledger.retire(world, self.grace) {
            self.drop_later(retired);
        }
        tended
    }

    /// A build that no module uses: it is loaded when a scene asks for it.
    fn learn(&mut self, world: &World, path: &Path, ids: &[String]) {
        if let Err(reason) = self.registry.learn(path, ids, self.workers) {
            return self.refuse(world, path, &reason.to_string());
        }
        self.stage(world, false);
        let text = format!("{} has {}; no module of this scene uses it", path.display(), ids.join(", "));
        self.tell(world, Gravity::Info, text);
    }

    /// A newer build; one that waits for its turn is older still, and is let go.
    fn wish_for(&mut self, new: NewLibrary) {
        let same = |wish: &Wish| matches!(wish, Wish::Reload(waiting) if waiting.path == new.path);
        if let Some(at) = self.wishes.iter().position(same) {
            let older = self.wishes.remove(at);
            self.drop_later(older);
        }
        self.wishes.push_back(Wish::Reload(new));
    }

    /// Modules that failed: those of one library get help together.
    fn hear_faults(&mut self, world: &mut World) {
        let mut groups: Vec<(Plugin, Vec<usize>)> = Vec::new();
        for fault in world.take_faults().into_iter().filter(|fault| fault.grave) {
            let Some(instance) = world.instance(fault.module) else { continue };
            let plugin = instance.plugin().clone();
            self.ledger.fault(&plugin, &format!("step {}: {}", fault.step, fault.text));
            let same = |group: &&mut (Plugin, Vec<usize>)| Arc::ptr_eq(group.0.library(), plugin.library());
            match groups.iter_mut().find(same) {
                Some((_, modules)) => modules.push(fault.module),
                None => groups.push((plugin, vec![fault.module])),
            }
        }
        self.wishes.extend(groups.into_iter().map(|(_, modules)| Wish::Takeover(modules)));
    }

    fn begin(&mut self, world: &mut World, wish: Wish) {
        match wish {
            Wish::Reload(new) => self.begin_reload(world, new),
            Wish::Takeover(modules) => self.begin_takeover(world, &modules),
            // Taken up by `tend`: there is nothing to wait for.
            Wish::Scene(..) => {}
            Wish::Retry(module) => {
                let newest = world.instance(module).map(|instance| {
                    self.ledger.newest(instance.plugin()).unwrap_or_else(|| instance.plugin().clone())
                });
                let job = newest.and_then(|plugin| world.order_retry(module, &plugin));
                self.work(job, None, vec![module]);
            }
        }
    }

    /// Takes up an edited scene.
    fn adopt(&mut self, world: &mut World, edition: Edition) -> bool {
        let adopted = match world.adopt(edition) {
            Ok(adopted) => adopted,
            Err(edition) => {
                self.drop_later(edition);
                self.stage(world, true);
                return false;
            }
        };
        self.counts.scenes += 1;
        self.stage(world, false);
        self.drop_later(adopted.former);
        let list = |names: &[String]| if names.is_empty() { "nothing".to_owned() } else { names.join(", ") };
        let mut text = format!("{}: carried on: {}", world.scene().path.display(), list(&adopted.carried));
        if !adopted.anew.is_empty() {
            text += &format!(
                "; began anew, because it is new, set differently or reads other files: {}",
                adopted.anew.join(", ")
            );
        }
        self.tell(world, Gravity::Info, text);
        true
    }

    fn begin_reload(&mut self, world: &mut World, new: NewLibrary) {
        let path = self.ledger.known(&new.path).unwrap_or_else(|| new.path.clone());
        if let Err(problem) = self.fits(world, &path, &new) {
            self.refuse(world, &path, &problem);
            self.drop_later(new);
            return;
        }
        let modules = users(world, &new.plugins);
        match world.order_reload(&new.plugins) {
            Ok(None) => {
                let text = self.take(world, &path, new);
                self.tell(world, Gravity::Info, format!("{text}; no module of this scene uses it"));
            }
            Ok(job) => self.work(job, Some(NewLibrary { path, ..new }), modules),
            Err(error) => {
                self.refuse(world, &path, &format!("the running one does not give its state: {error}"));
                self.drop_later(new);
            }
        }
    }

    /// May the plugins of a build stand in for those of the build before?
    fn fits(&self, world: &World, path: &Path, new: &NewLibrary) -> Result<(), String> {
        let has = |id: &str| new.plugins.iter().any(|plugin| plugin.info().id == id);
        for module in 0..world.modules().len() {
            let Some(plugin) = world.instance(module).map(|instance| instance.plugin()) else { continue };
            if self.ledger.path_of(plugin) == Some(path) && !has(&plugin.info().id) {
                return Err(format!(
                    "it has no plugin `{}` any more, which the scene uses",
                    plugin.info().id
                ));
            }
        }
        for plugin in &new.plugins {
            let first = self.registry.loaded(&plugin.info().id).and_then(|first| self.ledger.path_of(first));
            if let Some(first) = first.filter(|first| *first != path) {
                return Err(format!(
                    "its plugin `{}` is already there: {}",
                    plugin.info().id,
                    first.display()
                ));
            }
        }
        Ok(())
    }

    fn begin_takeover(&mut self, world: &mut World, modules: &[usize]) {
        let mut older = Vec::new();
        let mut number = 0;
        for &module in modules {
            let Some(instance) = world.instance(module) else { continue };
            if *instance.health() == Health::Running {
                continue; // A newer build took its place meanwhile.
            }
            match self.ledger.older(instance.plugin()) {
                Some((generation, plugin)) => {
                    number = generation;
                    older.push((module, plugin));
                }
                None => {
                    let name = name(world, module);
                    let text = format!(
                        "{name} stands still: there is no older build to take over (retry, or save a newer one)"
                    );
                    self.tell(world, Gravity::Trouble, text);
                }
            }
        }
        if older.is_empty() {
            return;
        }
        match world.order_takeover(&older) {
            Some(job) => {
                let modules: Vec<usize> = older.iter().map(|(module, _)| *module).collect();
                let names = names(world, &modules);
                self.tell(world, Gravity::Info, format!("{names}: generation {number} is to take over"));
                self.work(Some(job), None, modules);
            }
            None => {
                let modules: Vec<usize> = older.iter().map(|(module, _)| *module).collect();
                let text = format!("{} stands still: it has no saved state", names(world, &modules));
                self.tell(world, Gravity::Trouble, text);
            }
        }
    }

    fn work(&mut self, job: Option<Arc<Job>>, library: Option<NewLibrary>, modules: Vec<usize>) {
        let Some(job) = job else { return };
        // Without the thread nothing is loaded, so there is nothing to be worked on.
        let _ = self.tasks.send(Task::Work(job.clone()));
        self.running = Some(Running { job, library, modules });
    }

    /// The instances are in their places.
    fn conclude(&mut self, world: &World) {
        let Some(Running { job, library, modules }) = self.running.take() else { return };
        let names = names(world, &modules);
        match (job.purpose, library) {
            (_, Some(new)) => {
                let (seen, loaded, taken) = (new.seen, new.loaded, Instant::now());
                self.arrival = Some(Arrival { seen, loaded, taken });
                let took = (taken - seen).as_secs_f64() * 1e3;
                let path = new.path.clone();
                let text = self.take(world, &path, new);
                self.tell(world, Gravity::Info, format!("{text}: {names} carried on ({took:.1} ms)"));
            }
            (Purpose::Takeover, None) => {
                self.counts.takeovers += 1;
                let plugin = modules.first().and_then(|module| world.instance(*module)).map(|i| i.plugin());
                let number = plugin.map_or(0, |plugin| self.ledger.standing(plugin).generation);
                if let Some(plugin) = plugin {
                    let former = self.registry.replace(std::slice::from_ref(plugin));
                    self.stage(world, false);
                    self.drop_later(former);
                }
                self.tell(world, Gravity::Info, format!("{names}: generation {number} has taken over"));
            }
            (_, None) => {
                self.tell(world, Gravity::Info, format!("{names}: once more from the last good state"))
            }
        }
    }

    /// A build is the one that counts from now on; says so.
    fn take(&mut self, world: &World, path: &Path, new: NewLibrary) -> String {
        self.counts.reloads += 1;
        let what: Vec<String> =
            new.plugins.iter().map(|p| format!("{} {}", p.info().id, p.info().version)).collect();
        let former = self.registry.replace(&new.plugins);
        self.stage(world, false);
        self.drop_later(former);
        let number = self.ledger.add(path, new.library, new.plugins);
        format!("{} is generation {number}", what.join(", "))
    }

    /// What was being done cannot be done; the sea is as it was.
    fn give_up(&mut self, world: &World, problem: &str) {
        let Some(Running { job, library, modules }) = self.running.take() else { return };
        match (job.purpose, library) {
            (_, Some(new)) => {
                let path = new.path.clone();
                self.refuse(world, &path, problem);
                self.drop_later(new);
            }
            (Purpose::Takeover, None) => {
                let text =
                    format!("{} stands still: the older build fails, too: {problem}", names(world, &modules));
                self.tell(world, Gravity::Trouble, text);
            }
            (_, None) => {
                let text = format!("{} stands still: {problem}", names(world, &modules));
                self.tell(world, Gravity::Trouble, text);
            }
        }
    }

    fn refuse(&mut self, world: &World, path: &Path, problem: &str) {
        self.counts.refusals += 1;
        let known = self.ledger.known(path);
        let goes_on = if known.is_some() { "; the one that is loaded runs on" } else { "" };
        let text = format!("{} is refused: {problem}{goes_on}", path.display());
        self.ledger.trouble(&known.unwrap_or_else(|| path.to_owned()), &text);
        self.tell(world, Gravity::Trouble, text);
    }

    fn tell(&mut self, world: &World, gravity: Gravity, text: String) {
        let step = world.clock().step;
        match gravity {
            Gravity::Info => tracing::info!(step, "{text}"),
            Gravity::Trouble => tracing::warn!(step, "{text}"),
        }
        if self.notices.len() == 100 {
            self.notices.pop_front();
        }
        self.notices.push_back(Notice { gravity, step, text });
    }

    /// Dropping may wait for threads and run destructors: not here.
    fn drop_later(&self, old: impl Send + 'static) {
        let _ = self.tasks.send(Task::Drop(Box::new(old)));
    }
}

impl Drop for Live {
    fn drop(&mut self) {
        if let Some(Running { job, .. }) = self.running.take() {
            job.cancel();
        }
        let _ = self.tasks.send(Task::Quit);
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            tracing::error!("the thread that watches files ended early");
        }
    }
}

/// Cargo leaves the newer build of a library in `deps` beside the one that is used, or uses the one in
/// `deps`.
fn watch_twins(files: &mut Files, path: &Path) {
    let (Some(folder), Some(name)) = (path.parent(), path.file_name()) else { return };
    let twins = [folder.join("deps"), folder.parent().unwrap_or(folder).to_owned()];
    let used = if folder.ends_with("deps") { &twins[1] } else { &twins[0] };
    if used.is_dir() {
        files.add(&used.join(name));
    }
}

/// Modules that use one of these plugins.
fn users(world: &World, plugins: &[Plugin]) -> Vec<usize> {
    let uses = |id: &str| plugins.iter().any(|plugin| plugin.info().id == id);
    world.modules().enumerate().filter(|(_, (_, info))| uses(&info.id)).map(|(module, _)| module).collect()
}

fn name(world: &World, module: usize) -> String {
    world.modules().nth(module).map_or_else(String::new, |(name, _)| name.to_owned())
}

fn names(world: &World, modules: &[usize]) -> String {
    modules.iter().map(|module| name(world, *module)).collect::<Vec<_>>().join(", ")
}

impl std::fmt::Debug for Live {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Live").field("ledger", &self.ledger).finish_non_exhaustive()
    }
}

/// For tests and benches: waits for news until `end`, as a sea does that sleeps between two steps.
pub fn sleep_until(end: Instant) {
    let now = Instant::now();
    if end > now {
        thread::park_timeout(end - now);
    }
}
