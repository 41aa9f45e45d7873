//! Files that may change while the sea runs, looked at through their folders: a file that is renamed over,
//! made anew or overwritten in place is read once it is whole, and whatever came last is read last.
//!
//! A file counts as changed when its bytes differ from those that were read last: no clock is fine enough for
//! builds in a row. The debug information of libraries is left out, see [`Image`]. It is whole when the
//! kernel says that nobody has it open for writing (see [`super::lease`]); where it does not tell, when it
//! was closed or renamed into place, or has been quiet for a while.

use std::{
    collections::HashMap,
    ffi::OsString,
    fs::{self, File},
    io,
    path::{Path, PathBuf},
    sync::Arc,
    time::{Duration, Instant, SystemTime},
};

use notify::{
    Event, EventKind, RecommendedWatcher, RecursiveMode, Watcher,
    event::{AccessKind, AccessMode, CreateKind, ModifyKind, RemoveKind, RenameMode},
};
use reef_files::bounded;
use reef_plugin::image::Image;

use super::lease::{Lease, Writers};

/// Where nobody says that a file is whole: it has not changed for so long.
const QUIET: Duration = Duration::from_millis(150);
/// Between two looks at a file that is not whole.
const AGAIN: Duration = Duration::from_millis(4);
/// A file that is not whole for so long is told about.
const PATIENCE: Duration = Duration::from_millis(600);
/// Between two tries to watch a folder that is gone.
const FOLDER: Duration = Duration::from_millis(250);
/// Largest file that is read [bytes].
const LARGEST: u64 = 1 << 30;

/// What is known of a file's content without reading it.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Stamp {
    inode: (u64, u64),
    length: u64,
    modified: Option<SystemTime>,
    /// Seconds and nanoseconds of the last change of any kind.
    changed: (i64, i64),
}

fn stamp(file: &File) -> Option<Stamp> {
    let data = file.metadata().ok()?;
    #[cfg(unix)]
    let (inode, changed) = {
        use std::os::unix::fs::MetadataExt;
        // The number of links is part of what changes the last of these, not of the content: cargo links and
        // unlinks.
        ((data.dev(), data.ino()), (data.mtime(), data.mtime_nsec()))
    };
    #[cfg(not(unix))]
    let (inode, changed) = ((0, 0), (0, 0));
    Some(Stamp { inode, length: data.len(), modified: data.modified().ok(), changed })
}

#[derive(Debug)]
struct Dirty {
    since: Instant,
    /// The last event.
    heard: Instant,
    /// An event said that it is whole.
    closed: bool,
    next: Instant,
}

#[derive(Debug, Default)]
struct Known {
    /// Of what was there when the watch began.
    stamp: Option<Stamp>,
    /// What was read last.
    last: Option<Arc<Image<'static>>>,
    dirty: Option<Dirty>,
}

/// A change that is ready to be used.
#[derive(Debug)]
pub(super) struct Change {
    /// The file, as it was named to [`Files::add`], or in a folder as that was.
    pub(super) path: PathBuf,
    /// What is in it; `Err`: why it cannot be read, or is not whole in spite of all patience.
    pub(super) content: Result<Arc<Image<'static>>, String>,
}

/// The files and folders that are watched.
pub(super) struct Files {
    watcher: RecommendedWatcher,
    /// By the folder's real path: how it was named.
    folders: HashMap<PathBuf, Folder>,
    /// By real folder and name.
    known: HashMap<(PathBuf, OsString), Known>,
}

#[derive(Debug)]
struct Folder {
    named: PathBuf,
    /// Every library in it counts, whether somebody named it or not.
    libraries: bool,
    lost: Option<Instant>,
}

impl Files {
    pub(super) fn new(watcher: RecommendedWatcher) -> Self {
        Self { watcher, folders: HashMap::new(), known: HashMap::new() }
    }

    /// Watches a folder. `libraries`: every dynamic library in it counts.
    pub(super) fn add_folder(&mut self, folder: &Path, libraries: bool) -> Result<PathBuf, String> {
        let named = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let told = |error: &dyn std::fmt::Display| format!("{} cannot be watched: {error}", named.display());
        let real = named.canonicalize().map_err(|error| told(&error))?;
        match self.folders.get_mut(&real) {
            Some(known) => known.libraries |= libraries,
            None => {
                self.watcher.watch(&real, RecursiveMode::NonRecursive).map_err(|error| told(&error))?;
                let folder = Folder { named: named.to_owned(), libraries, lost: None };
                self.folders.insert(real.clone(), folder);
            }
        }
        Ok(real)
    }

    /// Watches a file: its present content is known already.
    pub(super) fn add(&mut self, path: &Path) -> Result<(), String> {
        let (Some(folder), Some(name)) = (path.parent(), path.file_name()) else {
            return Err(format!("{} names no file", path.display()));
        };
        let real = self.add_folder(folder, false)?;
        // A file that is watched already may have changed since it was read: its present stamp would hide
        // that.
        self.known.entry((real, name.to_owned())).or_insert_with(|| Known {
            stamp: bounded::open(path).ok().as_ref().and_then(stamp),
            ..Known::default()
        });
        Ok(())
    }

    /// Watches files without which the sea goes on; those that cannot be watched are told about.
    pub(super) fn add_all(&mut self, paths: &[PathBuf]) {
        for problem in paths.iter().filter_map(|path| self.add(path).err()) {
            tracing::warn!("{problem}");
        }
    }

    /// Takes an event of the watcher.
    pub(super) fn hear(&mut self, event: &notify::Result<Event>) {
        let now = Instant::now();
        let event = match event {
            Ok(event) => event,
            Err(error) => {
                tracing::warn!("watching files: {error}");
                return;
            }
        };
        if event.need_rescan() {
            // Events were lost: everything may have changed.
            let all: Vec<_> = self.known.keys().cloned().collect();
            all.into_iter().for_each(|key| self.touch(key, now, false));
            return;
        }
        let closed = match event.kind {
            EventKind::Access(AccessKind::Close(AccessMode::Write)) => true,
            EventKind::Modify(ModifyKind::Name(RenameMode::To | RenameMode::Both)) => true,
            EventKind::Create(CreateKind::Folder) | EventKind::Access(_) => return,
            EventKind::Modify(ModifyKind::Metadata(_)) => return,
            EventKind::Remove(kind) => {
                for path in &event.paths {
                    if kind != RemoveKind::File
                        && let Some(folder) = self.folders.get_mut(path)
                    {
                        folder.lost = Some(now);
                    }
                }
                return;
            }
            _ => false,
        };
        for path in &event.paths {
            if let (Some(folder), Some(name)) = (path.parent(), path.file_name()) {
                self.touch((folder.to_owned(), name.to_owned()), now, closed);
            }
        }
    }

    fn touch(&mut self, key: (PathBuf, OsString), now: Instant, closed: bool) {
        let wanted = self.known.contains_key(&key)
            || self.folders.get(&key.0).is_some_and(|folder| {
                folder.libraries
                    && Path::new(&key.1).to_string_lossy().ends_with(std::env::consts::DLL_SUFFIX)
            });
        if wanted {
            let known = self.known.entry(key).or_default();
            let dirty = known.dirty.get_or_insert(Dirty { since: now, heard: now, closed, next: now });
            (dirty.heard, dirty.next) = (now, now);
            // A later write opens it again.
            dirty.closed = closed;
        }
    }

    /// When to look again; None: when something is heard.
    pub(super) fn due(&self) -> Option<Instant> {
        let files = self.known.values().filter_map(|known| Some(known.dirty.as_ref()?.next));
        let folders = self.folders.values().filter_map(|folder| Some(folder.lost? + FOLDER));
        files.chain(folders).min()
    }

    /// Files that changed and are whole now. `whole`: may this content be used, or is it a part of what is to
    /// come?
    pub(super) fn changes(&mut self, whole: impl Fn(&Path, &Image<'_>) -> bool) -> Vec<Change> {
        let now = Instant::now();
        self.find_lost_folders(now);
        let mut changes = Vec::new();
        for ((folder, name), known) in &mut self.known {
            let Some(dirty) = known.dirty.as_mut().filter(|dirty| dirty.next <= now) else { continue };
            let named = self.folders.get(folder).map_or(folder, |folder| &folder.named);
            let path = named.join(name);
            let patient =
                now.duration_since(dirty.since) < PATIENCE || now.duration_since(dirty.heard) < QUIET;
            dirty.next = now + AGAIN;
            match look(&path, known.stamp.as_ref(), known.last.as_deref(), dirty, now, &whole) {
                Look::Same => known.dirty = None,
                Look::Later if patient => {}
                Look::Later => {
                    // It may be written for long: the next event, or the next patience, looks again.
                    dirty.since = now;
                    dirty.next = now + PATIENCE;
                }
                Look::Part(_) if patient => {}
                Look::Part(image) | Look::Whole(image) => {
                    let image = Arc::new(image);
                    (known.stamp, known.last, known.dirty) = (None, Some(image.clone()), None);
                    changes.push(Change { path, content: Ok(image) });
                }
                Look::Gone => known.dirty = None,
                Look::Unreadable(_) if patient => {}
                Look::Unreadable(problem) => {
                    known.dirty = None;
                    changes.push(Change { path, content: Err(problem) });
                }
            }
        }
        changes
    }

    fn find_lost_folders(&mut self, now: Instant) {
        let mut found = Vec::new();
        for (real, folder) in &mut self.folders {
            if let Some(lost) = folder.lost.filter(|lost| *lost + FOLDER <= now) {
                folder.lost = Some(lost.max(now));
                // The watch of the folder that was there is gone with it.
                let _ = self.watcher.unwatch(real);
                if real.is_dir() && self.watcher.watch(real, RecursiveMode::NonRecursive).is_ok() {
                    folder.lost = None;
                    found.push(real.clone());
                }
            }
        }
        for real in found {
            let here = self.known.keys().filter(|(folder, _)| *folder == real).cloned().collect::<Vec<_>>();
            here.into_iter().for_each(|key| self.touch(key, now, false));
            for entry in fs::read_dir(&real).into_iter().flatten().flatten() {
                self.touch((real.clone(), entry.file_name()), now, false);
            }
        }
    }
}

enum Look {
    /// Read before.
    Same,
    /// Somebody writes it.
    Later,
    /// Whole as far as the system tells, but a part by its content.
    Part(Image<'static>),
    Whole(Image<'static>),
    Gone,
    Unreadable(String),
}

fn look(
    path: &Path,
    known: Option<&Stamp>,
    last: Option<&Image<'_>>,
    dirty: &Dirty,
    now: Instant,
    whole: &impl Fn(&Path, &Image<'_>) -> bool,
) -> Look {
    let file = match bounded::open(path) {
        Ok(file) => file,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Look::Gone,
        Err(error) => return Look::Unreadable(format!("cannot be read: {error}")),
    };
    let Some(before) = stamp(&file) else { return Look::Later };
    if known == Some(&before) {
        return Look::Same;
    }
    if before.length > LARGEST || !file.metadata().is_ok_and(|data| data.is_file()) {
        return Look::Unreadable(format!("is no file of at most {LARGEST} bytes"));
    }
    let lease = Lease::new(&file);
    let quiet = now.duration_since(dirty.heard) >= QUIET;
    match lease.writers {
        Writers::None => {}
        Writers::Some => return Look::Later,
        Writers::Unknown if dirty.closed || quiet => {}
        Writers::Unknown => return Look::Later,
    }
    let image = match Image::read(&file, before.length) {
        Ok(image) => image,
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => return Look::Later,
        Err(error) => return Look::Unreadable(format!("cannot be read: {error}")),
    };
    if lease.writers == Writers::Unknown && stamp(&file) != Some(before) {
        return Look::Later;
    }
    match last {
        Some(last) if *last == image => Look::Same,
        _ if whole(path, &image) => Look::Whole(image),
        _ => Look::Part(image),
    }
}
