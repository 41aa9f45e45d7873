//! The program as people meet it at its edges: how long it waits for plugins, what it says and how often, what it refuses
//! to read or to write.

use std::{
    env, fs,
    process::{Command, Output},
    sync::OnceLock,
    time::{Duration, Instant},
};

use reef_tests::artifacts::{artifacts, workspace};
use tempfile::TempDir;

/// The program beside its plugins, and one that does as its configuration says.
fn installed() -> &'static TempDir {
    static INSTALLED: OnceLock<TempDir> = OnceLock::new();
    INSTALLED.get_or_init(|| artifacts().side_by_side(&["reef_particles", "reef_fixture_faulty"]))
}

fn command(arguments: &[&str]) -> Command {
    let program = installed().path().join(format!("reef{}", env::consts::EXE_SUFFIX));
    let mut command = Command::new(program);
    command.args(["--assets".as_ref(), workspace().join("assets").as_os_str()]).args(arguments);
    command.env_remove("REEF_LOG");
    command
}

fn reef(arguments: &[&str]) -> Output {
    command(arguments).output().expect("the program runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// A folder, and the path of a scene in it with one module of the faulty plugin.
fn scene_with(faults: &str) -> (TempDir, String) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("sea.toml");
    fs::write(&path, format!("[modules.a]\nuse = 'fixture.faulty'\n{faults}\n")).expect("a scene");
    let path = path.to_str().expect("UTF-8").to_owned();
    (folder, path)
}

#[test]
#[cfg(all(target_os = "linux", any(target_arch = "x86_64", target_arch = "aarch64")))]
fn a_run_without_a_window_waits_and_patience_says_how_long() {
    // One step that works for longer than a window would wait, and asks whether it should stop.
    let (_folder, scene) = scene_with("strike = 'obedient_loop'\nwhere = 'step'");
    let sim = ["sim", &scene, "--workers", "1", "--steps", "1"];
    let began = Instant::now();
    let output = reef(&[sim.as_slice(), &["--patience", "1.5"]].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(began.elapsed() >= Duration::from_millis(1500), "it was asked to stop after {:?}", began.elapsed());
    // One that never ends, nor asks: the message says what would have waited longer.
    let (_folder, scene) = scene_with("strike = 'loop'\nwhere = 'step'");
    let output = reef(&["sim", &scene, "--workers", "1", "--steps", "1", "--patience", "0.3"]);
    let told = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{told}");
    assert!(told.contains("step was stopped: it did not end 300 ms after it began"), "{told}");
    assert!(told.contains("--patience SECONDS waits longer"), "{told}");
    // Without the option it is still at it after what a window waits.
    let mut child = command(&["sim", &scene, "--workers", "1", "--steps", "1"]).spawn().expect("it starts");
    std::thread::sleep(Duration::from_secs(3));
    let ended = child.try_wait().expect("the child");
    child.kill().expect("the child is ended");
    child.wait().expect("the child");
    assert_eq!(ended, None, "nobody waits for this picture: it may take longer than three seconds");
}
