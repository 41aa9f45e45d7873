//! Where scenes and species are found.

use std::path::{Path, PathBuf};

use crate::scene::error::SceneError;

/// The folder of assets: what the command line names, else `assets` beside the program or in a folder above
/// it, else in the working folder or one above it.
pub fn folder(wanted: Option<&Path>) -> Result<PathBuf, SceneError> {
    if let Some(wanted) = wanted {
        if wanted.is_dir() {
            return Ok(wanted.to_owned());
        }
        return Err(SceneError::file(wanted, "there is no such folder of assets", None));
    }
    let program = reef_files::program().ok();
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

/// The file of a scene: the path itself, or a scene of assets by its bare name ("reef"). A name without an
/// ending is looked for in assets first: the program `reef` may lie in the working folder.
pub fn scene(wanted: &Path, assets: &Path) -> PathBuf {
    if (wanted.extension().is_none() || !wanted.exists()) && wanted.components().count() == 1 {
        for name in [wanted.to_owned(), wanted.with_extension("toml")] {
            let inside = assets.join("scenes").join(name);
            if inside.is_file() {
                return inside;
            }
        }
    }
    wanted.to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bare_name_is_a_scene_of_assets_and_a_path_is_itself() {
        let assets = tempfile::tempdir().unwrap();
        std::fs::create_dir(assets.path().join("scenes")).unwrap();
        let inside = assets.path().join("scenes/src.toml");
        std::fs::write(&inside, "").unwrap();
        // `src` is also a folder where this test runs, as `reef` is a program in others.
        assert!(Path::new("src").exists());
        assert_eq!(scene(Path::new("src"), assets.path()), inside);
        assert_eq!(scene(Path::new("src.toml"), assets.path()), inside);
        for path in ["./src", "other", "scenes/src.toml"] {
            assert_eq!(scene(Path::new(path), assets.path()), Path::new(path));
        }
    }
}
