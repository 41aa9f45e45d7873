//! Output files: written beside their place and put there when they are whole, so that nobody ever finds half of one.

use std::{
    fs::{self, File},
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
};

use tempfile::NamedTempFile;
use thiserror::Error;

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
    out: Out,
}

#[derive(Debug)]
enum Out {
    /// Takes its name when it is whole.
    Beside(BufWriter<NamedTempFile>),
    /// A device or pipe that is there already.
    Straight(BufWriter<File>),
}

impl Writing {
    /// Begins a file; fails at once where it could never be put in its place.
    pub fn create(path: &Path) -> Result<Self, WriteError> {
        let fail = |problem: String| WriteError { path: path.to_owned(), problem };
        if path.file_name().is_none() {
            return Err(fail("this names no file".to_owned()));
        }
        if let Ok(data) = fs::metadata(path) {
            if data.is_dir() {
                return Err(fail("a folder stands there".to_owned()));
            }
            if !data.is_file() {
                let file = File::options().write(true).open(path).map_err(|error| fail(error.to_string()))?;
                return Ok(Self { path: path.to_owned(), out: Out::Straight(BufWriter::new(file)) });
            }
            if data.permissions().readonly() {
                return Err(fail("it is there already and read-only".to_owned()));
            }
        }
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        if !folder.is_dir() {
            return Err(fail(format!("there is no folder {}", folder.display())));
        }
        let mut builder = tempfile::Builder::new();
        builder.prefix(".reef-").suffix(".part");
        #[cfg(unix)]
        let shared: fs::Permissions = std::os::unix::fs::PermissionsExt::from_mode(0o666);
        #[cfg(unix)]
        builder.permissions(shared);
        let temporary = builder.tempfile_in(folder).map_err(|error| fail(told(&error)))?;
        Ok(Self { path: path.to_owned(), out: Out::Beside(BufWriter::new(temporary)) })
    }

    /// Puts the whole file in its place.
    pub fn finish(self) -> Result<(), WriteError> {
        let path = self.path;
        let fail = |error: &io::Error| WriteError { path: path.clone(), problem: told(error) };
        match self.out {
            Out::Beside(buffer) => {
                let temporary = buffer.into_inner().map_err(|error| fail(error.error()))?;
                temporary.as_file().sync_data().map_err(|error| fail(&error))?;
                temporary.persist(&path).map_err(|error| fail(&error.error))?;
                Ok(())
            }
            Out::Straight(mut buffer) => buffer.flush().map_err(|error| fail(&error)),
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
            Out::Beside(out) => out.write(bytes),
            Out::Straight(out) => out.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match &mut self.out {
            Out::Beside(out) => out.flush(),
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

/// The system's words without the temporary file's name.
fn told(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::PermissionDenied => "permission denied".to_owned(),
        io::ErrorKind::ReadOnlyFilesystem => "the file system is read-only".to_owned(),
        io::ErrorKind::StorageFull => "no space is left".to_owned(),
        _ => error.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<_> = fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn a_file_appears_whole_when_it_is_finished_and_never_before() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.csv");
        fs::write(&path, "old").unwrap();
        let mut file = Writing::create(&path).unwrap();
        file.write_all(&[b'x'; 100_000]).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"old");
        file.finish().unwrap();
        assert_eq!(fs::read(&path).unwrap().len(), 100_000);
        assert_eq!(names(folder.path()), ["out.csv"]);
    }

    #[test]
    fn a_file_that_is_given_up_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let mut file = Writing::create(&folder.path().join("out.csv")).unwrap();
        file.write_all(b"half").unwrap();
        drop(file);
        assert!(names(folder.path()).is_empty());
    }

    #[test]
    fn a_place_that_cannot_be_written_is_refused_at_once_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let missing = folder.path().join("no/such/out.csv");
        let error = Writing::create(&missing).unwrap_err().to_string();
        assert!(error.contains("out.csv cannot be written: there is no folder"), "{error}");
        let error = Writing::create(folder.path()).unwrap_err().to_string();
        assert!(error.ends_with("cannot be written: a folder stands there"), "{error}");
        assert!(write(Path::new("/"), b"").is_err());
    }

    #[cfg(unix)]
    #[test]
    fn files_can_be_read_by_those_whom_the_umask_allows() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        write(&folder.path().join("mine"), b"1").unwrap();
        fs::write(folder.path().join("std"), b"1").unwrap();
        let mode = |name| fs::metadata(folder.path().join(name)).unwrap().permissions().mode();
        assert_eq!(mode("mine"), mode("std"));
    }
}
