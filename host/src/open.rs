//! What every command does first: find assets and plugins, read the scene, make the sea.

use std::{
    io::Write,
    path::{Path, PathBuf},
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    thread,
};

use crate::{
    cli::Common,
    failure::{Failure, Outcome},
    live::{Live, Setup},
    plain::Plain,
    plugin::Registry,
    world::{
        Options, World, assets,
        scene::{self, Scene},
    },
};

/// The scene that opens when none is named.
pub const DEFAULT_SCENE: &str = "reef";

/// The folder of assets.
pub fn assets_folder(common: &Common) -> Result<PathBuf, Failure> {
    assets::folder(common.assets.as_deref()).map_err(Failure::input)
}

/// Threads that simulate.
pub fn workers(common: &Common) -> usize {
    common.workers.unwrap_or_else(|| thread::available_parallelism().map_or(1, usize::from))
}

/// All plugins that can be found.
pub fn plugins(common: &Common) -> Result<Registry, Failure> {
    if let Some(missing) = common.plugin_dir.iter().find(|folder| !folder.is_dir()) {
        return Err(Failure::input(miette::miette!(
            "--plugin-dir {}: there is no such folder",
            missing.display()
        )));
    }
    let registry = Registry::find(&common.plugin_dir, workers(common));
    for refused in registry.refused() {
        tracing::warn!("{} {}", refused.path.display(), refused.reason);
    }
    for (path, note) in registry.notes() {
        tracing::info!("{}: {note}", path.display());
    }
    Ok(registry)
}

/// Reads a scene: a path, or the bare name of one in assets/scenes.
pub fn scene(common: &Common, wanted: &Path, plugins: &Registry) -> Result<Scene, Failure> {
    let folder = assets_folder(common)?;
    scene::load(&assets::scene(wanted, &folder), &folder, plugins).map_err(Failure::input)
}

/// Reads a scene and makes its sea, with the command line's seed and workers.
pub fn world(common: &Common, wanted: &Path, options: Options) -> Result<World, Failure> {
    let plugins = plugins(common)?;
    let scene = scene(common, wanted, &plugins)?;
    let options = Options { seed: common.seed, ..options };
    World::new(scene, &plugins, &options).map_err(Failure::input)
}

/// What standard output did not take.
static UNSAID: Mutex<Option<std::io::Error>> = Mutex::new(None);

/// Lets a sea's plugins and scene change while it runs.
pub fn live(common: &Common, plugins: Registry, world: &World) -> Result<Live, Failure> {
    let setup = Setup {
        plugins,
        folders: common.plugin_dir.clone(),
        workers: workers(common),
        seed: common.seed,
        assets: assets_folder(common)?,
    };
    Live::new(setup, world).map_err(|problem| Failure::machine(miette::miette!("{problem}")))
}

/// The reader of standard output went away.
static IS_ALONE: AtomicBool = AtomicBool::new(false);

/// One line on standard output, without the control characters of others. A reader that went away is no error: whoever
/// wanted more would have stayed. Anything else (a full disk) is told by [`all_said`].
pub fn say(line: impl std::fmt::Display) {
    match writeln!(std::io::stdout().lock(), "{}", Plain(line)) {
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => {
            IS_ALONE.store(true, Ordering::Relaxed);
        }
        Err(error) => {
            *UNSAID.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
        }
        Ok(()) => {}
    }
}

/// Is anybody there to read what is said? Without a reader, work that is done for its words alone ends.
pub fn is_heard() -> bool {
    !IS_ALONE.load(Ordering::Relaxed)
}

/// Fails when something that a command said got lost.
pub fn all_said() -> Outcome {
    match UNSAID.lock().unwrap_or_else(PoisonError::into_inner).take() {
        None => Ok(()),
        Some(error) => Err(Failure::machine(miette::miette!("standard output cannot be written: {error}"))),
    }
}

/// A path in an answer that is JSON, which has no bytes but those of UTF-8: what is none is shown as a replacement character.
pub fn shown(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}

/// A progress bar on standard error; nothing where that is no terminal, or nobody would have to wait for it.
pub fn progress(length: u64, what: &'static str, wanted: bool) -> indicatif::ProgressBar {
    if !wanted {
        return indicatif::ProgressBar::hidden();
    }
    let bar = indicatif::ProgressBar::new(length);
    let style = indicatif::ProgressStyle::with_template("{prefix} {bar:32} {pos}/{len} {eta} left");
    if let Ok(style) = style {
        bar.set_style(style);
    }
    bar.set_prefix(what);
    bar
}
