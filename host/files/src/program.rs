//! Where this program lies.

use std::{
    env, io,
    path::{Path, PathBuf},
};

/// This program's file. A system without /proc does not tell: then it is the one that was called by this
/// name.
pub fn program() -> io::Result<PathBuf> {
    env::current_exe().or_else(|error| {
        let name = env::args_os().next().map(PathBuf::from);
        let search = env::var_os("PATH").unwrap_or_default();
        name.and_then(|name| called(&name, env::split_paths(&search))).ok_or(error)
    })
}

/// The file that a shell runs by a name.
fn called(name: &Path, mut search: impl Iterator<Item = PathBuf>) -> Option<PathBuf> {
    if name.components().count() > 1 {
        return std::path::absolute(name).ok().filter(|path| path.is_file());
    }
    search.find_map(|folder| std::path::absolute(folder.join(name)).ok().filter(|path| path.is_file()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_is_found_by_its_path_or_in_the_folders_that_are_searched() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("reef-here");
        std::fs::write(&file, "").unwrap();
        let search = || [PathBuf::from("/nowhere"), folder.path().to_owned()].into_iter();
        assert_eq!(called(&file, std::iter::empty()), Some(file.clone()));
        assert_eq!(called(Path::new("reef-here"), search()), Some(file));
        assert_eq!(called(Path::new("reef-there"), search()), None);
        assert_eq!(called(Path::new("./reef-here"), search()), None, "a path is not searched for");
    }
}
