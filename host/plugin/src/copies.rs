//! Copies of libraries under names that were never loaded: a file that is overwritten while it is mapped
//! crashes the process, and the system's loader returns old code for an old name.

use std::{
    env, fs,
    io::{self, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

use tempfile::NamedTempFile;

use super::{error::Refusal, image::Image, life::PASSED_OVER};

/// Where copies are written, the best place first: in memory, because a disk that is busy holds a reload up
/// for several steps, and in the folder of temporary files. Somebody who sets that knows best.
pub fn folders() -> Vec<PathBuf> {
    const MEMORY: &str = "/dev/shm";
    let temporary = env::temp_dir();
    match env::var_os("TMPDIR").is_none() && runs_from(MEMORY) {
        true => vec![MEMORY.into(), temporary],
        false => vec![temporary],
    }
}

/// Is a file system in memory there, whose files may be run?
fn runs_from(folder: &str) -> bool {
    let mounts = fs::read_to_string("/proc/self/mounts").unwrap_or_default();
    // Device, folder, kind, options. Of several mounts on a folder the last is seen.
    let mount = mounts.lines().rev().map(|line| line.split(' ').collect::<Vec<_>>());
    let mount = mount.into_iter().find(|mount| mount.get(1) == Some(&folder));
    mount.is_some_and(|mount| mount.get(2) == Some(&"tmpfs")) && !runs_nothing(Path::new(folder))
}

/// Does the system refuse to run what is in this folder?
fn runs_nothing(folder: &Path) -> bool {
    #[cfg(target_os = "linux")]
    {
        use std::os::unix::ffi::OsStrExt;
        let Ok(name) = std::ffi::CString::new(folder.as_os_str().as_bytes()) else { return false };
        // SAFETY: a path that ends with NUL, and room for the answer, which is plain data.
        unsafe {
            let mut told: libc::statvfs = std::mem::zeroed();
            libc::statvfs(name.as_ptr(), &mut told) == 0 && told.f_flag & libc::ST_NOEXEC != 0
        }
    }
    #[cfg(not(target_os = "linux"))]
    {
        let _ = folder;
        false
    }
}

/// Copies a library's file and opens the copy, which is removed then; in the first folder in which both work.
/// The copy's loader passes over what stands at `tags`.
pub(super) fn with_copy<T>(
    path: &Path,
    image: &Image<'_>,
    tags: &[u64],
    open: impl Fn(&Path) -> Result<T, Refusal>,
) -> Result<(T, PathBuf), Refusal> {
    let mut refused = Refusal::Machine("there is no folder for copies".into());
    for folder in folders() {
        let opened = match copy(path, image, tags, &folder) {
            Ok(copy) => open(copy.path()).map(|opened| (opened, copy.path().to_owned())),
            Err(error) => Err(Refusal::Machine(format!(
                "it cannot be copied to {} (set TMPDIR): {error}",
                folder.display()
            ))),
        };
        match opened {
            // No room, or a rule against running what is there; a library that nobody can load fails in all
            // folders.
            Err(Refusal::Load(_)) if runs_nothing(&folder) => {
                refused = Refusal::Machine(format!(
                    "its copy cannot be loaded from {}, in which the system runs nothing (noexec): set \
                     TMPDIR to another folder",
                    folder.display()
                ));
            }
            Err(refusal @ (Refusal::Machine(_) | Refusal::Load(_))) => refused = refusal,
            opened => return opened,
        }
    }
    Err(refused)
}

fn copy(path: &Path, image: &Image<'_>, tags: &[u64], folder: &Path) -> io::Result<NamedTempFile> {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let prefix = format!("{stem}-");
    let suffix = env::consts::DLL_SUFFIX;
    let mut file = tempfile::Builder::new().prefix(&prefix).suffix(suffix).tempfile_in(folder)?;
    for (start, bytes) in image.parts() {
        file.seek(SeekFrom::Start(start))?;
        file.write_all(bytes)?;
    }
    for tag in tags {
        file.seek(SeekFrom::Start(*tag))?;
        file.write_all(&PASSED_OVER.to_ne_bytes())?;
    }
    file.as_file().set_len(image.length())?;
    Ok(file)
}
