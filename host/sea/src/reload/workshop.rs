//! The thread beside the sea: it looks at files, loads libraries, reads scenes, makes instances, and drops
//! what is no longer needed. The sea waits for none of it.

use std::{
    path::{Path, PathBuf},
    sync::{
        Arc,
        mpsc::{Receiver, RecvTimeoutError, Sender},
    },
    thread::Thread,
    time::Instant,
};

use reef_plugin::{Library, Plugin, Refusal, Registry, image::Image, inspect, probe};

use super::files::{Change, Files};
use crate::{
    WorldError,
    reload::{
        adopt::{Before, Edition},
        swap::Job,
    },
    scene,
};

/// What the thread is asked for.
pub(super) enum Task {
    /// The system says that files changed.
    Event(notify::Result<notify::Event>),
    /// Instances are wanted.
    Work(Arc<Job>),
    /// This is the scene that runs now, and what it would be made of if it changed.
    Stage(Box<Stage>),
    /// Nobody needs these any more.
    Drop(Box<dyn Send>),
    /// The end.
    Quit,
}

/// What the thread found.
pub(super) enum Found {
    /// A newer build.
    Library(NewLibrary),
    /// A build that nobody asks for, and the ids of its plugins.
    Unused { path: PathBuf, ids: Vec<String> },
    /// A build that is not used.
    Refused { path: PathBuf, problem: String },
    /// The scene, a species of it, or a file that a module read was edited.
    Scene { edition: Box<Edition> },
    /// An edit that is not used.
    BadScene { problem: String },
}

/// The scene that runs.
pub(super) struct Stage {
    pub(super) path: PathBuf,
    pub(super) assets: PathBuf,
    /// All files that were read for it, and by its modules.
    pub(super) files: Vec<PathBuf>,
    pub(super) seed: Option<u64>,
    pub(super) before: Before,
    pub(super) plugins: Registry,
    /// It changed while it was read: read it again.
    pub(super) again: bool,
}

/// A library that was just loaded.
#[derive(Debug)]
pub(super) struct NewLibrary {
    pub(super) path: PathBuf,
    pub(super) library: Arc<Library>,
    pub(super) plugins: Vec<Plugin>,
    /// When it was first seen to be whole.
    pub(super) seen: Instant,
    /// When it was loaded.
    pub(super) loaded: Instant,
}

/// The thread's side.
pub(super) struct Workshop {
    pub(super) files: Files,
    pub(super) tasks: Receiver<Task>,
    pub(super) found: Sender<Found>,
    /// The sea's thread, which may be asleep until its next step.
    pub(super) sea: Thread,
    pub(super) workers: usize,
    pub(super) stage: Option<Box<Stage>>,
}

impl Workshop {
    /// The thread's life.
    pub(super) fn run(mut self) {
        probe::prepare();
        loop {
            let wait = self.files.due().saturating_duration_since(Instant::now());
            let task = match self.tasks.recv_timeout(wait) {
                Ok(task) => Some(task),
                Err(RecvTimeoutError::Timeout) => {
                    self.poll();
                    continue;
                }
                Err(RecvTimeoutError::Disconnected) => None,
            };
            match task {
                None | Some(Task::Quit) => return,
                Some(Task::Event(event)) => self.files.hear(&event),
                Some(Task::Work(job)) => job.work(|| self.sea.unpark()),
                Some(Task::Stage(stage)) => self.set(stage),
                Some(Task::Drop(old)) => drop(old),
            }
        }
    }

    fn set(&mut self, stage: Box<Stage>) {
        // Of another scene, or of one that names more species: those that are watched already stay as they
        // are.
        self.files.add_all(&stage.files);
        let again = stage.again;
        self.stage = Some(stage);
        if again {
            self.read_scene();
        }
    }

    /// Reads the scene anew and makes what is new in it.
    fn read_scene(&mut self) {
        let Some(stage) = &self.stage else { return };
        let made = scene::load(&stage.path, &stage.assets, &stage.plugins)
            .map_err(WorldError::from)
            .and_then(|scene| {
                let mut files = scene.files.clone();
                let edition = Edition::new(scene, stage.seed, &stage.before, &stage.plugins)?;
                files.extend(edition.assets());
                Ok((edition, files))
            });
        let found = match made {
            Ok((edition, files)) => {
                // Now, not when the sea has taken it up: the next edit may be sooner.
                self.files.add_all(&files);
                Found::Scene { edition: Box::new(edition) }
            }
            Err(error) => Found::BadScene { problem: error.to_string() },
        };
        self.tell(found);
    }

    fn poll(&mut self) {
        let mut edited = false;
        for Change { path, content } in self.files.changes(is_whole) {
            let seen = Instant::now();
            let found = match content {
                Err(problem) => Found::Refused { path, problem },
                Ok(image) if is_library(&path) => self.meet(path, &image, seen),
                Ok(_) => {
                    edited = true;
                    continue;
                }
            };
            self.tell(found);
        }
        if edited {
            self.read_scene();
        }
    }

    /// Loads a build; one whose library was never loaded here is only looked at, by another process.
    fn meet(&self, path: PathBuf, image: &Image<'_>, seen: Instant) -> Found {
        let refused = |path, reason: Refusal| Found::Refused { path, problem: reason.to_string() };
        if self.is_unused(&path) {
            match probe::look(&path, image) {
                Ok(Some(ids)) => return Found::Unused { path, ids },
                // Nobody looks at builds here.
                Ok(None) => {}
                Err(reason) => return refused(path, reason),
            }
        }
        match Library::load_new_image(&path, image, self.workers) {
            Ok((library, plugins)) => {
                Found::Library(NewLibrary { path, library, plugins, seen, loaded: Instant::now() })
            }
            Err(reason) => refused(path, reason),
        }
    }

    /// Was no build of this library loaded?
    fn is_unused(&self, path: &Path) -> bool {
        // Cargo's folder of the newer builds has the same names.
        let is_it = |known: &Path| known == path || known.file_name() == path.file_name();
        let loaded = self.stage.iter().flat_map(|stage| stage.plugins.plugins());
        self.stage.is_some() && !loaded.filter_map(|plugin| plugin.library().path()).any(is_it)
    }

    fn tell(&self, found: Found) {
        // A sea that is gone needs nothing any more.
        let _ = self.found.send(found);
        self.sea.unpark();
    }
}

pub(super) fn is_library(path: &Path) -> bool {
    path.to_string_lossy().ends_with(std::env::consts::DLL_SUFFIX)
}

/// May this content be used, or is it a part of what is to come?
fn is_whole(path: &Path, image: &Image<'_>) -> bool {
    if !is_library(path) {
        return image.length() > 0;
    }
    let head = inspect::inspect(image);
    !matches!(head, Err(Refusal::Empty | Refusal::Cut { .. } | Refusal::NoLibrary(_)))
}
