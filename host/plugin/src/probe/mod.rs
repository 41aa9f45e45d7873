//! Builds that nobody knows are loaded first by a process of their own: what is damaged so that the system's
//! loader crashes or never comes back takes that process down, not this one. What came through is known by
//! its content from then on.

mod known;
#[cfg(target_os = "linux")]
mod serve;
#[cfg(target_os = "linux")]
mod server;

use std::{
    path::{Path, PathBuf},
    time::Duration,
};

use super::{
    error::Refusal,
    image::Image,
    inspect::{self, CONTRACT},
};

#[cfg(target_os = "linux")]
use known::Note;
#[cfg(target_os = "linux")]
pub use serve::serve;

/// How builds are tried.
#[derive(Clone, Debug)]
pub struct Probe {
    /// The program whose `plugin probe` tries them.
    pub program: PathBuf,
    /// Where known builds are noted; None: nowhere.
    pub known: Option<PathBuf>,
    /// How long a call of theirs may take, where the command line says so.
    pub patience: Option<Duration>,
}

/// What is known of a build.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
struct Verdict {
    /// Of the content that was loaded.
    hash: String,
    /// The ids of its plugins.
    plugins: Vec<String>,
    /// Why it is not used.
    refused: Option<String>,
    /// Its code is at fault, and would be so again: by a signal, or because a call did not end in its time.
    fault: bool,
}

/// The ids of a build's plugins, which was loaded before, by another process or in another run. None: nothing
/// is tried here.
#[cfg(target_os = "linux")]
pub fn look(path: &Path, image: &Image<'_>) -> Result<Option<Vec<String>>, Refusal> {
    let Some(probe) = server::offered() else { return Ok(None) };
    inspect::judge(inspect::inspect(image)?, CONTRACT)?;
    let hash = known::hash(image);
    if let Some(plugins) = recall(probe, &hash)? {
        return Ok(Some(plugins));
    }
    let Some(verdict) = server::ask(probe, server::LOAD, path) else { return Ok(None) };
    if let Some(reason) = verdict.refused {
        // Was it this content that did so? The file may have been written anew before it was tried.
        let same = || inspect::read(path).is_ok_and(|image| known::hash(&image) == hash);
        if let Some(folder) =
            probe.known.as_ref().filter(|_| verdict.fault && probe.patience.is_none() && same())
        {
            known::remember(folder, &hash, &Note::Bad(reason.clone()));
        }
        return Err(Refusal::Fault(reason));
    }
    if verdict.hash != hash {
        return Err(Refusal::Unreadable("it was written anew while it was tried".into()));
    }
    if let Some(folder) = &probe.known {
        known::remember(folder, &hash, &Note::Sound(verdict.plugins.clone()));
    }
    Ok(Some(verdict.plugins))
}

/// What was noted of a build: the ids of its plugins, or that it is at fault.
#[cfg(target_os = "linux")]
fn recall(probe: &Probe, hash: &str) -> Result<Option<Vec<String>>, Refusal> {
    let Some(folder) = &probe.known else { return Ok(None) };
    match known::recall(folder, hash) {
        None => Ok(None),
        Some(Note::Sound(plugins)) => Ok(Some(plugins)),
        // Who has more patience may see another end.
        Some(Note::Bad(_)) if probe.patience.is_some() => Ok(None),
        Some(Note::Bad(reason)) => Err(Refusal::Fault(format!(
            "{reason}; that was seen before: to try it again, remove {}",
            folder.join(hash).display()
        ))),
    }
}

/// Other systems try nothing.
#[cfg(not(target_os = "linux"))]
pub fn look(_: &Path, _: &Image<'_>) -> Result<Option<Vec<String>>, Refusal> {
    Ok(None)
}

/// Does the system's loader take this copy of a build, in another process? For a sea that runs and must not
/// wait: nothing of the library is run there, which is what the guards are for.
pub(crate) fn glance(copy: &Path) -> Result<(), Refusal> {
    #[cfg(target_os = "linux")]
    if let Some(Verdict { refused: Some(reason), .. }) =
        server::offered().and_then(|probe| server::ask(probe, server::GLANCE, copy))
    {
        return Err(Refusal::Fault(reason));
    }
    #[cfg(not(target_os = "linux"))]
    let _ = copy;
    Ok(())
}

/// From now on, builds that nobody knows are tried so.
pub fn offer(probe: Probe) {
    #[cfg(target_os = "linux")]
    server::offer(probe);
    #[cfg(not(target_os = "linux"))]
    drop(probe);
}

/// New builds are about to come: what tries them is ready when they do.
pub fn prepare() {
    #[cfg(target_os = "linux")]
    server::prepare();
}

/// No more builds come for now.
pub fn rest() {
    #[cfg(target_os = "linux")]
    server::rest();
}
