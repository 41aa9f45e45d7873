//! All checks that were asked for, several at once, told in their order. A check whose needs failed is not
//! run.

use std::{
    sync::{
        Condvar, Mutex, PoisonError,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use super::{
    process::Conduct,
    table::{self, Check, Of},
    verdict::Verdict,
};

/// A check, and how it ended.
#[derive(Clone)]
pub(super) struct Judgement {
    pub(super) check: &'static Check,
    /// Whose, in a library with several plugins.
    pub(super) plugin: Option<String>,
    pub(super) verdict: Verdict,
    pub(super) time: Duration,
    /// Somebody asked for it.
    wanted: bool,
    /// Whoever needs it need not be run.
    lost: bool,
}

impl Judgement {
    /// Is there something to tell?
    fn matters(&self) -> bool {
        self.wanted || matches!(self.verdict, Verdict::Failed(_) | Verdict::Unconfigured(_))
    }
}

/// One thing to run.
struct Task<'a> {
    check: &'static Check,
    plugin: Option<&'a str>,
    wanted: bool,
    /// Tasks that it needs.
    needs: Vec<usize>,
}

/// Runs the wanted checks and what they need; `tell` hears of each in order.
pub(super) fn all(
    conduct: &Conduct,
    plugins: &[Option<String>],
    wanted: &[&'static Check],
    jobs: usize,
    mut tell: impl FnMut(&Judgement),
) -> Vec<Judgement> {
    let tasks = tasks(plugins, wanted);
    let next = AtomicUsize::new(0);
    let done: Mutex<Vec<Option<Judgement>>> = Mutex::new(tasks.iter().map(|_| None).collect());
    let changed = Condvar::new();
    let lock = || done.lock().unwrap_or_else(PoisonError::into_inner);
    thread::scope(|scope| {
        for _ in 0..jobs.min(tasks.len()) {
            scope.spawn(|| {
                loop {
                    let at = next.fetch_add(1, Ordering::Relaxed);
                    let Some(task) = tasks.get(at) else { return };
                    // What it needs comes before it: somebody works on it already.
                    let known = changed
                        .wait_while(lock(), |done| task.needs.iter().any(|need| done[*need].is_none()))
                        .unwrap_or_else(PoisonError::into_inner);
                    let missing = task.needs.iter().find_map(|need| {
                        known[*need]
                            .as_ref()
                            .filter(|judgement| judgement.lost)
                            .map(|judgement| judgement.check.name)
                    });
                    drop(known);
                    let judgement = task.judge(conduct, missing);
                    lock()[at] = Some(judgement);
                    changed.notify_all();
                }
            });
        }
        for at in 0..tasks.len() {
            let known =
                changed.wait_while(lock(), |done| done[at].is_none()).unwrap_or_else(PoisonError::into_inner);
            if let Some(judgement) = known[at].clone().filter(Judgement::matters) {
                drop(known);
                tell(&judgement);
            }
        }
    });
    let done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    done.into_iter().flatten().filter(Judgement::matters).collect()
}

impl Task<'_> {
    /// `missing`: a need of it that was not met.
    fn judge(&self, conduct: &Conduct, missing: Option<&str>) -> Judgement {
        let start = Instant::now();
        let verdict = match missing {
            Some(need) => Verdict::Skipped(format!("it needs {need}")),
            None => conduct.run(self.check.name, self.plugin),
        };
        let lost = missing.is_some() || matches!(verdict, Verdict::Failed(_) | Verdict::Unconfigured(_));
        Judgement {
            check: self.check,
            plugin: self.plugin.map(str::to_owned),
            verdict,
            time: start.elapsed(),
            wanted: self.wanted,
            lost,
        }
    }
}

/// The library's checks, then each plugin's, with what they need.
fn tasks<'a>(plugins: &'a [Option<String>], wanted: &[&'static Check]) -> Vec<Task<'a>> {
    let mut needed: Vec<&str> = wanted.iter().map(|check| check.name).collect();
    let mut at = 0;
    while let Some(name) = needed.get(at).copied() {
        for need in table::find(name).map_or(&[][..], |check| check.needs) {
            if !needed.contains(need) {
                needed.push(need);
            }
        }
        at += 1;
    }
    let mut tasks: Vec<Task<'a>> = Vec::new();
    let several = plugins.len() > 1;
    for of in std::iter::once(None).chain(plugins.iter().map(Some)) {
        for check in table::all().filter(|check| needed.contains(&check.name)) {
            let plugin = match (check.of, of) {
                (Of::Library, None) => None,
                (Of::Plugin, Some(plugin)) => plugin.as_deref(),
                _ => continue,
            };
            let needs = tasks
                .iter()
                .enumerate()
                .filter(|(_, task)| check.needs.contains(&task.check.name))
                .filter(|(_, task)| !several || task.plugin.is_none() || task.plugin == plugin)
                .map(|(at, _)| at)
                .collect();
            let wanted = wanted.iter().any(|wanted| wanted.name == check.name);
            tasks.push(Task { check, plugin, wanted, needs });
        }
    }
    tasks
}
