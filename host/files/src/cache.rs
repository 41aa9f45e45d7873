//! What another run may find, and can do without.

use std::{
    fs,
    io::{self, Write},
    path::{Path, PathBuf},
};

/// The user's cache folder for Reef.
pub fn folder() -> Option<PathBuf> {
    let absolute =
        |name| std::env::var_os(name).map(PathBuf::from).filter(|path: &PathBuf| path.is_absolute());
    absolute("XDG_CACHE_HOME")
        .or_else(|| absolute("HOME").map(|home| home.join(".cache")))
        .map(|c| c.join("reef"))
}

/// Keeps a file, in a folder that is made where it is not there. Whoever reads sees the old or the new one,
/// whole. It is for this user alone.
pub fn keep(file: &Path, bytes: &[u8]) -> io::Result<()> {
    let folder = file.parent().unwrap_or(Path::new("."));
    fs::create_dir_all(folder)?;
    let mut beside = tempfile::NamedTempFile::new_in(folder)?;
    beside.write_all(bytes)?;
    beside.persist(file).map_err(|error| error.error)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_kept_is_written_whole_into_a_folder_that_did_not_exist() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let file = folder.path().join("new/cache.bin");
        for bytes in [&[1, 2, 3][..], &[4]] {
            keep(&file, bytes).expect("kept");
            assert_eq!(fs::read(&file).expect("there"), bytes);
        }
        let left = fs::read_dir(folder.path().join("new")).expect("listed").count();
        assert_eq!(left, 1, "no temporary file stays");
    }
}
