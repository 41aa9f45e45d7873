//! The folder of shaders: which files are stages, what they include, and whether the committed SPIR-V is
//! theirs.
//!
//! `shaders/manifest.json` holds, for each stage, the hash of its source with all that it includes, and the
//! hash of the SPIR-V that was compiled from it. So a test without any compiler sees an edit that was not
//! compiled.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

/// The manifest's file name.
pub const MANIFEST: &str = "manifest.json";
/// The folder of compiled shaders, within that of the sources.
pub const SPIRV: &str = "spv";
/// File name extensions of the stages that Reef uses.
const STAGES: [&str; 3] = ["vert", "frag", "comp"];

/// What was compiled from what.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Manifest {
    /// File name → hashes.
    pub shaders: BTreeMap<String, Entry>,
}

/// One stage in the manifest.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Entry {
    /// BLAKE3 of the source and of everything that it includes.
    pub source: String,
    /// BLAKE3 of the SPIR-V.
    pub spirv: String,
}

/// A stage's source with everything that it includes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stage {
    /// File name, such as `fibre.vert`.
    pub name: String,
    /// The file and its includes.
    pub files: BTreeSet<PathBuf>,
    /// Hash over all of them.
    pub hash: String,
}

/// Why the folder of shaders cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum SourceError {
    /// A file that cannot be read or written.
    #[error("{}: {error}", path.display())]
    File {
        /// Which.
        path: PathBuf,
        /// Why.
        error: std::io::Error,
    },
    /// A manifest that cannot be parsed.
    #[error("{}: {error}", path.display())]
    Manifest {
        /// Which.
        path: PathBuf,
        /// Why.
        error: serde_json::Error,
    },
}

/// The folder of shaders of the working tree that the program was built in; none where it was installed
/// elsewhere. `REEF_SHADERS` overrides it.
pub fn find_folder() -> Option<PathBuf> {
    if let Some(given) = std::env::var_os("REEF_SHADERS") {
        return Some(PathBuf::from(given));
    }
    let program = std::env::current_exe().ok()?;
    program.ancestors().map(|place| place.join("shaders")).find(|folder| folder.join(MANIFEST).is_file())
}

/// The files that Reef compiles, by name.
pub fn stages(folder: &Path) -> Result<Vec<Stage>, SourceError> {
    let failed = |error| SourceError::File { path: folder.to_owned(), error };
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        let is_stage = path.extension().is_some_and(|e| STAGES.iter().any(|stage| e == *stage));
        if is_stage && path.is_file() {
            found.push(stage(&path)?);
        }
    }
    found.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(found)
}

/// Reads a stage and what it includes.
pub fn stage(path: &Path) -> Result<Stage, SourceError> {
    let mut files = BTreeSet::new();
    let mut waiting = vec![path.to_owned()];
    let mut hasher = blake3::Hasher::new();
    let mut contents = BTreeMap::new();
    while let Some(file) = waiting.pop() {
        if !files.insert(file.clone()) {
            continue;
        }
        let bytes = std::fs::read(&file).map_err(|error| SourceError::File { path: file.clone(), error })?;
        let folder = file.parent().unwrap_or(Path::new("."));
        waiting.extend(includes(&String::from_utf8_lossy(&bytes)).map(|name| folder.join(name)));
        contents.insert(name_of(&file), bytes);
    }
    for (name, bytes) in contents {
        hasher.update(&(name.len() as u64).to_le_bytes()).update(name.as_bytes());
        hasher.update(&(bytes.len() as u64).to_le_bytes()).update(&bytes);
    }
    Ok(Stage { name: name_of(path), files, hash: hasher.finalize().to_hex().to_string() })
}

fn name_of(path: &Path) -> String {
    path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
}

/// The names in `#include "…"` lines.
fn includes(source: &str) -> impl Iterator<Item = String> {
    source.lines().filter_map(|line| {
        let rest = line.trim_start().strip_prefix('#')?.trim_start().strip_prefix("include")?;
        let name = rest.trim_start().strip_prefix('"')?.split('"').next()?;
        Some(name.to_owned())
    })
}

/// Where a stage's SPIR-V lies.
pub fn spirv_path(folder: &Path, name: &str) -> PathBuf {
    folder.join(SPIRV).join(format!("{name}.spv"))
}

/// Hash as it stands in the manifest.
pub fn hash(bytes: &[u8]) -> String {
    blake3::hash(bytes).to_hex().to_string()
}

/// Reads the manifest.
pub fn manifest(folder: &Path) -> Result<Manifest, SourceError> {
    let path = folder.join(MANIFEST);
    let text = std::fs::read(&path).map_err(|error| SourceError::File { path: path.clone(), error })?;
    serde_json::from_slice(&text).map_err(|error| SourceError::Manifest { path, error })
}

/// Everything in which sources, SPIR-V files, manifest and `embedded` disagree; nothing: all is as compiled.
pub fn disagreements(folder: &Path, embedded: &[(&str, &[u8])]) -> Result<Vec<String>, SourceError> {
    let manifest = manifest(folder)?;
    let stages = stages(folder)?;
    let mut wrong = Vec::new();
    for stage in &stages {
        match manifest.shaders.get(&stage.name) {
            None => wrong.push(format!("{} was never compiled", stage.name)),
            Some(entry) if entry.source != stage.hash => {
                wrong.push(format!("{} or what it includes was edited and not compiled", stage.name));
            }
            Some(_) => {}
        }
    }
    for (name, entry) in &manifest.shaders {
        if !stages.iter().any(|stage| stage.name == *name) {
            wrong.push(format!("{name} is in the manifest and has no source"));
        }
        match std::fs::read(spirv_path(folder, name)) {
            Ok(bytes) if hash(&bytes) == entry.spirv => {}
            Ok(_) => wrong.push(format!("{SPIRV}/{name}.spv is not what was compiled")),
            Err(error) => wrong.push(format!("{SPIRV}/{name}.spv: {error}")),
        }
        match embedded.iter().find(|(embedded, _)| embedded == name) {
            Some((_, bytes)) if hash(bytes) == entry.spirv => {}
            Some(_) => wrong.push(format!("{name} in the program is not what was compiled")),
            None => wrong.push(format!("{name} is not in the program")),
        }
    }
    for (name, _) in embedded {
        if !manifest.shaders.contains_key(*name) {
            wrong.push(format!("{name} is in the program and not in the manifest"));
        }
    }
    Ok(wrong)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::embedded;

    fn folder() -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shaders")
    }

    #[test]
    fn the_committed_spirv_is_compiled_from_the_committed_sources_and_embedded() {
        let wrong = disagreements(&folder(), embedded::SHADERS).expect("the folder of shaders");
        assert!(wrong.is_empty(), "run `cargo xtask shaders`:\n{}", wrong.join("\n"));
    }

    /// A folder with one stage that includes a file that includes another.
    fn sample() -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("written");
        write("a.comp", "#version 460\n  # include \"b.glsl\"\n// #include nothing\n");
        write("b.glsl", "#include \"c.glsl\"\n#include \"b.glsl\"\n");
        write("c.glsl", "int c;\n");
        write("unused.glsl", "int unused;\n");
        folder
    }

    #[test]
    fn an_edit_of_an_include_of_an_include_changes_the_hash_and_one_of_another_file_does_not() {
        let folder = sample();
        let of = || stages(folder.path()).expect("read").remove(0);
        let before = of();
        assert_eq!(before.files.len(), 3);
        std::fs::write(folder.path().join("unused.glsl"), "edited").expect("written");
        assert_eq!(of(), before);
        std::fs::write(folder.path().join("c.glsl"), "int d;\n").expect("written");
        assert_ne!(of().hash, before.hash);
    }

    #[test]
    fn what_was_edited_and_not_compiled_is_named() {
        let folder = sample();
        let spirv = b"spirv".as_slice();
        let stage = stages(folder.path()).expect("read").remove(0);
        let entry = Entry { source: stage.hash, spirv: hash(spirv) };
        let manifest = Manifest { shaders: BTreeMap::from([("a.comp".to_owned(), entry)]) };
        std::fs::create_dir(folder.path().join(SPIRV)).expect("made");
        std::fs::write(spirv_path(folder.path(), "a.comp"), spirv).expect("written");
        let text = serde_json::to_vec(&manifest).expect("JSON");
        std::fs::write(folder.path().join(MANIFEST), text).expect("written");
        let check = |embedded: &[(&str, &[u8])]| disagreements(folder.path(), embedded).expect("checked");
        assert_eq!(check(&[("a.comp", spirv)]), Vec::<String>::new());
        assert_eq!(check(&[]).len(), 1, "not embedded");
        assert_eq!(check(&[("a.comp", b"other")]).len(), 1, "another one is embedded");
        assert_eq!(check(&[("a.comp", spirv), ("b.comp", spirv)]).len(), 1, "one too many is embedded");
        std::fs::write(folder.path().join("b.glsl"), "edited").expect("written");
        assert_eq!(check(&[("a.comp", spirv)]).len(), 1, "the source was edited");
        std::fs::write(spirv_path(folder.path(), "a.comp"), "edited").expect("written");
        assert_eq!(check(&[("a.comp", spirv)]).len(), 2, "and the SPIR-V");
    }
}
