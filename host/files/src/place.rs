//! Where a result goes: links are followed to what they lead to, and the place is tried before anybody works
//! for it.

use std::{
    fs::{self, File, Metadata, Permissions},
    io,
    path::{Path, PathBuf},
};

use tempfile::{Builder, NamedTempFile};

/// Links that are followed, one to the next, at most (as Linux does).
const MOST_LINKS: usize = 40;

/// A place that was looked at.
#[derive(Debug)]
pub(super) struct Place {
    /// The end of all links, absolute.
    pub target: PathBuf,
    /// What stands there.
    pub there: Option<Metadata>,
}

impl Place {
    /// Looks at what a path leads to.
    pub fn of(path: &Path) -> Result<Self, String> {
        let there = match fs::metadata(path) {
            Ok(there) => Some(there),
            Err(error) if error.kind() == io::ErrorKind::NotFound => None,
            Err(error) => return Err(told(&error)),
        };
        let absolute = std::path::absolute(path).map_err(|error| told(&error))?;
        // The target of a link in /proc (standard output, say) is no path: what stands there is reached
        // through the link alone.
        let target = match (resolve(absolute.clone())?, &there) {
            (end, Some(there)) if !is_same(&end, there) => absolute,
            (end, _) => end,
        };
        if there.is_none() {
            let folder = folder_of(&target);
            if target.file_name().is_none() {
                return Err("this names no file".to_owned());
            }
            if !folder.is_dir() {
                // The words of the path, where no link leads elsewhere.
                let asked = path.parent().filter(|asked| !asked.as_os_str().is_empty());
                let shown = asked.filter(|asked| !fs::exists(asked).unwrap_or(true)).unwrap_or(folder);
                return Err(format!("there is no folder {}", shown.display()));
            }
        }
        Ok(Self { target, there })
    }

    /// The folder that the target is in.
    pub fn folder(&self) -> &Path {
        folder_of(&self.target)
    }
}

fn folder_of(path: &Path) -> &Path {
    path.parent().unwrap_or(Path::new("/"))
}

/// Follows the links that a path ends in, to what is there or would be made there.
fn resolve(mut path: PathBuf) -> Result<PathBuf, String> {
    for _ in 0..MOST_LINKS {
        let Ok(next) = fs::read_link(&path) else { return Ok(path) };
        path = folder_of(&path).join(next);
    }
    Err("too many links lead from one to the next".to_owned())
}

#[cfg(unix)]
fn is_same(path: &Path, there: &Metadata) -> bool {
    use std::os::unix::fs::MetadataExt;
    fs::metadata(path).is_ok_and(|other| (other.dev(), other.ino()) == (there.dev(), there.ino()))
}

#[cfg(not(unix))]
fn is_same(path: &Path, _: &Metadata) -> bool {
    path.exists()
}

/// Begins a temporary file; it gets these rights, or those of any new file.
pub fn beside(folder: &Path, rights: Option<Permissions>) -> io::Result<NamedTempFile> {
    let file = builder(0o666).tempfile_in(folder)?;
    if let Some(rights) = rights {
        file.as_file().set_permissions(rights)?;
    }
    Ok(file)
}

/// What results on their way are called; temporary files are private by default, and results have the rights
/// of any other.
pub(super) fn builder(mode: u32) -> Builder<'static, 'static> {
    let mut builder = Builder::new();
    builder.prefix(".reef-").suffix(".part");
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(mode));
    let _ = mode;
    builder
}

/// Puts a whole file where the target is. What cannot be replaced (a mount, another's file in a sticky
/// folder, a device) is written in place, and the part stays.
pub(super) fn put(
    part: &Path,
    target: &Path,
    rename: impl FnOnce(&Path, &Path) -> io::Result<()>,
) -> io::Result<()> {
    let there = fs::metadata(target);
    if there.as_ref().map_or(true, Metadata::is_file) {
        match rename(part, target) {
            Ok(()) => return Ok(()),
            Err(error) if there.is_err() => return Err(error),
            Err(_) => {}
        }
    }
    let mut from = File::open(part)?;
    let mut into = File::options().write(true).open(target)?;
    let length = io::copy(&mut from, &mut into)?;
    if into.metadata()?.is_file() {
        into.set_len(length)?;
        into.sync_data()?;
    }
    Ok(())
}

/// The system's words without the temporary file's name.
pub(super) fn told(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::PermissionDenied => "permission denied".to_owned(),
        io::ErrorKind::ReadOnlyFilesystem => "the file system is read-only".to_owned(),
        io::ErrorKind::StorageFull => "no space is left".to_owned(),
        _ => error.to_string(),
    }
}
