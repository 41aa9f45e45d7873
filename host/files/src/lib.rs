//! Files that others hold: results, written beside their place and put there when they are whole, so that
//! nobody ever finds half of one; in [`bounded`] what is read, up to a limit; in [`cache`] what another run
//! may find.

pub mod bounded;
pub mod cache;
mod folder;
mod left;
mod place;
mod program;
#[cfg(test)]
mod tests;

use std::{
    fs::{self, File, Permissions},
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
};

use tempfile::{NamedTempFile, TempDir};
use thiserror::Error;

pub use folder::Folder;
pub use left::{InOrder, end_as_asked, in_order, remove_at_signals};
use left::{Mark, marked, undisturbed};
pub use place::beside;
use place::{Place, builder, put, told};
pub use program::program;

/// Why a file could not be written.
#[derive(Debug, Error)]
#[error("{} cannot be written: {problem}", path.display())]
pub struct WriteError {
    /// The file that was asked for.
    pub path: PathBuf,
    /// What stood in the way.
    pub problem: String,
}

impl miette::Diagnostic for WriteError {}

/// A file on its way. Dropped before [`Writing::finish`], it leaves nothing behind.
#[derive(Debug)]
pub struct Writing {
    path: PathBuf,
    target: PathBuf,
    out: Out,
}

#[derive(Debug)]
enum Out {
    /// Takes its place when it is whole.
    Whole(Part),
    /// A device or pipe that is there already.
    Straight(BufWriter<File>),
}

/// What is written until it is whole.
#[derive(Debug)]
struct Part {
    file: BufWriter<NamedTempFile>,
    mark: Mark,
    /// A folder that it is alone in: when that is gone, no other program that was given the file's name makes
    /// it once more.
    nest: Option<TempDir>,
}

impl Part {
    fn begin(folder: &Path, rights: Option<Permissions>, nested: bool) -> io::Result<Self> {
        let (file, mark, nest) = if nested {
            let (nest, mark) = marked(|| builder(0o700).tempdir_in(folder))?;
            (beside(nest.path(), rights)?, mark, Some(nest))
        } else {
            let (file, mark) = marked(|| beside(folder, rights))?;
            (file, mark, None)
        };
        Ok(Self { file: BufWriter::new(file), mark, nest })
    }
}

impl Writing {
    /// Begins a file; fails at once where it could never be put in its place. Through a link, what it leads
    /// to is written.
    pub fn create(path: &Path) -> Result<Self, WriteError> {
        Self::begin(path, false)
    }

    /// The same for another program that goes to and fro in [`Writing::part`]: even a device gets the file
    /// when it is whole.
    pub fn create_seekable(path: &Path) -> Result<Self, WriteError> {
        Self::begin(path, true)
    }

    fn begin(path: &Path, seekable: bool) -> Result<Self, WriteError> {
        let fail = |problem: String| WriteError { path: path.to_owned(), problem };
        let place = Place::of(path).map_err(fail)?;
        let make = |folder: &Path, rights| Part::begin(folder, rights, seekable);
        let part = match &place.there {
            Some(there) if there.is_dir() => return Err(fail("a folder stands there".to_owned())),
            Some(there) if there.is_file() => {
                let rights = there.permissions();
                if rights.readonly() {
                    return Err(fail("it is there already and read-only".to_owned()));
                }
                File::options().write(true).open(&place.target).map_err(|error| fail(told(&error)))?;
                // Where nothing can be made beside it, it is made elsewhere and written in place.
                make(place.folder(), Some(rights.clone()))
                    .or_else(|_| make(&std::env::temp_dir(), Some(rights)))
            }
            Some(_) => {
                let file = File::options().write(true).open(path).map_err(|error| fail(told(&error)))?;
                if !seekable {
                    let out = Out::Straight(BufWriter::new(file));
                    return Ok(Self { path: path.to_owned(), target: place.target, out });
                }
                make(&std::env::temp_dir(), None)
            }
            None => make(place.folder(), None),
        };
        let out = Out::Whole(part.map_err(|error| fail(told(&error)))?);
        Ok(Self { path: path.to_owned(), target: place.target, out })
    }

    /// The file that holds what was written until it is whole; where a device is written straight, the
    /// device.
    pub fn part(&self) -> &Path {
        match &self.out {
            Out::Whole(part) => part.file.get_ref().path(),
            Out::Straight(_) => &self.target,
        }
    }

    /// Puts the whole file in its place. Where that cannot be done any more, it is kept and the error names
    /// it.
    pub fn finish(self) -> Result<(), WriteError> {
        self.finish_by(|part, target| fs::rename(part, target))
    }

    fn finish_by(self, rename: impl FnOnce(&Path, &Path) -> io::Result<()>) -> Result<(), WriteError> {
        let path = self.path;
        let fail = |problem: String| WriteError { path: path.clone(), problem };
        match self.out {
            Out::Whole(Part { file, mark, nest }) => {
                let temporary = file.into_inner().map_err(|error| fail(told(error.error())))?;
                temporary.as_file().sync_data().map_err(|error| fail(told(&error)))?;
                let part = temporary.into_temp_path();
                let placed = undisturbed(|| put(&part, &self.target, rename));
                drop(mark);
                placed.map_err(|error| {
                    let kept = part.keep();
                    let _ = nest.map(TempDir::keep);
                    let kept = kept.map(|kept| format!("; the whole result is kept as {}", kept.display()));
                    fail(told(&error) + &kept.unwrap_or_default())
                })
            }
            Out::Straight(mut buffer) => buffer.flush().map_err(|error| fail(told(&error))),
        }
    }

    /// The error of a write that failed.
    pub fn error(&self, error: &io::Error) -> WriteError {
        WriteError { path: self.path.clone(), problem: told(error) }
    }
}

impl Write for Writing {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut self.out {
            Out::Whole(part) => part.file.write(bytes),
            Out::Straight(out) => out.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match &mut self.out {
            Out::Whole(part) => part.file.flush(),
            Out::Straight(out) => out.flush(),
        }
    }
}

/// Writes a file whole, or not at all.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), WriteError> {
    let mut file = Writing::create(path)?;
    file.write_all(bytes).map_err(|error| file.error(&error))?;
    file.finish()
}

/// Where a result for this path would stand: at the end of its links.
pub fn target(path: &Path) -> Result<PathBuf, WriteError> {
    let place = Place::of(path).map_err(|problem| WriteError { path: path.to_owned(), problem })?;
    Ok(match (place.folder().canonicalize(), place.target.file_name()) {
        (Ok(folder), Some(name)) => folder.join(name),
        _ => place.target,
    })
}

/// Makes a folder, and those that it is in, for files that come; fails where none can be made in it.
pub fn make_folder(path: &Path) -> Result<(), WriteError> {
    let made = fs::create_dir_all(path).and_then(|()| beside(path, None));
    made.map(drop).map_err(|error| WriteError { path: path.to_owned(), problem: told(&error) })
}
