//! The program as people meet it at its edges: how long it waits for plugins, what it says and how often,
//! what it refuses to read or to write.

use std::{
    env, fs,
    process::{Command, Output, Stdio},
    sync::OnceLock,
    time::{Duration, Instant},
};

use reef_tests::{
    artifacts::{artifacts, workspace},
    child,
};
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
    assert!(
        began.elapsed() >= Duration::from_millis(1500),
        "it was asked to stop after {:?}",
        began.elapsed()
    );
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
fn a_plugin_that_discards_each_step_is_told_at_growing_distances() {
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
    fs::write(&scene, format!("[scene]\nname = \"\\u001b[2J\\u009b\"\n# {evil}\nsed = 1 # {evil}\n"))
        .expect("a scene");
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

/// Runs the program, which must end by itself soon: its exit code and what it told.
fn soon(arguments: &[&str]) -> (Option<i32>, String) {
    let child =
        command(arguments).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("the program starts");
    let output = child::wait(child, Duration::from_secs(60), &format!("reef {arguments:?}"));
    (output.status.code(), text(&output.stderr))
}

#[cfg(unix)]
fn pipe(path: &std::path::Path) {
    let name = std::ffi::CString::new(path.to_str().expect("UTF-8")).expect("no NUL");
    // SAFETY: the path is null-terminated.
    assert_eq!(unsafe { libc::mkfifo(name.as_ptr(), 0o600) }, 0);
}

#[test]
#[cfg(target_os = "linux")]
fn what_is_no_file_or_has_no_end_is_refused_before_it_is_read() {
    let (folder, scene) = scene_with("");
    let fifo = folder.path().join("fifo.json");
    pipe(&fifo);
    let fifo = fifo.to_str().expect("UTF-8");
    let library = artifacts().plugin("reef_particles").to_str().expect("UTF-8");
    for path in ["/dev/zero", fifo] {
        for arguments in [
            ["plugin", "check", library, "--config", path].as_slice(),
            &["sim", &scene, "--steps", "1", "--load-state", path],
            &["sim", &scene, "--steps", "1", "--replay", path],
        ] {
            let (code, told) = soon(arguments);
            assert_eq!(code, Some(2), "{arguments:?}: {told}");
            assert!(told.contains("it is no regular file"), "{arguments:?}: {told}");
        }
    }
}

#[test]
#[cfg(target_os = "linux")]
fn what_is_no_state_is_refused_by_its_first_bytes() {
    let (folder, scene) = scene_with("");
    let state = folder.path().join("state");
    // As large as a state may be, all of it a hole: read whole it would take all of a machine's memory.
    fs::File::create(&state).and_then(|file| file.set_len(8 << 30)).expect("a file with a hole");
    let state = state.to_str().expect("UTF-8");
    let began = Instant::now();
    let (code, told) = soon(&["sim", &scene, "--steps", "1", "--load-state", state]);
    assert_eq!(code, Some(2), "{told}");
    assert!(told.contains("it does not begin like one"), "{told}");
    assert!(began.elapsed() < Duration::from_secs(2), "it took {:?}", began.elapsed());
}

#[test]
#[cfg(target_os = "linux")]
fn a_pipe_in_a_watched_folder_stops_nothing() {
    let (folder, scene) = scene_with("");
    let plugins = folder.path().join("plugins");
    fs::create_dir(&plugins).expect("a folder");
    let library = plugins.join("libreef_fixture_faulty.so");
    fs::copy(artifacts().plugin("reef_fixture_faulty"), &library).expect("a copy");
    let dir = plugins.to_str().expect("UTF-8").to_owned();
    let making = std::thread::spawn(move || {
        std::thread::sleep(Duration::from_millis(1500));
        pipe(&plugins.join("libfifo.so"));
        // One that is watched already, too.
        fs::remove_file(&library).expect("removed");
        pipe(&library);
    });
    let (code, told) = soon(&["sim", &scene, "--watch", "--steps", "240", "--plugin-dir", &dir]);
    making.join().expect("the pipes are made");
    assert_eq!(code, Some(0), "{told}");
    assert!(told.contains("it is no regular file"), "{told}");
}

#[test]
fn results_with_the_same_path_are_refused_before_the_first_step() {
    let (folder, scene) = scene_with("");
    let file = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let (out, same) = (file("out"), file("./out"));
    for pair in [["--record", "--save-state"], ["--save-state", "--journal"], ["--record", "--journal"]] {
        let (code, told) = soon(&["sim", &scene, "--steps", "1", pair[0], &out, pair[1], &same]);
        assert_eq!(code, Some(2), "{told}");
        let both = format!("{} and {} lead to the same file", pair[0], pair[1]);
        assert!(told.contains(&both) && !folder.path().join("out").exists(), "{told}");
    }
    let (code, told) = soon(&["sim", &scene, "--steps", "1", "--record", &out, "--journal", &file("other")]);
    assert_eq!(code, Some(0), "{told}");
}

#[test]
fn the_benches_are_listed_where_somebody_looks_for_them() {
    let help = text(&reef(&["bench", "--help"]).stdout);
    let (code, told) = soon(&["bench", "fiber"]);
    assert_eq!(code, Some(2), "{told}");
    assert!(told.contains("did you mean `fibre`?"), "{told}");
    for (name, about) in
        [("churn", "ten thousand reloads"), ("table1", "the paper's table 1"), ("waves", "orbits")]
    {
        assert!(help.contains(name) && help.contains(about), "{help}");
        assert!(told.contains(name) && told.contains(about), "{told}");
    }
}

#[test]
fn a_byte_order_mark_is_no_column_of_the_first_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = folder.path().join("sea.toml");
    for mark in ["", "\u{feff}"] {
        fs::write(&scene, format!("{mark}scene = {{ sed = 1 }}\n")).expect("a scene");
        let (code, told) = soon(&["scene", "check", scene.to_str().expect("UTF-8")]);
        assert_eq!(code, Some(2), "{told}");
        assert!(told.contains("sea.toml:1:11: scene.sed"), "{told}");
        assert!(told.contains("  1 | scene = { sed = 1 }\n    |           ^^^\n"), "{told}");
    }
}

#[test]
#[cfg(target_os = "linux")]
fn a_scale_of_windows_that_is_none_is_refused() {
    let (_folder, scene) = scene_with("");
    for (value, code) in [("abc", 2), ("-1", 2), ("1.5", 3)] {
        let mut command = command(&[&scene]);
        command.env("DISPLAY", ":no-such-display").env("WINIT_X11_SCALE_FACTOR", value);
        let output =
            command.env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET").output().expect("it runs");
        let told = text(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{value}: {told}");
        let named = told.contains(&format!("WINIT_X11_SCALE_FACTOR={value}: this is no scale"));
        assert_eq!(named, code == 2, "{value}: {told}");
    }
}

#[test]
#[cfg(target_os = "linux")]
fn drivers_that_the_environment_hides_are_named_before_installing() {
    // Without a loader there is nothing to be hidden.
    if env::var_os("REEF_REQUIRE").is_none() {
        return reef_tests::skip("REEF_REQUIRE is not set");
    }
    let (folder, scene) = scene_with("");
    let cut = folder.path().join("cut.json");
    fs::write(&cut, "{\"file_format_version\": \"1.0.0\", \"ICD\": {\"libr").expect("a file");
    let out = folder.path().join("out.png");
    for (path, fault) in
        [(cut.as_path(), "it is not JSON"), ("/no/such/driver.json".as_ref(), "No such file")]
    {
        let mut command = command(&["render", &scene, "--out", out.to_str().expect("UTF-8")]);
        let output =
            command.env_remove("VK_ICD_FILENAMES").env("VK_DRIVER_FILES", path).output().expect("it runs");
        let told = text(&output.stderr);
        assert_eq!(output.status.code(), Some(3), "{told}");
        assert!(told.contains("VK_DRIVER_FILES is set") && told.contains(fault), "{told}");
        assert!(!told.contains("install"), "{told}");
        // So does the doctor, who names the packages of other things that are missing.
        let mut command = crate::command(&["doctor", "--json"]);
        let output =
            command.env_remove("VK_ICD_FILENAMES").env("VK_DRIVER_FILES", path).output().expect("it runs");
        let told = text(&output.stdout);
        assert_eq!(output.status.code(), Some(3), "{told}");
        assert!(told.contains("VK_DRIVER_FILES is set") && told.contains(fault), "{told}");
        assert!(!told.contains("mesa-vulkan-drivers"), "{told}");
    }
}
