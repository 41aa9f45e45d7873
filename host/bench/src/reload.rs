//! `reef bench reload`: how soon a new build's first step comes.
//!
//! Every plugin that a scene can use without configuration is measured; with `--plugin-dir` only those found
//! there. Builds differ in bytes behind the library's end.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::{Arc, Mutex, PoisonError},
    thread,
    time::{Duration, Instant},
};

use reef_command::{Common, open};
use reef_plugin::{Registry, copies};
use reef_report::failure::Failure;
use reef_sea::{
    Options, World,
    reload::{Arrival, Live, REMEMBER, Setup, pace},
    scene,
};

use super::report::{Bar, Report};

/// Builds that are renamed into place.
const BUILDS: usize = 150;

/// A build that differs from all others by bytes that nobody reads.
pub(super) fn build(bytes: &[u8], number: u64) -> Vec<u8> {
    let mut build = bytes.to_vec();
    build.extend_from_slice(&number.to_le_bytes());
    build
}

pub(super) fn failed(what: &str, error: impl std::fmt::Display) -> Failure {
    Failure::check(miette::miette!("{what}: {error}"))
}

/// A sea of one module of this plugin, in a folder of its own; None: it wants a configuration.
pub(super) fn sea(
    path: &Path,
    id: &str,
    folder: &Path,
    assets: &Path,
) -> Result<Option<(Registry, World)>, Failure> {
    let mut plugins = Registry::new();
    plugins.load(path, 2).map_err(|refusal| failed(id, refusal))?;
    let file = folder.join("scene.toml");
    let text = format!("[scene]\nname = \"Bench: reload\"\n\n[modules.one]\nuse = \"{id}\"\n");
    fs::write(&file, text).map_err(|error| failed("the bench's scene", error))?;
    let options = Options { remember: Some(REMEMBER), ..Options::default() };
    let world = scene::load(&file, assets, &plugins)
        .ok()
        .and_then(|scene| World::new(scene, &plugins, &options).ok());
    Ok(world.map(|world| (plugins, world)))
}

/// Times of the same thing [s], in order.
#[derive(Clone, Debug, Default)]
pub struct Times(Vec<f64>);

impl Times {
    fn new(times: impl Iterator<Item = f64>) -> Self {
        let mut times: Vec<f64> = times.collect();
        times.sort_by(f64::total_cmp);
        Self(times)
    }

    /// The time within which this share of them were [s].
    pub fn within(&self, share: f64) -> f64 {
        let last = self.0.len().saturating_sub(1) as f64;
        self.0.get((share * last).ceil() as usize).copied().unwrap_or(f64::NAN)
    }
}

/// How soon new builds ran.
#[derive(Clone, Debug, Default)]
pub struct Soon {
    /// From before a file was renamed into place until the first step with its code was made.
    pub whole: Times,
    /// What that time went to: until the file was read, until it was loaded, until its instances were in
    /// their places, and until they had stepped.
    pub parts: [Times; 4],
    /// The longest time between two steps, over a step's length.
    pub longest: f64,
    /// Builds that did not come to run.
    pub missed: usize,
}

/// Renames builds into place, at all phases of a step, while a sea runs at its pace.
pub fn soon(path: &Path, id: &str, assets: &Path, count: usize) -> Result<Option<Soon>, Failure> {
    let folders = copies::folders();
    let folder = folders.first().map_or_else(tempfile::tempdir, tempfile::tempdir_in);
    let folder = folder.map_err(|error| failed("a folder", error))?;
    let bytes = fs::read(path).map_err(|error| failed(&path.display().to_string(), error))?;
    let name = path.file_name().unwrap_or_default();
    let plugin_folder = folder.path().join("plugins");
    let place = plugin_folder.join(name);
    let written = fs::create_dir(&plugin_folder).and_then(|()| fs::write(&place, &bytes));
    written.map_err(|error| failed("a folder of plugins", error))?;
    let Some((plugins, mut world)) = sea(&place, id, folder.path(), assets)? else { return Ok(None) };
    let setup =
        Setup { plugins, folders: vec![plugin_folder], workers: 2, seed: None, assets: assets.to_owned() };
    let mut live = Live::new(setup, &world).map_err(|problem| failed(id, problem))?;
    let dt = world.clock().dt;
    // When the last build was renamed, until it was seen to run.
    let renamed: Arc<Mutex<Option<Instant>>> = Arc::default();
    let partial = folder.path().join("partial");
    let writer = {
        let renamed = renamed.clone();
        thread::spawn(move || {
            let lock = || renamed.lock().unwrap_or_else(PoisonError::into_inner);
            for number in 0..count {
                // Seven steps and a part that walks through all phases.
                let phase = (number as f64 * 0.618_034).fract();
                thread::sleep(Duration::from_secs_f64(dt * (7.0 + phase)));
                if fs::write(&partial, build(&bytes, number as u64)).is_err() {
                    return;
                }
                let end = Instant::now() + Duration::from_secs(2);
                while lock().is_some() && Instant::now() < end {
                    thread::sleep(Duration::from_millis(1));
                }
                *lock() = Some(Instant::now());
                if fs::rename(&partial, &place).is_err() {
                    return;
                }
            }
            let end = Instant::now() + Duration::from_secs(2);
            while lock().is_some() && Instant::now() < end {
                thread::sleep(Duration::from_millis(1));
            }
        })
    };
    let mut soon = Soon::default();
    let mut came: Vec<[Instant; 5]> = Vec::new();
    let mut last: Option<Instant> = None;
    pace(&mut live, &mut world, u64::MAX, |live, _, is_first| {
        let now = Instant::now();
        if let Some(last) = last.replace(now) {
            soon.longest = soon.longest.max((now - last).as_secs_f64() / dt);
        }
        if is_first
            && let Some(Arrival { seen, loaded, taken }) = live.arrival()
            && let Some(since) = renamed.lock().unwrap_or_else(PoisonError::into_inner).take()
        {
            came.push([since, seen, loaded, taken, now]);
        }
        !writer.is_finished()
    });
    let between = |from: usize, to: usize| {
        Times::new(came.iter().map(|at| at[to].saturating_duration_since(at[from]).as_secs_f64()))
    };
    soon.whole = between(0, 4);
    soon.parts = std::array::from_fn(|part| between(part, part + 1));
    soon.missed = count - came.len();
    Ok(Some(soon))
}

/// Measures.
pub fn run(common: &Common) -> Result<Report, Failure> {
    let assets = open::assets_folder(common)?;
    let mut report = Report::default();
    for (path, id) in candidates(common)? {
        let Some(soon) = soon(&path, &id, &assets, BUILDS)? else { continue };
        let whole = &soon.whole;
        let ms = |times: &Times, share| 1e3 * times.within(share);
        let what = format!("{id}: renamed into place to first step, p50");
        report.judged(what, ms(whole, 0.5), "ms", Bar::AtMost(16.7));
        report.judged(format!("{id}: the same, p99"), ms(whole, 0.99), "ms", Bar::AtMost(25.0));
        for (what, times) in ["read", "loaded", "made", "waited for its step"].iter().zip(&soon.parts) {
            report.figure(format!("{id}: of it {what}, p50"), ms(times, 0.5), "ms");
        }
        report.judged(format!("{id}: builds that did not run"), soon.missed as f64, "", Bar::AtMost(0.0));
        let what = format!("{id}: longest time between two steps");
        report.judged(what, soon.longest, "steps", Bar::AtMost(2.0));
    }
    if report.figures.is_empty() {
        return Err(none_found());
    }
    report.note(format!(
        "{BUILDS} builds are renamed into place at all phases of a step, while the sea runs at 60 steps a second; the clock \
         starts before the rename and stops after the first step with the new code. The files are in memory: how long a \
         disk holds a rename up is not measured."
    ));
    Ok(report)
}

/// Plugins that are measured: files and ids.
pub(super) fn candidates(common: &Common) -> Result<Vec<(PathBuf, String)>, Failure> {
    let mut plugins = open::plugins(common)?;
    plugins.wake();
    let named = |path: &Path| common.plugin_dir.iter().any(|folder| path.parent() == Some(folder));
    let all = plugins.infos().filter_map(|info| Some((info.path.clone()?, info.id.clone())));
    Ok(all.filter(|(path, _)| common.plugin_dir.is_empty() || named(path)).collect())
}

/// Nothing was measured.
pub(super) fn none_found() -> Failure {
    Failure::input(miette::miette!(
        "no plugin was found that a scene can use without configuration: name a folder with --plugin-dir"
    ))
}
