//! All plugins that were found, and all files that were refused, in an order that depends on names only.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::{Arc, OnceLock},
};

use reef_abi as abi;

use super::{
    error::Refusal,
    info::PluginInfo,
    inspect,
    library::{Library, Plugin, looks_like_a_library},
    probe,
};

/// A file that is not used.
#[derive(Clone, Debug)]
pub struct Refused {
    /// The file.
    pub path: PathBuf,
    /// Why.
    pub reason: Refusal,
    /// The plugins that are known to be in it.
    pub ids: Vec<String>,
}

/// A library that was tried before and that nobody has asked for yet.
#[derive(Debug)]
struct Dormant {
    path: PathBuf,
    /// Those of its plugins that count.
    ids: Vec<String>,
    workers: usize,
    plugins: OnceLock<Result<Vec<Plugin>, Refusal>>,
}

impl Dormant {
    /// Loads it.
    fn load(&self) -> Result<Vec<Plugin>, Refusal> {
        let (library, plugins) = load(&self.path, self.workers)?;
        for note in library.notes() {
            tracing::info!("{}: {note}", self.path.display());
        }
        Ok(plugins.into_iter().filter(|plugin| self.ids.contains(&plugin.info().id)).collect())
    }

    fn has(&self, id: &str) -> bool {
        self.ids.iter().any(|known| known == id)
    }

    /// Its plugins, loaded now where nobody asked before.
    fn plugins(&self) -> Result<&[Plugin], &Refusal> {
        self.plugins.get_or_init(|| self.load()).as_deref()
    }

    /// Why it could not be loaded when somebody asked for it.
    fn refused(&self) -> Option<Refused> {
        let reason = self.plugins.get()?.as_ref().err()?.clone();
        Some(Refused { path: self.path.clone(), reason, ids: self.ids.clone() })
    }
}

/// Loads a file that another process loads first, where nobody knows it.
fn load(path: &Path, workers: usize) -> Result<(Arc<Library>, Vec<Plugin>), Refusal> {
    let image = inspect::read(path)?;
    probe::look(path, &image)?;
    Library::load_image(path, &image, workers)
}

/// The plugins of this run.
#[derive(Clone, Debug, Default)]
pub struct Registry {
    plugins: Vec<Plugin>,
    dormant: Vec<Arc<Dormant>>,
    /// All that is found is loaded, asked for or not.
    eager: bool,
    refused: Vec<Refused>,
    notes: Vec<(PathBuf, String)>,
}

impl Registry {
    /// No plugins.
    pub fn new() -> Self {
        Self::default()
    }

    /// Finds what lies in `folders` (in this order, by name within each), then what lies beside the program.
    /// The first library with an id wins; others are refused. Libraries beside the program that are no
    /// plugins are passed over. Where builds are tried by another process, only plugins that somebody asks
    /// for are loaded here.
    pub fn find(folders: &[PathBuf], workers: usize) -> Self {
        Self::new().search(folders, workers)
    }

    /// The same, with all of them loaded.
    pub fn find_all(folders: &[PathBuf], workers: usize) -> Self {
        Self { eager: true, ..Self::new() }.search(folders, workers)
    }

    fn search(mut self, folders: &[PathBuf], workers: usize) -> Self {
        for folder in folders {
            self.load_folder(folder, workers, true);
        }
        if let Some(beside) = reef_files::program().ok().as_deref().and_then(Path::parent) {
            self.load_folder(beside, workers, false);
        }
        probe::rest();
        self
    }

    /// Finds all libraries in a folder. `asked_for`: somebody named this folder, so all refusals are worth a
    /// word.
    pub fn load_folder(&mut self, folder: &Path, workers: usize, asked_for: bool) {
        let entries = match fs::read_dir(folder) {
            Ok(entries) => entries,
            Err(error) => {
                let reason = Refusal::Unreadable(error.to_string());
                self.refused.push(Refused { path: folder.to_owned(), reason, ids: Vec::new() });
                return;
            }
        };
        let mut paths: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
        paths.retain(|path| looks_like_a_library(path));
        paths.sort();
        for mut path in paths {
            if !asked_for && let Some(newer) = newer_build(&path) {
                self.notes
                    .push((newer.clone(), format!("is newer than {} and used in its place", path.display())));
                path = newer;
            }
            match self.meet(&path, workers) {
                Ok(()) => {}
                // Nobody asked for what lies beside the program: other libraries, and older copies of a
                // plugin that a named folder replaces, are no mistake.
                Err(Refusal::NoEntry) if !asked_for => {}
                Err(reason @ Refusal::Duplicate { .. }) if !asked_for => {
                    self.notes.push((path, reason.to_string()));
                }
                Err(reason) => self.refused.push(Refused { path, reason, ids: Vec::new() }),
            }
        }
    }

    /// Takes a file up: loads it, or knows what is in it without that.
    fn meet(&mut self, path: &Path, workers: usize) -> Result<(), Refusal> {
        if self.eager {
            return self.load(path, workers);
        }
        let Some(mut ids) = probe::look(path, &inspect::read(path)?)? else {
            return self.load(path, workers);
        };
        let taken =
            ids.iter().find_map(|id| Some(Refusal::Duplicate { id: id.clone(), first: self.home(id)? }));
        ids.retain(|id| self.home(id).is_none());
        if !ids.is_empty() {
            let dormant = Dormant { path: path.to_owned(), ids, workers, plugins: OnceLock::new() };
            self.dormant.push(Arc::new(dormant));
        }
        taken.map_or(Ok(()), Err)
    }

    /// Knows of a build that another process has [looked](probe::look) at: it is loaded when somebody asks
    /// for one of its plugins. `Err`: another file has one of them.
    pub fn learn(&mut self, path: &Path, ids: &[String], workers: usize) -> Result<(), Refusal> {
        self.absorb();
        self.dormant.retain(|dormant| dormant.path != path);
        if let Some((id, first)) = ids.iter().find_map(|id| Some((id.clone(), self.home(id)?))) {
            return Err(Refusal::Duplicate { id, first });
        }
        let (path, ids) = (path.to_owned(), ids.to_vec());
        self.dormant.push(Arc::new(Dormant { path, ids, workers, plugins: OnceLock::new() }));
        Ok(())
    }

    /// Where the plugin with this id came from, for people; None: nobody knows it.
    fn home(&self, id: &str) -> Option<String> {
        if let Some(plugin) = self.plugins.iter().find(|plugin| plugin.info().id == id) {
            let path = plugin.info().path.as_ref();
            return Some(path.map_or_else(|| "linked".to_owned(), |path| path.display().to_string()));
        }
        self.dormant_with(id).map(|dormant| dormant.path.display().to_string())
    }

    fn dormant_with(&self, id: &str) -> Option<&Dormant> {
        self.dormant.iter().map(|dormant| &**dormant).find(|dormant| dormant.has(id))
    }

    /// Loads all that was found and not asked for yet. What fails then is refused.
    pub fn wake(&mut self) {
        self.absorb();
        for dormant in std::mem::take(&mut self.dormant) {
            match dormant.load() {
                Ok(plugins) => self.plugins.extend(plugins),
                Err(reason) => {
                    let (path, ids) = (dormant.path.clone(), dormant.ids.clone());
                    self.refused.push(Refused { path, reason, ids });
                }
            }
        }
    }

    /// Those that were found dormant and that somebody asked for are like the others: loaded, or refused.
    fn absorb(&mut self) {
        let Self { plugins, dormant, refused, .. } = self;
        dormant.retain(|dormant| {
            if let Some(Ok(loaded)) = dormant.plugins.get() {
                plugins.extend(loaded.iter().cloned());
            }
            refused.extend(dormant.refused());
            dormant.plugins.get().is_none()
        });
    }

    /// Loads one file.
    pub fn load(&mut self, path: &Path, workers: usize) -> Result<(), Refusal> {
        let (library, plugins) = load(path, workers)?;
        self.notes.extend(library.notes().iter().map(|note| (path.to_owned(), note.clone())));
        self.add(plugins)
    }

    /// Adds a library that is linked into the program.
    pub fn add_linked(&mut self, entry: &'static abi::Entry, workers: usize) -> Result<(), Refusal> {
        let (_, plugins) = Library::from_entry(entry, workers)?;
        self.add(plugins)
    }

    fn add(&mut self, plugins: Vec<Plugin>) -> Result<(), Refusal> {
        let mut result = Ok(());
        for plugin in plugins {
            let id = &plugin.info().id;
            match self.home(id) {
                None => self.plugins.push(plugin),
                Some(first) => result = Err(Refusal::Duplicate { id: id.clone(), first }),
            }
        }
        result
    }

    /// Puts a library's newer plugins in the place of those with the same ids, and adds those that are new.
    /// What was dormant in that library, or under these ids, is not loaded any more. Returns the former ones:
    /// whoever drops the last of a library waits until it is closed.
    pub fn replace(&mut self, plugins: &[Plugin]) -> Vec<Plugin> {
        self.absorb();
        self.dormant.retain(|dormant| {
            let is_in = |plugin: &Plugin| plugin.library().path() == Some(&*dormant.path);
            !plugins.iter().any(|plugin| is_in(plugin) || dormant.has(&plugin.info().id))
        });
        let mut former = Vec::new();
        for plugin in plugins {
            match self.plugins.iter_mut().find(|known| known.info().id == plugin.info().id) {
                Some(known) => former.push(std::mem::replace(known, plugin.clone())),
                None => self.plugins.push(plugin.clone()),
            }
        }
        former
    }

    /// The plugin with this id, which is loaded now where nobody asked for it before.
    pub fn get(&self, id: &str) -> Option<&Plugin> {
        let is_it = |plugin: &&Plugin| plugin.info().id == id;
        let known = self.plugins.iter().find(is_it);
        known.or_else(|| self.dormant_with(id)?.plugins().ok()?.iter().find(is_it))
    }

    /// The file in which the plugin with this id was found, where it could not be loaded when
    /// [`Registry::get`] asked for it.
    pub fn failed(&self, id: &str) -> Option<Refused> {
        let told = |refused: &&Refused| refused.ids.iter().any(|known| known == id);
        let before = || self.refused.iter().find(told).cloned();
        self.dormant_with(id).and_then(Dormant::refused).or_else(before)
    }

    /// The plugin with this id, if it is loaded.
    pub fn loaded(&self, id: &str) -> Option<&Plugin> {
        self.plugins().into_iter().find(|plugin| plugin.info().id == id)
    }

    /// The files of all libraries that were found, loaded or not.
    pub fn paths(&self) -> Vec<&Path> {
        let loaded = self.plugins.iter().filter_map(|plugin| plugin.library().path());
        let mut paths: Vec<&Path> = loaded.chain(self.dormant.iter().map(|dormant| &*dormant.path)).collect();
        paths.dedup();
        paths
    }

    /// The ids of all plugins that were found, loaded or not.
    pub fn ids(&self) -> impl Iterator<Item = &str> {
        let loaded = self.plugins.iter().map(|plugin| plugin.info().id.as_str());
        loaded.chain(self.dormant.iter().flat_map(|dormant| dormant.ids.iter().map(String::as_str)))
    }

    /// All plugins that are loaded, in the order in which they were found.
    pub fn plugins(&self) -> Vec<&Plugin> {
        let woken = self.dormant.iter().filter_map(|dormant| dormant.plugins.get()?.as_ref().ok());
        self.plugins.iter().chain(woken.flatten()).collect()
    }

    /// What they say of themselves.
    pub fn infos(&self) -> impl Iterator<Item = &Arc<PluginInfo>> {
        self.plugins().into_iter().map(Plugin::info)
    }

    /// Files that are not used.
    pub fn refused(&self) -> &[Refused] {
        &self.refused
    }

    /// What people should know about files that are used.
    pub fn notes(&self) -> &[(PathBuf, String)] {
        &self.notes
    }
}

/// Cargo does not always renew a dynamic library beside the program: the newer one then lies in `deps`, under
/// the same name.
fn newer_build(path: &Path) -> Option<PathBuf> {
    let newer = path.parent()?.join("deps").join(path.file_name()?);
    let time = |path: &Path| fs::metadata(path).and_then(|metadata| metadata.modified()).ok();
    (time(&newer)? > time(path)?).then_some(newer)
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, SystemTime};

    use super::*;

    #[test]
    fn a_library_that_cargo_left_newer_in_deps_is_the_one_to_use() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("deps")).unwrap();
        let (beside, newer) = (folder.path().join("libx.so"), folder.path().join("deps/libx.so"));
        let write = |path: &Path, age: u64| {
            let file = fs::File::create(path).unwrap();
            file.set_modified(SystemTime::now() - Duration::from_secs(age)).unwrap();
        };
        write(&beside, 10);
        assert_eq!(newer_build(&beside), None);
        write(&newer, 10_000);
        assert_eq!(newer_build(&beside), None);
        write(&newer, 5);
        assert_eq!(newer_build(&beside), Some(newer));
    }

    fn dormant(id: &str, plugins: OnceLock<Result<Vec<Plugin>, Refusal>>) -> Arc<Dormant> {
        let path = Path::new("lib").join(id);
        Arc::new(Dormant { path, ids: vec![id.to_owned()], workers: 1, plugins })
    }

    #[test]
    fn what_was_asked_for_and_could_not_be_loaded_is_refused_with_its_reason() {
        let mut registry = Registry::new();
        registry.dormant =
            vec![dormant("a.asked", Err(Refusal::Empty).into()), dormant("a.b", OnceLock::new())];
        assert!(registry.get("a.asked").is_none());
        assert_eq!(registry.failed("a.asked").map(|failed| failed.reason), Some(Refusal::Empty));
        assert!(registry.failed("a.b").is_none() && registry.refused().is_empty());
        registry.absorb();
        assert_eq!(registry.failed("a.asked").map(|failed| failed.reason), Some(Refusal::Empty), "still");
        assert_eq!(registry.ids().collect::<Vec<_>>(), ["a.b"]);
        let [refused] = registry.refused() else { panic!("{:?}", registry.refused()) };
        assert_eq!((refused.path.as_path(), &refused.reason), (Path::new("lib/a.asked"), &Refusal::Empty));
    }
}
