//! Folders of results: filled under a name of their own, and found whole.

use std::{
    ffi::OsString,
    fs, io,
    path::{Path, PathBuf},
};

use tempfile::TempDir;

use super::{
    WriteError,
    left::{Mark, marked, undisturbed},
    place::{Place, builder, told},
};

/// A folder on its way. Dropped before [`Folder::finish`], it leaves nothing behind.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    target: PathBuf,
    part: TempDir,
    mark: Mark,
    /// An empty folder stood there: it stays (it may be a mount, or somebody's present folder), and gets the
    /// files.
    is_there: bool,
}

impl Folder {
    /// Begins a folder; fails at once where it could never be put in its place. A folder that is there must
    /// be empty.
    pub fn create(path: &Path) -> Result<Self, WriteError> {
        let fail = |problem: String| WriteError { path: path.to_owned(), problem };
        let place = Place::of(path).map_err(fail)?;
        let is_there = match &place.there {
            None => false,
            Some(there) if there.is_dir() => {
                if !foreign(&place.target, None).map_err(|error| fail(told(&error)))?.is_empty() {
                    return Err(fail("the folder is not empty".to_owned()));
                }
                true
            }
            Some(_) => return Err(fail("what stands there is no folder".to_owned())),
        };
        let parent = if is_there { &place.target } else { place.folder() };
        let made = marked(|| builder(0o777).tempdir_in(parent));
        let (part, mark) = made.map_err(|error| fail(told(&error)))?;
        Ok(Self { path: path.to_owned(), target: place.target, part, mark, is_there })
    }

    /// Where files are written until all are there.
    pub fn part(&self) -> &Path {
        self.part.path()
    }

    /// Puts all in its place. Where that cannot be done any more, it is kept and the error names it.
    pub fn finish(self) -> Result<(), WriteError> {
        let placed = undisturbed(|| match self.is_there {
            true => self.move_in(),
            false => fs::rename(self.part.path(), &self.target),
        });
        drop(self.mark);
        match placed {
            // What it named is there no more under that name, or is empty.
            Ok(()) if self.is_there => drop(self.part),
            Ok(()) => drop(self.part.keep()),
            Err(error) => {
                let kept = self.part.keep();
                let problem = format!("{}; the result is kept in {}", told(&error), kept.display());
                return Err(WriteError { path: self.path, problem });
            }
        }
        Ok(())
    }

    fn move_in(&self) -> io::Result<()> {
        if let Some(name) = foreign(&self.target, self.part.path().file_name().map(Into::into))?.first() {
            let name = name.to_string_lossy();
            return Err(io::Error::other(format!("{name} has come into the folder meanwhile")));
        }
        let mut names: Vec<OsString> =
            fs::read_dir(self.part.path())?.map(|entry| Ok(entry?.file_name())).collect::<io::Result<_>>()?;
        names.sort();
        for name in names {
            fs::rename(self.part.path().join(&name), self.target.join(&name))?;
        }
        Ok(())
    }
}

/// What is in a folder besides our own; a fresh file system has its `lost+found`.
fn foreign(folder: &Path, own: Option<OsString>) -> io::Result<Vec<OsString>> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder)? {
        let name = entry?.file_name();
        if name != "lost+found" && Some(&name) != own.as_ref() {
            names.push(name);
        }
    }
    Ok(names)
}
