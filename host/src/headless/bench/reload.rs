//! `reef bench reload`: what ten thousand reloads leave behind, and how soon a new build's first step comes.
//!
//! Every plugin that a scene can use without configuration is measured; with `--plugin-dir` only those found there. Builds
//! differ in bytes behind the library's end.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::{Arc, Mutex, PoisonError, mpsc},
    thread,
    time::{Duration, Instant},
};

use super::report::{Bar, Report};
use crate::{
    cli::Common,
    failure::Failure,
    headless::watch::pace,
    live::{Live, REMEMBER, Setup},
    open,
    plugin::{Library, Registry, pinned},
    world::{
        Options, World, scene,
        swap::{Job, Swap},
    },
};

/// Reloads of each plugin.
const RELOADS: u64 = 10_000;
/// Reloads before anything is counted: allocators and caches have their size then.
const WARM: u64 = 300;
/// Builds that are renamed into place.
const BUILDS: usize = 150;

/// What a process holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Held {
    /// Mapped regions.
    pub mappings: usize,
    /// Open files.
    pub descriptors: usize,
    /// Copies of libraries in the folder of temporary files.
    pub copies: usize,
    /// Memory in use [bytes].
    pub resident: usize,
}

impl Held {
    /// What this process holds now. Zero where the system does not tell.
    pub fn now(stem: &str) -> Self {
        let lines = |path: &str| fs::read_to_string(path).map_or(0, |text| text.lines().count());
        let entries = |folder: &Path| fs::read_dir(folder).into_iter().flatten().flatten();
        let own = |entry: &fs::DirEntry| entry.file_name().to_string_lossy().starts_with(stem);
        let statm = fs::read_to_string("/proc/self/statm").unwrap_or_default();
        let pages: usize = statm.split(' ').nth(1).and_then(|pages| pages.parse().ok()).unwrap_or(0);
        Self {
            mappings: lines("/proc/self/maps"),
            descriptors: entries(Path::new("/proc/self/fd")).count(),
            copies: entries(&std::env::temp_dir()).filter(own).count(),
            resident: pages * 4096,
        }
    }
}

/// What many reloads did.
#[derive(Clone, Copy, Debug, Default)]
pub struct Churn {
    /// After the warm-up.
    pub before: Held,
    /// At the end.
    pub after: Held,
    /// Builds that were refused.
    pub refused: u64,
    /// Libraries that were closed and stayed.
    pub pinned: u64,
}

/// A build that differs from all others by bytes that nobody reads.
fn build(bytes: &[u8], number: u64) -> Vec<u8> {
    let mut build = bytes.to_vec();
    build.extend_from_slice(&number.to_le_bytes());
    build
}

fn failed(what: &str, error: impl std::fmt::Display) -> Failure {
    Failure::check(miette::miette!("{what}: {error}"))
}

/// A sea of one module of this plugin, in a folder of its own; None: it wants a configuration.
fn sea(path: &Path, id: &str, folder: &Path, assets: &Path) -> Result<Option<(Registry, World)>, Failure> {
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

/// Loads a plugin anew again and again, each time with its state, one step after each.
pub fn churn(path: &Path, id: &str, assets: &Path, warm: u64, count: u64) -> Result<Option<Churn>, Failure> {
    let folder = tempfile::tempdir().map_err(|error| failed("a folder", error))?;
    let Some((plugins, mut world)) = sea(path, id, folder.path(), assets)? else { return Ok(None) };
    drop(plugins);
    let bytes = fs::read(path).map_err(|error| failed(&path.display().to_string(), error))?;
    let stem = format!("{}-", path.file_stem().unwrap_or_default().to_string_lossy());
    let mut churn = Churn { pinned: pinned(), ..Churn::default() };
    let (give, jobs) = mpsc::channel::<Arc<Job>>();
    let worker = thread::spawn(move || jobs.iter().for_each(|job| job.work(|| {})));
    for number in 0..warm + count {
        if number == warm {
            churn.before = Held::now(&stem);
        }
        let Ok((library, plugins)) = Library::load_bytes(path, &build(&bytes, number), 2) else {
            churn.refused += 1;
            continue;
        };
        let job = world.order_reload(&plugins).map_err(|error| failed(id, error))?;
        drop((library, plugins));
        if let Some(job) = job
            && give.send(job.clone()).is_ok()
        {
            job.wait(world.clock().step, Duration::from_secs(10));
            match world.swap(&job) {
                Swap::Done(former) => drop(former),
                outcome => return Err(failed(id, format!("a reload ended with {outcome:?}"))),
            }
        }
        world.step();
    }
    drop(give);
    if worker.join().is_err() {
        return Err(failed(id, "the thread beside the sea failed"));
    }
    churn.after = Held::now(&stem);
    churn.pinned = pinned() - churn.pinned;
    Ok(Some(churn))
}

/// How soon new builds ran.
#[derive(Clone, Debug, Default)]
pub struct Soon {
    /// From before a file was renamed into place until the first step with its code was made [s], in order.
    pub times: Vec<f64>,
    /// The longest time between two steps, over a step's length.
    pub longest: f64,
    /// Builds that did not come to run.
    pub missed: usize,
}

impl Soon {
    /// The time within which this share of the builds ran [s].
    pub fn within(&self, share: f64) -> f64 {
        let last = self.times.len().saturating_sub(1) as f64;
        self.times.get((share * last).ceil() as usize).copied().unwrap_or(f64::NAN)
    }
}

/// Renames builds into place, at all phases of a step, while a sea runs at its pace.
pub fn soon(path: &Path, id: &str, assets: &Path, count: usize) -> Result<Option<Soon>, Failure> {
    let folder = tempfile::tempdir().map_err(|error| failed("a folder", error))?;
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
    let mut last: Option<Instant> = None;
    pace(&mut live, &mut world, u64::MAX, |_, _, is_first| {
        let now = Instant::now();
        if let Some(last) = last.replace(now) {
            soon.longest = soon.longest.max((now - last).as_secs_f64() / dt);
        }
        if is_first && let Some(since) = renamed.lock().unwrap_or_else(PoisonError::into_inner).take() {
            soon.times.push((now - since).as_secs_f64());
        }
        !writer.is_finished()
    });
    soon.missed = count - soon.times.len();
    soon.times.sort_by(f64::total_cmp);
    Ok(Some(soon))
}

/// Measures.
pub fn run(common: &Common) -> Result<Report, Failure> {
    let assets = open::assets_folder(common)?;
    let mut report = Report::default();
    let mut measured = 0;
    for (path, id) in candidates(common)? {
        let Some(churn) = churn(&path, &id, &assets, WARM, RELOADS)? else { continue };
        measured += 1;
        let grown = |after: usize, before: usize| after as f64 - before as f64;
        let (a, b) = (churn.after, churn.before);
        let flat = Bar::AtMost(0.0);
        report.judged(
            format!("{id}: mappings more after {RELOADS} reloads"),
            grown(a.mappings, b.mappings),
            "",
            flat,
        );
        report.judged(format!("{id}: open files more"), grown(a.descriptors, b.descriptors), "", flat);
        report.judged(format!("{id}: temporary files more"), grown(a.copies, b.copies), "", flat);
        let megabytes = grown(a.resident, b.resident) / 1e6;
        report.judged(format!("{id}: memory more"), megabytes, "MB", Bar::AtMost(1.0));
        report.judged(format!("{id}: refused"), churn.refused as f64, "", flat);
        report.judged(format!("{id}: closed but still mapped"), churn.pinned as f64, "", flat);
        let Some(soon) = soon(&path, &id, &assets, BUILDS)? else { continue };
        let ms = |share| 1e3 * soon.within(share);
        report.judged(
            format!("{id}: renamed into place to first step, p50"),
            ms(0.5),
            "ms",
            Bar::AtMost(16.7),
        );
        report.judged(format!("{id}: the same, p99"), ms(0.99), "ms", Bar::AtMost(25.0));
        report.judged(format!("{id}: builds that did not run"), soon.missed as f64, "", flat);
        report.judged(
            format!("{id}: longest time between two steps"),
            soon.longest,
            "steps",
            Bar::AtMost(2.0),
        );
    }
    if measured == 0 {
        return Err(Failure::input(miette::miette!(
            "no plugin was found that a scene can use without configuration: name a folder with --plugin-dir"
        )));
    }
    report.note(format!(
        "{BUILDS} builds are renamed into place at all phases of a step, while the sea runs at 60 steps a second; the clock \
         starts before the rename and stops after the first step with the new code."
    ));
    Ok(report)
}

fn candidates(common: &Common) -> Result<Vec<(PathBuf, String)>, Failure> {
    let plugins = open::plugins(common)?;
    let named = |path: &Path| common.plugin_dir.iter().any(|folder| path.parent() == Some(folder));
    let all = plugins.infos().filter_map(|info| Some((info.path.clone()?, info.id.clone())));
    Ok(all.filter(|(path, _)| common.plugin_dir.is_empty() || named(path)).collect())
}
