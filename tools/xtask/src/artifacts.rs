//! The program and the plugins that belong together: always the files that cargo just named, never older
//! ones.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Stdio,
};

use crate::{Failure, cargo, root};

/// What a build left.
pub struct Built {
    /// The program `reef`.
    pub program: PathBuf,
    /// A folder with this build's plugins and nothing else.
    pub plugins: PathBuf,
}

/// Builds the default members and gathers their plugins in one folder.
///
/// Cargo may leave an older copy of a dynamic library beside the program, so the files are taken from its
/// messages.
pub fn build() -> Result<Built, Failure> {
    let (program, libraries) = run_cargo(&[])?;
    let program = program.ok_or_else(|| Failure::check("cargo build named no program `reef`"))?;
    let beside = program.parent().map_or_else(root, Path::to_path_buf);
    let plugins = beside.join("reef-plugins");
    gather(&libraries, &plugins).map_err(|error| {
        Failure::check(format!("cannot gather the plugins in {}: {error}", plugins.display()))
    })?;
    Ok(Built { program, plugins })
}

/// Builds one plugin and renames it into a folder of plugins, where a running sea finds it.
pub fn build_plugin(package: &str, folder: &Path) -> Result<(), Failure> {
    let (_, libraries) = run_cargo(&["--package", package])?;
    for library in &libraries {
        place(library, folder).map_err(|error| Failure::check(format!("{}: {error}", library.display())))?;
    }
    Ok(())
}

/// Builds; returns the program `reef` and all dynamic libraries, as cargo names them.
fn run_cargo(arguments: &[&str]) -> Result<(Option<PathBuf>, Vec<PathBuf>), Failure> {
    let output = cargo()
        .args(["build", "--message-format=json-render-diagnostics"])
        .args(arguments)
        .stderr(Stdio::inherit())
        .output()
        .map_err(|error| Failure::machine(format!("cargo build: {error}")))?;
    if !output.status.success() {
        return Err(Failure::check("cargo build failed: its messages are above"));
    }
    let mut program = None;
    let mut libraries = Vec::new();
    for line in output.stdout.split(|byte| *byte == b'\n') {
        let Ok(message) = serde_json::from_slice::<serde_json::Value>(line) else { continue };
        if message["reason"] != "compiler-artifact" {
            continue;
        }
        let of_kind = |kind: &str| {
            message["target"]["kind"].as_array().is_some_and(|kinds| kinds.iter().any(|k| k == kind))
        };
        if of_kind("bin") && message["target"]["name"] == "reef" {
            program = message["executable"].as_str().map(PathBuf::from);
        }
        if of_kind("cdylib") {
            let files = message["filenames"].as_array().into_iter().flatten();
            libraries.extend(files.filter_map(|file| file.as_str()).map(PathBuf::from));
        }
    }
    Ok((program, libraries))
}

/// Makes `folder` hold copies of exactly these libraries; each copy is renamed into place, so a running sea
/// never reads half a file.
fn gather(libraries: &[PathBuf], folder: &Path) -> std::io::Result<()> {
    fs::create_dir_all(folder)?;
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if !libraries.iter().any(|library| library.file_name() == path.file_name()) {
            fs::remove_file(path)?;
        }
    }
    libraries.iter().try_for_each(|library| place(library, folder))
}

/// Renames a copy of a library into a folder, unless the same is there.
fn place(library: &Path, folder: &Path) -> std::io::Result<()> {
    let Some(name) = library.file_name() else { return Ok(()) };
    let target = folder.join(name);
    if fs::read(&target).ok() == Some(fs::read(library)?) {
        return Ok(());
    }
    let partial = folder.join(format!("{}.partial", name.to_string_lossy()));
    fs::copy(library, &partial)?;
    fs::rename(&partial, &target)
}

/// Whether an optional part of the toolchain (`fmt`, `clippy`) is installed.
pub fn has_component(name: &str) -> bool {
    cargo()
        .args([name, "--version"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success())
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    /// Package and version → its features, of everything that a build needs.
    fn features(arguments: &[&str]) -> BTreeMap<String, String> {
        let mut command = cargo();
        command.args(["tree", "--offline", "--prefix", "none", "--format", "{p} = {f}"]).args(arguments);
        let output = command.output().expect("cargo starts");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let text = String::from_utf8(output.stdout).expect("text");
        let lines = text.lines().filter_map(|line| line.trim_end_matches(" (*)").split_once(" = "));
        lines.map(|(package, features)| (package.to_owned(), features.trim().to_owned())).collect()
    }

    /// Else cargo builds the host twice for `cargo xtask test`: a minute more.
    #[test]
    fn the_demo_and_the_tests_need_everything_with_the_same_features() {
        let demo = features(&["--edges", "normal,build"]);
        let tests = features(&["--workspace", "--edges", "normal,build,dev"]);
        assert!(demo.len() > 100, "{} packages", demo.len());
        for (package, features) in &demo {
            assert_eq!(tests.get(package), Some(features), "{package}: a dependency of tests asks for more");
        }
    }
}
