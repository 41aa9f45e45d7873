//! `reef bench churn`: what ten thousand reloads leave behind, of each plugin that a scene can use without
//! configuration.

use std::{
    fs,
    path::Path,
    sync::{Arc, mpsc},
    thread,
    time::Duration,
};

use reef_command::{Common, open};
use reef_plugin::{Library, copies, image::Image, pinned};
use reef_report::failure::Failure;
use reef_sea::reload::swap::{Job, Swap};

use super::{
    reload::{build, candidates, failed, none_found, sea},
    report::{Bar, Report},
};

/// Reloads of each plugin.
const RELOADS: u64 = 10_000;
/// Reloads before anything is counted: allocators and caches have their size then.
const WARM: u64 = 300;

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
            copies: copies::folders().iter().flat_map(|folder| entries(folder)).filter(own).count(),
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
        let Ok((library, plugins)) = Library::load_image(path, &Image::whole(&build(&bytes, number)), 2)
        else {
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

/// Measures.
pub fn run(common: &Common) -> Result<Report, Failure> {
    let assets = open::assets_folder(common)?;
    let mut report = Report::default();
    for (path, id) in candidates(common)? {
        let Some(churn) = churn(&path, &id, &assets, WARM, RELOADS)? else { continue };
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
    }
    if report.figures.is_empty() {
        return Err(none_found());
    }
    Ok(report)
}
