//! The window on a display of its own: what a person does to it, under the validation layers.
//!
//! Skips, with the reason, where Xvfb, its tools or Vulkan are missing; fails instead where
//! `REEF_REQUIRE=all`.

#[path = "window/display.rs"]
mod display;

use std::{
    io::{BufRead, BufReader},
    path::{Path, PathBuf},
    process::{Child, Command, Output, Stdio},
    sync::{Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

use display::{Display, liveliness};
use reef_gpu::{Gpu, GpuOptions, Validation};
use reef_render::pictures::read_png;
use reef_tests::{
    artifacts::{artifacts, workspace},
    child::wait,
    own,
};
use tempfile::TempDir;

/// lavapipe on two busy cores draws a few frames a second under validation; a hang is what this catches.
const PATIENCE: Duration = Duration::from_secs(400);

/// One window at a time: two would share the processor that draws them.
static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

/// A display, and the program with its plugins beside it.
struct Bench {
    display: Display,
    folder: TempDir,
    _turn: MutexGuard<'static, ()>,
}

impl Bench {
    /// None, with the reason printed, where this machine cannot show a window.
    fn new(size: &str) -> Option<Self> {
        let turn = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
        let options = GpuOptions { validation: Validation::CoreSync, ..GpuOptions::default() };
        let vulkan = Gpu::open(&options).map(Gpu::close).map_err(|error| error.to_string());
        match vulkan.and_then(|_| Display::start(size)) {
            Ok(display) => {
                let folder = artifacts().side_by_side(&own::libraries());
                Some(Self { display, folder, _turn: turn })
            }
            Err(reason) => {
                reef_tests::skip(&reason);
                None
            }
        }
    }

    fn reef(&self) -> Command {
        Command::new(self.folder.path().join("reef"))
    }

    fn start(&self, args: &[&str]) -> Child {
        self.command(args).spawn().expect("reef starts")
    }

    fn command(&self, args: &[&str]) -> Command {
        let mut command = self.reef();
        command
            .args(args)
            .arg("--assets")
            .arg(workspace().join("assets"))
            .current_dir(self.folder.path())
            .env("DISPLAY", &self.display.name)
            .env_remove("WAYLAND_DISPLAY")
            .env_remove("WAYLAND_SOCKET")
            .env("REEF_VALIDATE", "1")
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        command
    }

    fn quit(&self, window: &str) {
        self.display.hand(&["windowfocus", "--sync", window]);
        self.display.hand(&["key", "ctrl+q"]);
    }
}

fn library_name(target: &str) -> String {
    format!("{}{target}{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX)
}

fn assert_clean(output: &Output) {
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{}\n{errors}", output.status);
    for word in ["VUID", "Validation", "panicked", "ERROR", "leak"] {
        assert!(!errors.contains(word), "{errors}");
    }
}

#[test]
fn a_window_of_300_frames_ends_by_itself_without_a_validation_message() {
    let Some(bench) = Bench::new("800x600") else { return };
    let args = ["reef", "--frames", "300", "--size", "320x180", "--json"];
    let output = wait(bench.start(&args), PATIENCE, "300 frames");
    assert_clean(&output);
    let summary = summary(&output);
    assert_eq!(summary["frames"], 300);
    assert!(summary["steps"].as_u64() > Some(0), "the sea did not move: {summary}");
}

#[test]
fn a_planted_fault_makes_the_windows_run_fail() {
    let Some(bench) = Bench::new("400x300") else { return };
    let run = bench
        .reef()
        .args(["reef", "--frames", "3", "--size", "200x150"])
        .env("DISPLAY", &bench.display.name)
        .env_remove("WAYLAND_DISPLAY")
        .env("REEF_VALIDATE", "1")
        .env(reef_gpu::FAULT_VARIABLE, "leak")
        .stderr(Stdio::piped())
        .spawn()
        .expect("reef starts");
    let output = wait(run, PATIENCE, "3 frames");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{errors}");
    assert!(errors.contains("planted leak"), "{errors}");
}

#[test]
fn two_hundred_resizes_and_a_minimised_window_leave_a_living_picture() {
    let Some(bench) = Bench::new("1000x800") else { return };
    let display = &bench.display;
    let mut child = bench.start(&["reef", "--size", "640x400"]);
    let window = display.window_of(&mut child);
    // A fixed sequence over the whole range of sizes, the smallest among them.
    let mut state = 1u32;
    for i in 0..200 {
        let mut next = |most: u32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            1 + (state >> 8) % most
        };
        let (width, height) = if i % 25 == 7 { (1, 1) } else { (next(700), next(500)) };
        display.hand(&["windowsize", &window, &width.to_string(), &height.to_string()]);
        if i % 10 == 0 {
            // Time for a frame at this size; in between, sizes come faster than frames.
            std::thread::sleep(Duration::from_millis(150));
        }
    }
    for _ in 0..2 {
        display.hand(&["windowunmap", &window]);
        std::thread::sleep(Duration::from_millis(700));
        display.hand(&["windowmap", &window]);
        std::thread::sleep(Duration::from_millis(700));
    }
    display.hand(&["windowsize", &window, "900", "600"]);
    let picture = bench.folder.path().join("window.png");
    let end = Instant::now() + PATIENCE;
    let mut before: Option<Vec<u8>> = None;
    loop {
        std::thread::sleep(Duration::from_millis(500));
        assert!(child.try_wait().is_ok_and(|status| status.is_none()), "reef ended while it was resized");
        display.picture(&picture);
        let (deviation, colors) = liveliness(&picture);
        // The bare screen is black: 0 and 1. The sea alone has a gradient of some hundred colours.
        let lively = deviation > 0.03 && colors > 300;
        // And it goes on: what stands still is left from before the last size.
        let shown = read_png(&picture).expect("a screenshot").rgba;
        let goes_on = before.is_some_and(|before| before != shown);
        if lively && goes_on {
            break;
        }
        before = Some(shown);
        assert!(Instant::now() < end, "a flat or a dead picture: deviation {deviation}, {colors} colours");
    }
    keep(&picture, "window-after-resizes.png");
    bench.quit(&window);
    assert_clean(&wait(child, PATIENCE, "closing"));
}

#[test]
fn what_hands_did_in_the_window_is_replayed_headless_to_the_same_bytes() {
    let Some(bench) = Bench::new("800x600") else { return };
    let display = &bench.display;
    let mut child = bench.start(&["reef", "--size", "640x360", "--journal", "journal", "--json"]);
    let window = display.window_of(&mut child);
    display.hand(&["windowfocus", "--sync", &window]);
    std::thread::sleep(Duration::from_secs(3));
    // Stir the water, turn the camera (which must not matter), come closer, pause and go on, save a picture.
    display.hand(&["mousemove", "--window", &window, "150", "240", "mousedown", "3"]);
    for x in (150..330).step_by(15) {
        display.hand(&["mousemove", "--window", &window, &x.to_string(), "220"]);
        std::thread::sleep(Duration::from_millis(100));
    }
    display.hand(&["mouseup", "3"]);
    display.hand(&["mousemove", "--window", &window, "200", "150", "mousedown", "1"]);
    display.hand(&["mousemove", "--window", &window, "260", "170", "mouseup", "1", "click", "4"]);
    display.hand(&["key", "space"]);
    std::thread::sleep(Duration::from_millis(500));
    display.hand(&["key", "space", "F12"]);
    let picture = bench.folder.path().join("reef-Reef-001.png");
    let end = Instant::now() + PATIENCE;
    while !picture.is_file() {
        assert!(Instant::now() < end, "F12 saved no picture");
        std::thread::sleep(Duration::from_millis(100));
    }
    bench.quit(&window);
    let output = wait(child, PATIENCE, "closing");
    assert_clean(&output);
    let window = summary(&output);
    let steps = window["steps"].to_string();
    assert!(window["events"].as_u64() > Some(0), "no stirring reached the journal: {window}");
    let hash = window["hash"].as_str().expect("a hash").to_owned();

    keep(&picture, "window-f12.png");
    assert!(liveliness(&picture).1 > 300, "the saved picture is flat");

    let replay = |journal: &[&str]| {
        let mut sim = bench.reef();
        sim.args(["sim", "reef", "--steps", &steps, "--hash", "--json"]).args(journal);
        sim.arg("--assets").arg(workspace().join("assets"));
        let output = sim.current_dir(bench.folder.path()).output().expect("reef starts");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        summary(&output)["hash"].as_str().expect("a hash").to_owned()
    };
    assert_eq!(replay(&["--replay", "journal"]), hash);
    assert_ne!(replay(&[]), hash, "the stirring changed nothing");
}

#[test]
fn newer_builds_are_taken_up_while_the_window_runs() {
    const BUILDS: u32 = 12;
    let Some(bench) = Bench::new("400x300") else { return };
    let args = ["anemone-fig13-36-anemones", "--size", "320x180"];
    let mut command = bench.command(&args);
    let mut child = command.env("REEF_LOG", "reef=info").spawn().expect("reef starts");
    let window = bench.display.window_of(&mut child);
    // What it says, with the time at which it said it.
    let errors = child.stderr.take().expect("a pipe");
    let (say, said) = std::sync::mpsc::channel();
    let reader = std::thread::spawn(move || {
        for line in BufReader::new(errors).lines().map_while(Result::ok) {
            if say.send((Instant::now(), line)).is_err() {
                return;
            }
        }
    });
    let library = bench.folder.path().join(library_name("reef_anemone"));
    let (partial, bytes) = (bench.folder.path().join("partial"), std::fs::read(&library).expect("a build"));
    let mut times = Vec::new();
    let mut all = String::new();
    for number in 0..BUILDS {
        let mut build = bytes.clone();
        build.extend_from_slice(&number.to_le_bytes());
        std::fs::write(&partial, build).expect("a partial file");
        let renamed = Instant::now();
        std::fs::rename(&partial, &library).expect("renamed");
        loop {
            let (when, line) = said.recv_timeout(Duration::from_secs(60)).unwrap_or_else(|error| {
                panic!("build {number} was not taken within a minute ({error}):\n{all}");
            });
            all += &format!("{line}\n");
            if line.contains("carried on") {
                times.push(when - renamed);
                break;
            }
        }
        // At another phase of a frame each time.
        std::thread::sleep(Duration::from_millis(u64::from(200 + 37 * number % 100)));
    }
    bench.quit(&window);
    assert_clean(&wait(child, PATIENCE, "closing"));
    reader.join().expect("the reader");
    times.sort();
    let [half, most] = [times.len() / 2, times.len() - 1].map(|at| times[at].as_secs_f64() * 1e3);
    println!("renamed into place to taken up, in a window: p50 {half:.1} ms, at most {most:.1} ms");
    for word in ["VUID", "panicked", "refused"] {
        assert!(!all.contains(word), "{all}");
    }
}

#[test]
fn without_a_display_reef_says_how_to_do_without() {
    let output = Command::new(artifacts().reef())
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .env_remove("WAYLAND_SOCKET")
        .output()
        .expect("reef starts");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{errors}");
    assert!(errors.contains("reef render"), "{errors}");
}

#[test]
fn a_stale_wayland_display_gives_way_to_one_of_x() {
    let Some(bench) = Bench::new("400x300") else { return };
    let output = bench
        .command(&["--frames", "5", "--size", "200x150"])
        .env("WAYLAND_DISPLAY", "wayland-gone")
        .env("XDG_RUNTIME_DIR", bench.folder.path())
        .output()
        .expect("reef starts");
    assert_clean(&output);
}

#[test]
fn a_size_that_is_none_is_refused_by_name() {
    for size in ["640", "0x5", "axb", "-1x4", "640x99999999"] {
        let output =
            Command::new(artifacts().reef()).arg(format!("--size={size}")).output().expect("reef starts");
        let errors = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{size}: {errors}");
        assert!(errors.contains("640x360"), "{errors}");
    }
}

/// The JSON that a run prints at its end.
fn summary(output: &Output) -> serde_json::Value {
    let text = String::from_utf8_lossy(&output.stdout);
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

/// Leaves a picture in the folder REEF_KEEP, where somebody can look at it.
fn keep(picture: &Path, name: &str) {
    if let Some(folder) = std::env::var_os("REEF_KEEP") {
        let kept = PathBuf::from(folder).join(name);
        if let Err(error) = std::fs::copy(picture, &kept) {
            eprintln!("{}: {error}", kept.display());
        }
    }
}
