//! The program and the plugins of this very build. Cargo may leave an older copy of a dynamic library beside
//! the program, so paths come from the messages of a build in the same profile as the tests', never from a
//! guess.

use std::{
    collections::BTreeMap,
    env, fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
    sync::{Mutex, OnceLock, PoisonError},
};

use tempfile::TempDir;

use crate::own::OWN;

/// What a build left, as its messages name it.
#[derive(Clone, Debug, Default)]
pub struct Artifacts {
    /// Programs by their target's name.
    pub programs: BTreeMap<String, PathBuf>,
    /// Dynamic libraries by their target's name.
    pub plugins: BTreeMap<String, PathBuf>,
}

/// The packages that tests use besides Reef's own plugins.
const PACKAGES: [&str; 3] = ["reef", "reef-fixture-faulty", "reef-fixture-meshes"];

/// The workspace's folder.
pub fn workspace() -> &'static Path {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    package.parent().unwrap_or(package)
}

/// Program and plugins of this workspace, built once a test program.
pub fn artifacts() -> &'static Artifacts {
    static BUILT: OnceLock<Artifacts> = OnceLock::new();
    BUILT.get_or_init(|| build(workspace(), &packages(), None))
}

/// What is built together, so that cargo builds what it depends on once, with the same features.
fn packages() -> Vec<&'static str> {
    PACKAGES.into_iter().chain(OWN.iter().map(|plugin| plugin.package)).collect()
}

/// The library of a package of this workspace as a build with this feature makes it, in a file of its own in
/// `folder`.
///
/// # Panics
/// When the build fails.
pub fn variant(package: &str, library: &str, feature: &str, folder: &Path) -> PathBuf {
    // Builds of the same package share their file: one at a time, in this program and in others.
    static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());
    let _turn = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
    let lock = fs::File::create(env::temp_dir().join("reef-tests-variants.lock")).expect("a lock");
    lock.lock().expect("the lock");
    // Beside the program: alone, the package would have dependencies with fewer features, built once more.
    let packages: Vec<_> = packages().into_iter().chain([package]).collect();
    let feature_of_it = format!("{package}/{feature}");
    let built = build_with(workspace(), &packages, &["--features", &feature_of_it], None);
    let kept = folder.join(format!("{library}-{feature}{}", env::consts::DLL_SUFFIX));
    fs::copy(built.plugin(library), &kept).expect("the library is copied");
    kept
}

/// Builds packages of a workspace and returns what cargo names.
///
/// # Panics
/// When the build fails: its messages are in the panic's.
pub fn build(workspace: &Path, packages: &[&str], target: Option<&Path>) -> Artifacts {
    build_with(workspace, packages, &[], target)
}

fn build_with(workspace: &Path, packages: &[&str], more: &[&str], target: Option<&Path>) -> Artifacts {
    let mut command = Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.current_dir(workspace).args(["build", "--quiet", "--message-format=json-render-diagnostics"]);
    if !cfg!(debug_assertions) {
        command.arg("--release");
    }
    for package in packages {
        command.args(["--package", package]);
    }
    command.args(more);
    if let Some(target) = target {
        command.arg("--target-dir").arg(target);
    }
    let output = command.stderr(Stdio::piped()).output().expect("cargo starts");
    let messages = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "cargo build failed in {}:\n{messages}", workspace.display());
    let mut artifacts = Artifacts::default();
    for line in output.stdout.split(|byte| *byte == b'\n') {
        let Ok(message) = serde_json::from_slice::<serde_json::Value>(line) else { continue };
        if message["reason"] != "compiler-artifact" {
            continue;
        }
        let Some(name) = message["target"]["name"].as_str() else { continue };
        if let Some(program) = message["executable"].as_str() {
            artifacts.programs.insert(name.to_owned(), program.into());
        }
        let kinds = message["target"]["kind"].as_array();
        if kinds.is_some_and(|kinds| kinds.iter().any(|kind| kind == "cdylib")) {
            let files =
                message["filenames"].as_array().into_iter().flatten().filter_map(|file| file.as_str());
            let library = files.map(PathBuf::from).find(|file| is_library(file));
            artifacts.plugins.extend(library.map(|library| (name.to_owned(), library)));
        }
    }
    artifacts
}

fn is_library(path: &Path) -> bool {
    path.to_string_lossy().ends_with(env::consts::DLL_SUFFIX)
}

impl Artifacts {
    /// The program `reef`.
    pub fn reef(&self) -> &Path {
        self.programs.get("reef").expect("the build names the program `reef`")
    }

    /// The library of the target with this name, `reef_anemone`.
    pub fn plugin(&self, name: &str) -> &Path {
        self.plugins.get(name).unwrap_or_else(|| panic!("the build names no library `{name}`"))
    }

    /// A folder with the program and these plugins side by side, as an installation has them.
    pub fn side_by_side(&self, plugins: &[&str]) -> TempDir {
        let folder = tempfile::tempdir().expect("a folder for the program");
        link(self.reef(), folder.path());
        for plugin in plugins {
            link(self.plugin(plugin), folder.path());
        }
        folder
    }

    /// A folder with these plugins alone.
    pub fn folder_of(&self, plugins: &[&str]) -> TempDir {
        let folder = tempfile::tempdir().expect("a folder for the plugins");
        for plugin in plugins {
            link(self.plugin(plugin), folder.path());
        }
        folder
    }
}

/// Puts a file into a folder, without a copy where the file system allows it.
fn link(file: &Path, folder: &Path) {
    let target = folder.join(file.file_name().expect("a file has a name"));
    if fs::hard_link(file, &target).is_err() {
        fs::copy(file, &target).unwrap_or_else(|error| panic!("{}: {error}", target.display()));
    }
}
