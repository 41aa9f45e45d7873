//! Where scenes and species are found.

use std::path::{Path, PathBuf};

use super::scene::error::SceneError;

/// The folder of assets: what the command line names, else `assets` beside the program or in a folder above it, else in
/// the working folder or one above it.
pub fn folder(wanted: Option<&Path>) -> Result<PathBuf, SceneError> {
    if let Some(wanted) = wanted {
        if wanted.is_dir() {
            return Ok(wanted.to_owned());
        }
        return Err(SceneError::file(wanted, "there is no such folder of assets", None));
    }
    let program = std::env::current_exe().ok();
    let here = std::env::current_dir().ok();
    let starts = [program.as_deref().and_then(Path::parent), here.as_deref()];
    for start in starts.into_iter().flatten() {
        for folder in start.ancestors().take(6) {
            let assets = folder.join("assets");
            if assets.join("scenes").is_dir() {
                return Ok(assets);
            }
        }
    }
    let help = "name it with --assets DIR";
    Err(SceneError::plain("the folder `assets` with scenes and species was not found", Some(help.to_owned())))
}

/// The file of a scene: the path itself, or a scene of assets by its bare name ("reef").
pub fn scene(wanted: &Path, assets: &Path) -> PathBuf {
    if !wanted.exists() && wanted.components().count() == 1 {
        for name in [wanted.to_owned(), wanted.with_extension("toml")] {
            let inside = assets.join("scenes").join(name);
            if inside.is_file() {
                return inside;
            }
        }
    }
    wanted.to_owned()
}
