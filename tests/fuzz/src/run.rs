//! Gives a target changed inputs until a time is over.

use std::{
    fs,
    panic::{self, AssertUnwindSafe},
    path::{Path, PathBuf},
    process,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use crate::{
    mutate::mutate,
    random::{Choose, seeded},
    targets::{Ending, Target, inputs},
};

/// An input that takes longer is a finding.
const LONGEST: Duration = Duration::from_secs(60);
/// Changed inputs that were taken, and are changed further.
const MOST_TAKEN: usize = 200;
/// Findings after which a run ends.
const MOST_FINDINGS: usize = 20;

/// How long a run is: until either is reached.
#[derive(Clone, Copy, Debug)]
pub struct Length {
    /// Time.
    pub time: Duration,
    /// Inputs.
    pub inputs: u64,
}

/// What a run saw.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// Inputs.
    pub inputs: u64,
    /// Those that were taken.
    pub taken: u64,
    /// Those of which nobody was asked; all others were refused.
    pub skipped: u64,
    /// The longest that one took.
    pub longest: Duration,
    /// What went wrong, and the file that holds the input.
    pub findings: Vec<(String, PathBuf)>,
}

/// Runs a target; inputs at fault are kept in a folder.
///
/// # Panics
/// When the folder cannot be written.
pub fn run(target: &Target, length: Length, seed: u64, kept: &Path) -> Report {
    fs::create_dir_all(kept).expect("a folder for findings");
    let present = kept.join(format!("{}-running", target.name));
    let began = Instant::now();
    let since = watch(target.name, &present, began);
    let said = listen();
    let mut random = seeded(seed);
    let seeds = inputs(target);
    let mut pool = seeds.clone();
    let mut report = Report::default();
    let mut told = Vec::new();
    let mut unchanged = seeds.iter();
    while began.elapsed() < length.time
        && report.inputs < length.inputs
        && report.findings.len() < MOST_FINDINGS
    {
        // First all inputs as they are.
        let input = match unchanged.next() {
            Some(input) => input.clone(),
            None => mutate(&pool[random.below(pool.len())], &pool, target.text, &mut random),
        };
        fs::write(&present, &input).expect("the folder for findings can be written");
        since.store(began.elapsed().as_millis() as u64, Ordering::Relaxed);
        let start = Instant::now();
        let ended = panic::catch_unwind(AssertUnwindSafe(|| (target.try_one)(&input)));
        report.longest = report.longest.max(start.elapsed());
        report.inputs += 1;
        let problem = match ended {
            Ok(Ok(Ending::Refused)) => continue,
            Ok(Ok(Ending::Skipped)) => {
                report.skipped += 1;
                continue;
            }
            Ok(Ok(Ending::Taken)) => {
                report.taken += 1;
                if pool.len() < seeds.len() + MOST_TAKEN {
                    pool.push(input);
                } else if pool.len() > seeds.len() {
                    let at = seeds.len() + random.below(pool.len() - seeds.len());
                    pool[at] = input;
                }
                continue;
            }
            Ok(Err(problem)) => problem,
            Err(_) => said.lock().unwrap_or_else(PoisonError::into_inner).clone(),
        };
        // The same words of another number are the same finding.
        let words: String = problem.chars().filter(|c| c.is_alphabetic() || *c == ' ').collect();
        if told.contains(&words) {
            continue;
        }
        told.push(words);
        let path = kept.join(format!("{}-{}", target.name, report.findings.len()));
        fs::write(&path, &input).expect("the folder for findings can be written");
        report.findings.push((problem, path));
    }
    since.store(u64::MAX, Ordering::Relaxed);
    let _ = (fs::remove_file(&present), panic::take_hook());
    report
}

/// Ends the program where an input takes too long. The time is that of the present one's start [ms].
fn watch(name: &'static str, present: &Path, began: Instant) -> Arc<AtomicU64> {
    let since = Arc::new(AtomicU64::new(u64::MAX));
    let (watched, present) = (since.clone(), present.to_owned());
    thread::spawn(move || {
        while Arc::strong_count(&watched) > 1 {
            thread::sleep(Duration::from_millis(200));
            let start = watched.load(Ordering::Relaxed);
            if start != u64::MAX && began.elapsed().saturating_sub(Duration::from_millis(start)) > LONGEST {
                eprintln!("{name}: more than {LONGEST:?} for the input in {}", present.display());
                process::abort();
            }
        }
    });
    since
}

/// What the last panic said; nothing is printed.
fn listen() -> Arc<Mutex<String>> {
    let said = Arc::new(Mutex::new(String::new()));
    let heard = said.clone();
    panic::set_hook(Box::new(move |info| {
        *heard.lock().unwrap_or_else(PoisonError::into_inner) = info.to_string();
    }));
    said
}
