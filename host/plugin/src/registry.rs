//! All plugins that were found, and all files that were refused, in an order that depends on names only.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::Arc,
};

use reef_abi as abi;

use super::{
    error::Refusal,
    info::PluginInfo,
    library::{Library, Plugin, looks_like_a_library},
};

/// A file that is not used.
#[derive(Clone, Debug)]
pub struct Refused {
    /// The file.
    pub path: PathBuf,
    /// Why.
    pub reason: Refusal,
}

/// The plugins of this run.
#[derive(Clone, Debug, Default)]
pub struct Registry {
    plugins: Vec<Plugin>,
    refused: Vec<Refused>,
    notes: Vec<(PathBuf, String)>,
}

impl Registry {
    /// No plugins.
    pub fn new() -> Self {
        Self::default()
    }

    /// Loads what lies in `folders` (in this order, by name within each), then what lies beside the program. The first
    /// library with an id wins; others are refused. Libraries beside the program that are no plugins are passed over.
    pub fn find(folders: &[PathBuf], workers: usize) -> Self {
        let mut registry = Self::new();
        for folder in folders {
            registry.load_folder(folder, workers, true);
        }
        if let Some(beside) = std::env::current_exe().ok().as_deref().and_then(Path::parent) {
            registry.load_folder(beside, workers, false);
        }
        registry
    }

    /// Loads all libraries in a folder. `asked_for`: somebody named this folder, so all refusals are worth a word.
    pub fn load_folder(&mut self, folder: &Path, workers: usize, asked_for: bool) {
        let entries = match fs::read_dir(folder) {
            Ok(entries) => entries,
            Err(error) => {
                let reason = Refusal::Unreadable(error.to_string());
                self.refused.push(Refused { path: folder.to_owned(), reason });
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
            match self.load(&path, workers) {
                Ok(()) => {}
                // Nobody asked for what lies beside the program: other libraries, and older copies of a plugin that a
                // named folder replaces, are no mistake.
                Err(Refusal::NoEntry) if !asked_for => {}
                Err(reason @ Refusal::Duplicate { .. }) if !asked_for => {
                    self.notes.push((path, reason.to_string()));
                }
                Err(reason) => self.refused.push(Refused { path, reason }),
            }
        }
    }

    /// Loads one file.
    pub fn load(&mut self, path: &Path, workers: usize) -> Result<(), Refusal> {
        let (library, plugins) = Library::load(path, workers)?;
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
            match self.get(id) {
                None => self.plugins.push(plugin),
                Some(first) => {
                    let first = first.info().path.as_ref();
                    let first = first.map_or_else(|| "linked".to_owned(), |path| path.display().to_string());
                    result = Err(Refusal::Duplicate { id: id.clone(), first });
                }
            }
        }
        result
    }

    /// Puts a library's newer plugins in the place of those with the same ids, and adds those that are new. Returns the
    /// former ones: whoever drops the last of a library waits until it is closed.
    pub fn replace(&mut self, plugins: &[Plugin]) -> Vec<Plugin> {
        let mut former = Vec::new();
        for plugin in plugins {
            match self.plugins.iter_mut().find(|known| known.info().id == plugin.info().id) {
                Some(known) => former.push(std::mem::replace(known, plugin.clone())),
                None => self.plugins.push(plugin.clone()),
            }
        }
        former
    }

    /// The plugin with this id.
    pub fn get(&self, id: &str) -> Option<&Plugin> {
        self.plugins.iter().find(|plugin| plugin.info().id == id)
    }

    /// All plugins, in the order in which they were found.
    pub fn plugins(&self) -> &[Plugin] {
        &self.plugins
    }

    /// What they say of themselves.
    pub fn infos(&self) -> impl Iterator<Item = &Arc<PluginInfo>> {
        self.plugins.iter().map(Plugin::info)
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

/// Cargo does not always renew a dynamic library beside the program: the newer one then lies in `deps`, under the same
/// name.
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
}
