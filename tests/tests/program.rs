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

#[test]
fn a_plugin_that_fails_each_step_is_told_at_growing_distances() {
    let (_folder, scene) = scene_with("fault = 'discard'\nin_step = 1");
    let output = reef(&["sim", &scene, "--steps", "1000"]);
    let told = text(&output.stderr);
    assert!(output.status.success(), "{told}");
    let lines: Vec<&str> = told.lines().filter(|line| line.contains("chosen Discard in step")).collect();
    assert_eq!(lines.len(), 11, "the first three, then 4, 8 … 512: {told}");
    assert!(lines[10].contains("(for the 512th time)"), "{told}");
    assert!(lines[10].contains("step=512"), "{told}");
    let output = reef(&["sim", &scene, "--steps", "1000", "--json"]);
    let answer: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(answer["messages"].as_array().map(Vec::len), Some(11), "{answer}");
}

#[test]
#[cfg(unix)]
fn texts_of_others_reach_the_terminal_without_control_characters() {
    let folder = tempfile::tempdir().expect("a folder");
    let evil = "x\x1b[2J\x1b]0;owned\x07\u{9b}31m";
    let scene = folder.path().join(format!("{evil}.toml"));
    fs::write(&scene, format!("[scene]\nname = \"\\u001b[2J\\u009b\"\n# {evil}\nsed = 1 # {evil}\n")).expect("a scene");
    let plugins = folder.path().join(format!("plugins{evil}"));
    fs::create_dir(&plugins).expect("a folder");
    fs::write(plugins.join(format!("lib{evil}.so")), "no library").expect("a file");
    let sound = folder.path().join(format!("sound{evil}.toml"));
    fs::write(&sound, "[scene]\nname = \"\\u001b[2J\\u009b\"\n").expect("a scene");
    let [scene, sound, plugins] = [&scene, &sound, &plugins].map(|path| path.to_str().expect("UTF-8"));
    for (arguments, code) in [
        (["scene", "check", scene, "--plugin-dir", plugins].as_slice(), 2),
        (&["scene", "check", sound, "--plugin-dir", plugins], 0),
        (&["sim", sound, "--steps", "2", "--plugin-dir", plugins], 0),
        (&["sim", sound, "--steps", "2", "--json"], 0),
        (&["plugin", "list", "--plugin-dir", plugins, "--json"], 2),
        (&["sim", evil, "--steps", "2"], 2),
    ] {
        let output = reef(arguments);
        let all = text(&output.stdout) + &text(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {all:?}");
        let steers = |c: &char| c.is_control() && *c != '\n' && *c != '\t';
        assert_eq!(all.chars().find(steers), None, "{arguments:?}: {all:?}");
        assert!(all.contains("\\u001b["), "it is shown written out: {arguments:?}: {all}");
        if arguments.contains(&"--json") {
            serde_json::from_slice::<serde_json::Value>(&output.stdout).expect("JSON");
        }
    }
}
