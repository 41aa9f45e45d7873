//! Files that may change while the sea runs, looked at through their folders: a file that is renamed over,
//! made anew or overwritten in place is read once it is whole, and whatever came last is read last.
//!
//! A file counts as changed when its bytes differ from those that were read last: no clock is fine enough for
//! builds in a row. The debug information of libraries is left out, see [`Image`]. It is whole when the
//! kernel says that nobody has it open for writing (see [`super::lease`]); where it does not tell, when it
//! was closed or renamed into place, or has been quiet for a while.
//!
//! The system tells of a folder's own entries alone, on some file systems of nothing, and not to everybody.
//! So all files are looked at once a second, too, through the links that lead to them.

use std::{
    collections::HashMap,
    ffi::OsString,
    fs::{self, File, Metadata},
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
/// Between two looks at all files, whether anything was heard of them or not.
const ROUND: Duration = Duration::from_secs(1);
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

fn stamp(data: &Metadata) -> Stamp {
    #[cfg(unix)]
    let (inode, changed) = {
        use std::os::unix::fs::MetadataExt;
        // The number of links is part of what changes the last of these, not of the content: cargo links and
        // unlinks.
        ((data.dev(), data.ino()), (data.mtime(), data.mtime_nsec()))
    };
    #[cfg(not(unix))]
    let (inode, changed) = ((0, 0), (0, 0));
    Stamp { inode, length: data.len(), modified: data.modified().ok(), changed }
}

/// Of an open file.
fn stamp_of(file: &File) -> Option<Stamp> {
    file.metadata().ok().as_ref().map(stamp)
}

/// Of what a path leads to; None: to nothing.
fn stamp_at(path: &Path) -> Option<Stamp> {
    fs::metadata(path).ok().as_ref().map(stamp)
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
    /// Of what was there at the last poll; None: nothing was.
    seen: Option<Stamp>,
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
    /// None: the system tells this process nothing.
    watcher: Option<RecommendedWatcher>,
    /// By the folder's real path: how it was named.
    folders: HashMap<PathBuf, Folder>,
    /// By real folder and name.
    known: HashMap<(PathBuf, OsString), Known>,
    /// When all files are looked at next.
    round: Instant,
}

#[derive(Debug)]
struct Folder {
    named: PathBuf,
    /// Every library in it counts, whether somebody named it or not.
    libraries: bool,
    /// Of the folder itself, at the last poll: it changes with its entries.
    seen: Option<Stamp>,
    /// The system tells of it.
    watched: bool,
    lost: Option<Instant>,
}

impl Files {
    /// Without a watcher files are looked at once a second only, and somebody is told so.
    pub(super) fn new(watcher: notify::Result<RecommendedWatcher>) -> Self {
        let watcher = watcher
            .inspect_err(|error| {
                tracing::warn!(
                    "the system tells nothing of files that change ({error}): they are looked at once a \
                     second"
                );
            })
            .ok();
        Self { watcher, folders: HashMap::new(), known: HashMap::new(), round: Instant::now() + ROUND }
    }

    /// Watches a folder. `libraries`: every dynamic library in it counts. Where that cannot be, somebody is
    /// told; its files are looked at once a second in any case. Returns its real path.
    pub(super) fn add_folder(&mut self, folder: &Path, libraries: bool) -> PathBuf {
        let named = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let real = match named.canonicalize() {
            Ok(real) => real,
            Err(error) => {
                tracing::warn!("{}: {error}; it is looked for once a second", named.display());
                std::path::absolute(named).unwrap_or_else(|_| named.to_owned())
            }
        };
        if let Some(known) = self.folders.get_mut(&real) {
            known.libraries |= libraries;
            return real;
        }
        let mut watched = false;
        if let Some(watcher) = self.watcher.as_mut().filter(|_| real.is_dir()) {
            match watcher.watch(&real, RecursiveMode::NonRecursive) {
                Ok(()) => watched = true,
                Err(error) => tracing::warn!(
                    "{} cannot be watched ({error}): its files are looked at once a second",
                    named.display()
                ),
            }
        }
        let seen = stamp_at(named);
        let folder = Folder { named: named.to_owned(), libraries, seen, watched, lost: None };
        self.folders.insert(real.clone(), folder);
        real
    }

    /// Watches a file: its present content is known already.
    pub(super) fn add(&mut self, path: &Path) {
        let (Some(folder), Some(name)) = (path.parent(), path.file_name()) else {
            tracing::warn!("{} names no file: it is not watched", path.display());
            return;
        };
        let real = self.add_folder(folder, false);
        // A file that is watched already may have changed since it was read: its present stamp would hide
        // that.
        self.known.entry((real, name.to_owned())).or_insert_with(|| {
            let seen = stamp_at(path);
            Known { stamp: seen.clone(), seen, ..Known::default() }
        });
    }

    /// Watches files.
    pub(super) fn add_all(&mut self, paths: &[PathBuf]) {
        paths.iter().for_each(|path| self.add(path));
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

    /// When to poll again, even if nothing is heard.
    pub(super) fn due(&self) -> Instant {
        let files = self.known.values().filter_map(|known| Some(known.dirty.as_ref()?.next));
        let folders = self.folders.values().filter_map(|folder| Some(folder.lost? + FOLDER));
        files.chain(folders).fold(self.round, Instant::min)
    }

    /// Looks at all files, whether anything was heard of them or not.
    fn poll_all(&mut self, now: Instant) {
        self.round = now + ROUND;
        for ((folder, name), known) in &mut self.known {
            let named = self.folders.get(folder).map_or(folder, |folder| &folder.named);
            let here = stamp_at(&named.join(name));
            if here == known.seen {
                continue;
            }
            known.seen = here;
            match &mut known.dirty {
                _ if known.seen.is_none() => {}
                None => known.dirty = Some(Dirty { since: now, heard: now, closed: false, next: now }),
                Some(dirty) if !dirty.closed => dirty.heard = now,
                Some(_) => {}
            }
        }
        let mut new = Vec::new();
        for (real, folder) in &mut self.folders {
            if let Some(watcher) = self.watcher.as_mut().filter(|_| !folder.watched && real.is_dir()) {
                // It is there now, or others watch less.
                folder.watched = watcher.watch(real, RecursiveMode::NonRecursive).is_ok();
            }
            let here = stamp_at(&folder.named);
            if folder.libraries && here != folder.seen {
                new.extend(names_in(&folder.named).map(|name| (real.clone(), name)));
            }
            folder.seen = here;
        }
        new.retain(|key| !self.known.contains_key(key));
        new.into_iter().for_each(|key| self.touch(key, now, false));
    }

    /// Files that changed and are whole now. `whole`: may this content be used, or is it a part of what is to
    /// come?
    pub(super) fn changes(&mut self, whole: impl Fn(&Path, &Image<'_>) -> bool) -> Vec<Change> {
        let now = Instant::now();
        self.find_lost_folders(now);
        if self.round <= now {
            self.poll_all(now);
        }
        let mut changes = Vec::new();
        for ((folder, name), known) in &mut self.known {
            let Some(dirty) = known.dirty.as_mut().filter(|dirty| dirty.next <= now) else { continue };
            let named = self.folders.get(folder).map_or(folder, |folder| &folder.named);
            let path = named.join(name);
            let patient =
                now.duration_since(dirty.since) < PATIENCE || now.duration_since(dirty.heard) < QUIET;
            dirty.next = now + AGAIN;
            let last = known.last.as_deref();
            match poll(&path, known.stamp.as_ref(), &mut known.seen, last, dirty, now, &whole) {
                Polled::Same => known.dirty = None,
                Polled::Later if patient => {}
                Polled::Later => {
                    // It may be written for long: the next event, or the next patience, looks again.
                    dirty.since = now;
                    dirty.next = now + PATIENCE;
                }
                Polled::Part(_) if patient => {}
                Polled::Part(image) | Polled::Whole(image) => {
                    let image = Arc::new(image);
                    (known.stamp, known.last, known.dirty) = (None, Some(image.clone()), None);
                    changes.push(Change { path, content: Ok(image) });
                }
                Polled::Gone => known.dirty = None,
                Polled::Unreadable(_) if patient => {}
                Polled::Unreadable(problem) => {
                    known.dirty = None;
                    changes.push(Change { path, content: Err(problem) });
                }
            }
        }
        changes
    }

    fn find_lost_folders(&mut self, now: Instant) {
        let mut found = Vec::new();
        // Nothing is lost but what was watched.
        let Some(watcher) = &mut self.watcher else { return };
        for (real, folder) in &mut self.folders {
            if let Some(lost) = folder.lost.filter(|lost| *lost + FOLDER <= now) {
                folder.lost = Some(lost.max(now));
                // The watch of the folder that was there is gone with it.
                let _ = watcher.unwatch(real);
                if real.is_dir() && watcher.watch(real, RecursiveMode::NonRecursive).is_ok() {
                    folder.lost = None;
                    found.push(real.clone());
                }
            }
        }
        for real in found {
            let here = self.known.keys().filter(|(folder, _)| *folder == real).cloned().collect::<Vec<_>>();
            here.into_iter().for_each(|key| self.touch(key, now, false));
            names_in(&real).for_each(|name| self.touch((real.clone(), name), now, false));
        }
    }
}

fn names_in(folder: &Path) -> impl Iterator<Item = OsString> {
    fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.file_name())
}

enum Polled {
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

fn poll(
    path: &Path,
    known: Option<&Stamp>,
    seen: &mut Option<Stamp>,
    last: Option<&Image<'_>>,
    dirty: &Dirty,
    now: Instant,
    whole: &impl Fn(&Path, &Image<'_>) -> bool,
) -> Polled {
    let file = match bounded::open(path) {
        Ok(file) => file,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Polled::Gone,
        Err(error) => return Polled::Unreadable(format!("cannot be read: {error}")),
    };
    let Some(before) = stamp_of(&file) else { return Polled::Later };
    if known == Some(&before) {
        return Polled::Same;
    }
    if before.length > LARGEST || !file.metadata().is_ok_and(|data| data.is_file()) {
        return Polled::Unreadable(format!("is no file of at most {LARGEST} bytes"));
    }
    let lease = Lease::new(&file);
    let quiet = now.duration_since(dirty.heard) >= QUIET;
    match lease.writers {
        Writers::None => {}
        Writers::Some => return Polled::Later,
        Writers::Unknown if dirty.closed || quiet => {}
        Writers::Unknown => return Polled::Later,
    }
    let image = match Image::read(&file, before.length) {
        Ok(image) => image,
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => return Polled::Later,
        Err(error) => return Polled::Unreadable(format!("cannot be read: {error}")),
    };
    if lease.writers == Writers::Unknown && stamp_of(&file).as_ref() != Some(&before) {
        return Polled::Later;
    }
    *seen = Some(before);
    match last {
        Some(last) if *last == image => Polled::Same,
        _ if whole(path, &image) => Polled::Whole(image),
        _ => Polled::Part(image),
    }
}

#[cfg(all(test, unix))]
mod tests;
