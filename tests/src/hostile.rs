//! The plugin in C++ that does one harmful thing in one place, and programs that meet it.

use std::{
    path::{Path, PathBuf},
    process::{Command, Output, Stdio},
    sync::{Once, OnceLock},
    time::Duration,
};

use tempfile::TempDir;

use crate::{
    artifacts::{artifacts, workspace},
    child,
    languages::CPP,
    skip,
};

/// No program that meets it may take longer, on the busiest machine.
const LIMIT: Duration = Duration::from_secs(120);

/// The folder with its library, built once a test program; None: there is no compiler.
pub fn folder() -> Option<&'static Path> {
    static BUILT: OnceLock<Option<TempDir>> = OnceLock::new();
    BUILT.get_or_init(build).as_ref().map(TempDir::path)
}

fn source() -> PathBuf {
    workspace().join("tests/fixtures/hostile")
}

fn build() -> Option<TempDir> {
    let compiler = CPP.compiler()?;
    let folder = tempfile::tempdir().expect("a folder for the plugin");
    let output = Command::new(compiler)
        .args(["-std=c++17", "-O1", "-fPIC", "-shared", "-Wall", "-Wextra", "-Werror", "-I"])
        .arg(workspace().join("sim-plugins/abi"))
        .arg(source().join("hostile.cpp"))
        .arg("-o")
        .arg(folder.path().join("libhostile.so"))
        .output()
        .expect("the compiler starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Some(folder)
}

/// How a program ended, and what it said.
#[derive(Debug)]
pub struct Met {
    /// Its exit code; None: a signal ended it.
    pub code: Option<i32>,
    /// What it said on both streams.
    pub text: String,
}

/// `reef` with these arguments and the plugin, which does `wish` (`WHAT@WHERE`); None: there is no compiler.
/// What is known of builds is kept beside the plugin.
pub fn meet(wish: &str, arguments: &[&str]) -> Option<Met> {
    let Some(folder) = folder() else {
        skip("the hostile plugin needs a C++ compiler");
        return None;
    };
    // A build is known by what it did when it was first seen, which is nothing here.
    static KNOWN: Once = Once::new();
    let cache = folder.join("cache");
    KNOWN.call_once(|| drop(meet_in(folder, &cache, "nothing@nowhere", &["plugin", "list"])));
    Some(meet_in(folder, &cache, wish, arguments))
}

/// The same with the plugins of another folder, and what is known of builds in `cache`.
///
/// # Panics
/// When the program does not end.
pub fn meet_in(folder: &Path, cache: &Path, wish: &str, arguments: &[&str]) -> Met {
    let child = Command::new(artifacts().reef())
        .args(arguments)
        .arg("--assets")
        .arg(workspace().join("assets"))
        .arg("--plugin-dir")
        .arg(folder)
        .env("REEF_HOSTILE", wish)
        .env("XDG_CACHE_HOME", cache)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("reef starts");
    let Output { status, stdout, stderr } = child::wait(child, LIMIT, wish);
    let text = String::from_utf8_lossy(&stdout).into_owned() + &String::from_utf8_lossy(&stderr);
    Met { code: status.code(), text }
}

/// Steps that [`sim`] takes.
pub const STEPS: u64 = 5;

/// A sea with the plugin.
pub fn scene() -> String {
    source().join("hostile.toml").to_string_lossy().into_owned()
}

/// [`STEPS`] steps of a sea with the plugin, which strikes in the third.
pub fn sim(wish: &str) -> Option<Met> {
    sim_with(wish, &[])
}

/// The same with more arguments.
pub fn sim_with(wish: &str, arguments: &[&str]) -> Option<Met> {
    meet(wish, &[&["sim", &scene(), "--steps", &STEPS.to_string(), "--hash"], arguments].concat())
}
