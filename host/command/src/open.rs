//! What every command does first: find assets and plugins, read the scene, make the sea.

use std::{
    path::{Path, PathBuf},
    thread,
};

use reef_plugin::Registry;
use reef_report::failure::Failure;
use reef_sea::{
    Options, World,
    reload::{Live, Setup},
    scene::{self, Scene, assets},
};

use crate::common::Common;

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
