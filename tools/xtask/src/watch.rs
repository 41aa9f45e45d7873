//! `cargo xtask watch PLUGIN [SCENE]`: from a saved source to pixels. Shows the sea, and builds the plugin
//! anew whenever a source of it, or of a package of this workspace that it is made of, is saved; the running
//! sea takes the new build up by itself.

use std::{
    collections::BTreeMap,
    env, fs,
    path::{Path, PathBuf},
    process::Command,
    thread,
    time::{Duration, Instant, SystemTime},
};

use serde_json::Value;

use crate::{Failure, Outcome, artifacts, cargo, packages, root};

/// Between two looks at the sources.
const PAUSE: Duration = Duration::from_millis(120);

/// Runs until the sea is closed.
pub fn watch(arguments: &[String]) -> Outcome {
    let usage = || Failure::usage("cargo xtask watch PLUGIN [SCENE] [OPTIONS of reef]");
    let (wanted, rest) = arguments.split_first().filter(|(w, _)| !w.starts_with('-')).ok_or_else(usage)?;
    let package = Package::find(wanted)?;
    let display =
        ["DISPLAY", "WAYLAND_DISPLAY"].iter().any(|name| env::var_os(name).is_some_and(|v| !v.is_empty()));
    packages::require(if display { &["run", "window"] } else { &["run"] })?;
    let built = artifacts::build()?;
    // What was saved while this build ran is built once more.
    let mut seen = package.stamps();
    artifacts::build_plugin(&package.name, &built.plugins)?;

    let (scene, options) = match rest.split_first() {
        Some((scene, options)) if !scene.starts_with('-') => (scene.as_str(), options),
        _ => ("reef", rest),
    };
    let mut reef = Command::new(&built.program);
    reef.current_dir(root());
    if display {
        reef.arg(scene);
    } else {
        println!("No display here: the sea runs without a window.");
        reef.args(["sim", scene, "--watch"]);
    }
    let mut reef = reef
        .args(options)
        .arg("--plugin-dir")
        .arg(&built.plugins)
        .spawn()
        .map_err(|error| Failure::machine(format!("reef: {error}")))?;
    println!("Watching {} in {}", package.name, package.folders_text());
    loop {
        match reef.try_wait() {
            Ok(None) => {}
            Ok(Some(status)) if status.success() => return Ok(()),
            Ok(Some(status)) => return Err(Failure::check(format!("reef ended with {status}"))),
            Err(error) => return Err(Failure::machine(format!("reef: {error}"))),
        }
        thread::sleep(PAUSE);
        let now = package.stamps();
        if now == seen {
            continue;
        }
        seen = now;
        let began = Instant::now();
        match artifacts::build_plugin(&package.name, &built.plugins) {
            Ok(()) => println!("Built {} in {:.1} s", package.name, began.elapsed().as_secs_f64()),
            // Cargo has printed what is wrong, and where.
            Err(failure) => eprintln!("{}; the sea runs on with the build before", failure.message),
        }
    }
}

/// A plugin's package, and where the sources of it lie.
struct Package {
    name: String,
    folders: Vec<PathBuf>,
}

impl Package {
    /// Finds a plugin by its package's name, with or without `reef-`.
    fn find(wanted: &str) -> Result<Self, Failure> {
        let output = cargo()
            .args(["metadata", "--no-deps", "--format-version", "1"])
            .output()
            .map_err(|error| Failure::machine(format!("cargo metadata: {error}")))?;
        let metadata: Value = serde_json::from_slice(&output.stdout).map_err(|error| {
            let told = String::from_utf8_lossy(&output.stderr);
            Failure::check(format!("cargo metadata: {error}\n{told}"))
        })?;
        Self::among(&metadata, wanted)
    }

    fn among(metadata: &Value, wanted: &str) -> Result<Self, Failure> {
        let all = metadata["packages"].as_array().map_or(&[][..], Vec::as_slice);
        let list = |value: &Value| value.as_array().cloned().unwrap_or_default();
        let is_plugin = |package: &&Value| {
            let kinds = list(&package["targets"]).into_iter().flat_map(|target| list(&target["kind"]));
            kinds.into_iter().any(|kind| kind == "cdylib")
        };
        let name = |package: &Value| package["name"].as_str().unwrap_or_default().to_owned();
        let matches =
            |package: &&Value| [wanted.to_owned(), format!("reef-{wanted}")].contains(&name(package));
        let Some(plugin) = all.iter().filter(is_plugin).find(matches) else {
            let names: Vec<String> = all.iter().filter(is_plugin).map(name).collect();
            return Err(Failure::usage(format!(
                "there is no plugin {wanted:?}; there are: {}",
                names.join(", ")
            )));
        };
        let folder = |package: &Value| {
            Path::new(package["manifest_path"].as_str().unwrap_or_default()).parent().map(Path::to_path_buf)
        };
        let mut folders: Vec<PathBuf> = folder(plugin).into_iter().collect();
        let mut at = 0;
        while at < folders.len() {
            let here = all.iter().find(|package| folder(package).as_ref() == Some(&folders[at]));
            for dependency in here.map(|package| list(&package["dependencies"])).unwrap_or_default() {
                // What only tests need changes nothing in the library.
                if let Some(path) = dependency["path"].as_str().map(PathBuf::from)
                    && dependency["kind"] != "dev"
                    && !folders.contains(&path)
                {
                    folders.push(path);
                }
            }
            at += 1;
        }
        Ok(Self { name: name(plugin), folders })
    }

    fn folders_text(&self) -> String {
        let root = root();
        let short = |folder: &PathBuf| folder.strip_prefix(&root).unwrap_or(folder).display().to_string();
        self.folders.iter().map(short).collect::<Vec<_>>().join(", ")
    }

    /// Time and length of every source.
    fn stamps(&self) -> BTreeMap<PathBuf, (Option<SystemTime>, u64)> {
        let mut stamps = BTreeMap::new();
        for folder in &self.folders {
            gather(&folder.join("src"), &mut stamps);
            stamp(folder.join("Cargo.toml"), &mut stamps);
        }
        stamps
    }
}

type Stamps = BTreeMap<PathBuf, (Option<SystemTime>, u64)>;

fn gather(folder: &Path, stamps: &mut Stamps) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        match entry.file_type() {
            Ok(kind) if kind.is_dir() => gather(&entry.path(), stamps),
            _ => stamp(entry.path(), stamps),
        }
    }
}

fn stamp(path: PathBuf, stamps: &mut Stamps) {
    if let Ok(data) = fs::metadata(&path) {
        stamps.insert(path, (data.modified().ok(), data.len()));
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_plugin_is_found_with_the_folders_of_all_that_it_is_made_of() {
        let package = |name: &str, kind: &str, needs: Value| {
            json!({
                "name": name,
                "manifest_path": format!("/w/{name}/Cargo.toml"),
                "targets": [{ "kind": [kind] }],
                "dependencies": needs,
            })
        };
        let metadata = json!({ "packages": [
            package("reef-fish", "cdylib", json!([{ "path": "/w/fish-model", "kind": null }, { "kind": null }])),
            package("fish-model", "lib", json!([{ "path": "/w/flow", "kind": null }, { "path": "/w/tests", "kind": "dev" }])),
            package("flow", "lib", json!([])),
        ]});
        let found = Package::among(&metadata, "fish").map_err(|failure| failure.message).unwrap();
        assert_eq!(found.name, "reef-fish");
        assert_eq!(found.folders, ["/w/reef-fish", "/w/fish-model", "/w/flow"].map(PathBuf::from));
        let refused = Package::among(&metadata, "flow").err().map(|failure| failure.message);
        assert!(refused.is_some_and(|told| told.contains("there are: reef-fish")));
    }
}
