//! What was loaded of each library: which generation runs, which older one could take over, what was refused
//! and why.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
    time::{Duration, Instant},
};

use reef_plugin::{Library, Plugin, Registry};

use crate::World;

/// One loading of a library.
#[derive(Debug)]
struct Generation {
    /// From 1, for each library.
    number: u64,
    library: Arc<Library>,
    plugins: Vec<Plugin>,
    since: Instant,
    /// When a newer one took its place.
    superseded: Option<Instant>,
    /// A fault of it was seen: it takes over from nobody.
    faulty: bool,
}

/// A library's file and what came of it.
#[derive(Debug)]
struct Line {
    path: PathBuf,
    generations: Vec<Generation>,
    count: u64,
    trouble: Option<String>,
}

/// What people are told about the library of a module.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Standing {
    /// How many times its library was loaded until the one that runs, from 1.
    pub generation: u64,
    /// How long that one has been running [s].
    pub age: f64,
    /// The last refusal or fault; None: all is well.
    pub trouble: Option<String>,
}

/// All libraries that the registry loaded, and their newer generations.
#[derive(Debug, Default)]
pub(super) struct Ledger {
    lines: Vec<Line>,
}

impl Ledger {
    pub(super) fn new(plugins: &Registry) -> Self {
        let mut ledger = Self::default();
        ledger.learn(plugins);
        ledger
    }

    /// Takes in what the registry has loaded since.
    pub(super) fn learn(&mut self, plugins: &Registry) {
        let unknown = |plugin: &&Plugin| self.of(plugin).is_none();
        let mut new: Vec<(Arc<Library>, Vec<Plugin>)> = Vec::new();
        for plugin in plugins.plugins().into_iter().filter(unknown) {
            match new.iter_mut().find(|(library, _)| Arc::ptr_eq(library, plugin.library())) {
                Some((_, plugins)) => plugins.push(plugin.clone()),
                None => new.push((plugin.library().clone(), vec![plugin.clone()])),
            }
        }
        for (library, plugins) in new {
            if let Some(path) = library.path().map(Path::to_owned) {
                self.add(&path, library, plugins);
            }
        }
    }

    fn line(&mut self, path: &Path) -> Option<&mut Line> {
        self.lines.iter_mut().find(|line| line.path == path)
    }

    /// The path under which a file is known: its own, or that of the library of the same name whose newer
    /// build it is.
    pub(super) fn known(&self, path: &Path) -> Option<PathBuf> {
        let same = |line: &&Line| line.path == path;
        // Cargo leaves the newer one in `deps` beside the one that is used, or the other way round.
        let beside = |line: &&Line| {
            line.path.file_name() == path.file_name()
                && (path.parent().and_then(Path::parent) == line.path.parent()
                    || line.path.parent().and_then(Path::parent) == path.parent())
        };
        let line = self.lines.iter().find(same).or_else(|| self.lines.iter().find(beside))?;
        Some(line.path.clone())
    }

    /// A generation runs from now on; returns its number.
    pub(super) fn add(&mut self, path: &Path, library: Arc<Library>, plugins: Vec<Plugin>) -> u64 {
        let now = Instant::now();
        if self.line(path).is_none() {
            let path = path.to_owned();
            self.lines.push(Line { path, generations: Vec::new(), count: 0, trouble: None });
        }
        let Some(line) = self.line(path) else { return 0 };
        line.count += 1;
        line.trouble = None;
        for older in &mut line.generations {
            older.superseded.get_or_insert(now);
        }
        let (number, since) = (line.count, now);
        let new = Generation { number, library, plugins, since, superseded: None, faulty: false };
        line.generations.push(new);
        number
    }

    /// A build was refused, or a fault was seen.
    pub(super) fn trouble(&mut self, path: &Path, text: &str) {
        if let Some(line) = self.line(path) {
            line.trouble = Some(text.to_owned());
        }
    }

    /// A fault of a plugin's generation was seen.
    pub(super) fn fault(&mut self, plugin: &Plugin, text: &str) {
        for line in &mut self.lines {
            for generation in &mut line.generations {
                if Arc::ptr_eq(&generation.library, plugin.library()) {
                    generation.faulty = true;
                    line.trouble = Some(text.to_owned());
                }
            }
        }
    }

    /// The file of a plugin's library, as it was first found.
    pub(super) fn path_of(&self, plugin: &Plugin) -> Option<&Path> {
        self.of(plugin).map(|(line, _)| line.path.as_path())
    }

    fn of(&self, plugin: &Plugin) -> Option<(&Line, &Generation)> {
        self.lines.iter().find_map(|line| {
            let own = |generation: &&Generation| Arc::ptr_eq(&generation.library, plugin.library());
            Some((line, line.generations.iter().find(own)?))
        })
    }

    /// The newest generation of a plugin without a fault, other than the one that runs.
    pub(super) fn older(&self, plugin: &Plugin) -> Option<(u64, Plugin)> {
        let (line, own) = self.of(plugin)?;
        let sound = line.generations.iter().rev().filter(|g| !g.faulty && g.number != own.number);
        sound
            .flat_map(|g| g.plugins.iter().map(move |p| (g.number, p.clone())))
            .find(|(_, p)| p.info().id == plugin.info().id)
    }

    /// The newest generation of a plugin, sound or not.
    pub(super) fn newest(&self, plugin: &Plugin) -> Option<Plugin> {
        let (line, _) = self.of(plugin)?;
        let all = line.generations.iter().rev().flat_map(|g| &g.plugins);
        all.into_iter().find(|p| p.info().id == plugin.info().id).cloned()
    }

    /// For people.
    pub(super) fn standing(&self, plugin: &Plugin) -> Standing {
        match self.of(plugin) {
            Some((line, own)) => Standing {
                generation: own.number,
                age: own.since.elapsed().as_secs_f64(),
                trouble: line.trouble.clone(),
            },
            None => Standing { generation: 1, ..Standing::default() },
        }
    }

    /// Takes the generations out that nobody needs any more: all but the newest and the last sound one before
    /// it, and that one too when its place was taken `grace` ago. Whoever drops them waits until they are
    /// closed.
    pub(super) fn retire(&mut self, world: &World, grace: Duration) -> Vec<(Arc<Library>, Vec<Plugin>)> {
        let mut retired = Vec::new();
        for line in &mut self.lines {
            let Some(newest) = line.generations.last().map(|newest| newest.number) else { continue };
            let sound = line.generations.iter().rev().filter(|g| g.number < newest && !g.faulty);
            let spare = sound.map(|g| g.number).next();
            let over = |g: &Generation| g.superseded.is_some_and(|since| since.elapsed() >= grace);
            let (kept, gone) = std::mem::take(&mut line.generations).into_iter().partition(|g| {
                g.number == newest || (Some(g.number) == spare && !over(g)) || used(&g.library, world)
            });
            line.generations = kept;
            let gone: Vec<Generation> = gone;
            retired.extend(gone.into_iter().map(|generation| (generation.library, generation.plugins)));
        }
        retired
    }
}

/// Does a module run this library's code?
fn used(library: &Arc<Library>, world: &World) -> bool {
    (0..world.modules().len()).any(|module| {
        world.instance(module).is_some_and(|instance| Arc::ptr_eq(instance.plugin().library(), library))
    })
}
