//! Newer builds, older builds, edited scenes: what changes while a sea runs, and what does not.

mod builds;
mod faults;
mod figures;
mod same;
mod scenes;
mod strikes;

use std::{
    fs::{self, File},
    io::Write,
    path::{Path, PathBuf},
    sync::{
        OnceLock,
        atomic::{AtomicU64, Ordering},
    },
    time::{Duration, Instant},
};

use reef_plugin::{Plugin, Registry};
use reef_sea::{
    Options, World,
    reload::{Live, Setup},
    scene,
};
use reef_tests::artifacts::{variant, workspace};
use tempfile::TempDir;

/// Builds of the growing fixture, by their features.
fn builds(features: &str) -> Vec<u8> {
    fs::read(build_file(features)).expect("a build")
}

/// The same as files, which stay until this program ends.
fn build_file(features: &str) -> PathBuf {
    static FOLDER: OnceLock<TempDir> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| tempfile::tempdir().expect("a folder for builds"));
    let features = if features.is_empty() { "default-none" } else { features };
    let kept = folder.path().join(format!("reef_fixture_growing-{features}{}", std::env::consts::DLL_SUFFIX));
    static ONE_AT_A_TIME: std::sync::Mutex<()> = std::sync::Mutex::new(());
    let _turn = ONE_AT_A_TIME.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    if !kept.is_file() {
        variant("reef-fixture-growing", "reef_fixture_growing", features, folder.path());
    }
    kept
}

/// A sea of this scene, whose modules are all of one build, and that build; each state is saved every so many
/// steps.
fn sea_of(build: &[u8], scene: &str, remember: u64) -> (World, Plugin) {
    let folder = tempfile::tempdir().expect("a folder");
    let library = folder.path().join(library_name());
    let path = folder.path().join("scene.toml");
    fs::write(&library, build).expect("the plugin");
    fs::write(&path, scene).expect("the scene");
    let mut plugins = Registry::new();
    plugins.load(&library, 2).expect("a sound library");
    let scene = scene::load(&path, &workspace().join("assets"), &plugins).expect("a sound scene");
    let options = Options { remember: Some(remember), ..Options::default() };
    let world = World::new(scene, &plugins, &options).expect("a sea");
    let plugin = world.instance(0).expect("a module").plugin().clone();
    (world, plugin)
}

/// The same build, with other bytes behind its end: what a linker makes of an edit that changes nothing.
fn another(mut build: Vec<u8>) -> Vec<u8> {
    static NEXT: AtomicU64 = AtomicU64::new(1);
    build.extend_from_slice(&NEXT.fetch_add(1, Ordering::Relaxed).to_le_bytes());
    build
}

/// A sea of one module (or more) that runs while builds come.
struct Place {
    folder: TempDir,
    live: Live,
    world: World,
}

const SCENE: &str = "[scene]\nname = \"Reload\"\n\n[modules.growing]\nuse = \"fixture.growing\"\n";

impl Place {
    fn new(build: &[u8], scene: &str) -> Self {
        Self::remembering(build, scene, 0)
    }

    /// One that remembers this much of its past [bytes].
    fn remembering(build: &[u8], scene: &str, history: usize) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let library = folder.path().join("plugins").join(library_name());
        fs::create_dir(folder.path().join("plugins")).expect("a folder for plugins");
        fs::write(&library, build).expect("the plugin");
        fs::write(folder.path().join("scene.toml"), scene).expect("the scene");
        let mut registry = Registry::new();
        registry.load_folder(&folder.path().join("plugins"), 2, true);
        assert!(registry.refused().is_empty(), "{:?}", registry.refused());
        let assets = workspace().join("assets");
        let scene =
            scene::load(&folder.path().join("scene.toml"), &assets, &registry).expect("a sound scene");
        let options = Options { remember: Some(20), history, ..Options::default() };
        let world = World::new(scene, &registry, &options).expect("a sea");
        let setup = Setup {
            plugins: registry,
            folders: vec![folder.path().join("plugins")],
            workers: 2,
            seed: None,
            assets,
        };
        let live = Live::new(setup, &world).expect("a watched folder");
        Self { folder, live, world }
    }

    fn library(&self) -> PathBuf {
        self.folder.path().join("plugins").join(library_name())
    }

    /// Puts a build into place as cargo and most linkers do.
    fn rename_into_place(&self, build: &[u8]) {
        let partial = self.folder.path().join("partial");
        fs::write(&partial, build).expect("a partial file");
        fs::rename(&partial, self.library()).expect("renamed");
    }

    /// Steps at a pace until `done` or ten seconds have passed.
    fn run(&mut self, mut done: impl FnMut(&mut Live, &mut World) -> bool) -> bool {
        let end = Instant::now() + Duration::from_secs(10);
        while Instant::now() < end {
            self.live.tend(&mut self.world);
            if done(&mut self.live, &mut self.world) {
                return true;
            }
            self.world.step();
            std::thread::sleep(Duration::from_millis(2));
        }
        false
    }

    /// Runs until so many builds have come to their end, taken or refused; returns all news.
    fn until(&mut self, reloads: u64, refusals: u64) -> String {
        let mut news = String::new();
        let done = self.run(|live, _| {
            for notice in live.take_notices() {
                news += &format!("{}\n", notice.text);
            }
            let counts = live.counts();
            (counts.reloads, counts.refusals) == (reloads, refusals)
        });
        let counts = self.live.counts();
        assert!(done, "wanted {reloads} reloads and {refusals} refusals: {counts:?}\n{news}");
        news
    }

    fn height(&self) -> f64 {
        f64::from(self.world.frame().outputs[0].fibre_nodes[1].position[1])
    }

    /// Growth in one step.
    fn growth(&mut self) -> f64 {
        let before = self.height();
        self.world.step();
        self.height() - before
    }
}

fn library_name() -> String {
    format!("{}reef_fixture_growing{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX)
}

/// Writes a file in pieces, with pauses between them.
fn write_slowly(path: &Path, bytes: &[u8], pieces: usize, pause: Duration) {
    let mut file = File::create(path).expect("created");
    for piece in bytes.chunks(bytes.len().div_ceil(pieces)) {
        file.write_all(piece).expect("written");
        file.flush().expect("flushed");
        std::thread::sleep(pause);
    }
}
