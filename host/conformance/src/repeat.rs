//! The same bytes, always.

use std::{
    env,
    ffi::OsString,
    process::{Command, Stdio},
    thread,
    time::Duration,
};

use reef_abi as abi;
use reef_plugin::Plugin;

use super::{
    sea::Sea,
    subject::{Subject, WORKERS, difference, everything, run},
    table::{Check, Of, Rule::Guide},
    verdict::{Not, Outcome, broken, must},
};

const SAME: &str = "The same scene, seed and number of steps give the same bytes, with one worker or many, on every instruction set.";
const NEEDS: &[&str] = &["step-full", "load-again", "destroy-stepped"];

/// Not a check: tells a hash of what a run leaves.
pub(super) const DIGEST: &str = "digest";

pub(super) const FIRST: &[Check] =
    &[check("repeat-instances", &["state-twice"], "Two instances give the same bytes.", SAME, instances)];

pub(super) const CHECKS: &[Check] = &[
    check("repeat-loads", NEEDS, "A library that is loaded anew gives the same bytes.", SAME, loads),
    check(
        "repeat-apart",
        &["step-full", "step-storm"],
        "What one instance does is nothing to another.",
        "Keep nothing in statics that a newer build would need",
        apart,
    ),
    check(
        "repeat-workers",
        &["repeat-loads"],
        "One, two and four workers give the same bytes.",
        "Work is cut into fixed chunks, not by the number of workers.",
        workers,
    ),
    check("repeat-simd", NEEDS, "All instruction sets give the same bytes.", SAME, simd),
    check("repeat-processes", NEEDS, "Another process gives the same bytes.", CHANCE, processes),
    check("repeat-clock", NEEDS, "Time that passes between steps changes nothing.", CHANCE, clock),
];

const CHANCE: &str = "No clock, no address, no hash map's order, no thread's number, no random number";

const fn check(
    name: &'static str,
    needs: &'static [&'static str],
    about: &'static str,
    rule: &'static str,
    run: fn(&Subject) -> Outcome,
) -> Check {
    Check { name, about, rule: Guide(rule), needs, of: Of::Plugin, run }
}

const STEPS: u64 = 120;

/// What a new instance leaves after a run.
fn left(subject: &Subject, plugin: &Plugin, sea: &Sea) -> Result<Vec<u8>, Not> {
    let mut instance = subject.create(plugin)?;
    run(&mut instance, sea, 0..STEPS)?;
    everything(&mut instance)
}

fn instances(subject: &Subject) -> Outcome {
    let plugin = subject.load(WORKERS)?;
    let (mut first, mut second) = (subject.create(&plugin)?, subject.create(&plugin)?);
    run(&mut first, &Sea::usual(), 0..STEPS)?;
    run(&mut second, &Sea::usual(), 0..STEPS)?;
    match difference(&everything(&mut first)?, &everything(&mut second)?) {
        Some(difference) => broken!("after {STEPS} steps of two instances: {difference}"),
        None => Ok(None),
    }
}

fn apart(subject: &Subject) -> Outcome {
    let plugin = subject.load(WORKERS)?;
    let mut lone = subject.create(&plugin)?;
    run(&mut lone, &Sea::usual(), 0..STEPS)?;
    let alone = everything(&mut lone)?;
    let mut instance = subject.create(&plugin)?;
    let mut neighbour = subject.create(&plugin)?;
    for number in 0..STEPS {
        run(&mut neighbour, &Sea::storm(), number..number + 1)?;
        run(&mut instance, &Sea::usual(), number..number + 1)?;
    }
    match difference(&alone, &everything(&mut instance)?) {
        Some(difference) => {
            broken!("beside another instance, {STEPS} steps give something else: {difference}")
        }
        None => Ok(None),
    }
}

fn workers(subject: &Subject) -> Outcome {
    let mut one = None;
    for workers in [1, 2, 4, 3] {
        let plugin = subject.load(workers)?;
        let bytes = left(subject, &plugin, &Sea::full())?;
        let one = one.get_or_insert_with(|| bytes.clone());
        if let Some(difference) = difference(one, &bytes) {
            broken!("after {STEPS} steps with 1 and with {workers} workers: {difference}");
        }
    }
    Ok(None)
}

fn simd(subject: &Subject) -> Outcome {
    let plugin = subject.load(WORKERS)?;
    let best = Sea::full().simd_level;
    let scalar = left(subject, &plugin, &Sea { simd_level: abi::SIMD_SCALAR, ..Sea::full() })?;
    for simd_level in 1..=best {
        let bytes = left(subject, &plugin, &Sea { simd_level, ..Sea::full() })?;
        if let Some(difference) = difference(&scalar, &bytes) {
            broken!("after {STEPS} steps with simd_level 0 and with {simd_level}: {difference}");
        }
    }
    Ok(Some(format!("levels 0 to {best}")))
}

fn loads(subject: &Subject) -> Outcome {
    let first = left(subject, &subject.load(WORKERS)?, &Sea::full())?;
    match difference(&first, &left(subject, &subject.load(WORKERS)?, &Sea::full())?) {
        Some(difference) => broken!("after {STEPS} steps of two loadings: {difference}"),
        None => Ok(None),
    }
}

/// The hash of what a run leaves.
pub(super) fn digest(subject: &Subject) -> Outcome {
    let plugin = subject.load(WORKERS)?;
    let bytes = left(subject, &plugin, &Sea::full())?;
    Ok(Some(blake3::hash(&bytes).to_hex().to_string()))
}

fn processes(subject: &Subject) -> Outcome {
    let Some(own) = digest(subject)? else { return Ok(None) };
    for turn in 0..2 {
        let other = elsewhere(turn)?;
        must!(own == other, "after {STEPS} steps in two processes, the outputs and states are not the same");
    }
    Ok(None)
}

/// The same in a process of the process, which is of this check's group.
fn elsewhere(turn: u32) -> Result<String, Not> {
    let lacking = |problem: String| Not::There(format!("no other process can be started: {problem}"));
    let mut arguments: Vec<OsString> = env::args_os().skip(1).collect();
    // This check's own arguments, with two of them changed.
    let mut verdict = OsString::new();
    for at in 1..arguments.len() {
        if arguments[at - 1] == "--only" {
            arguments[at] = DIGEST.into();
        } else if arguments[at - 1] == "--verdict" {
            arguments[at].push(format!("-{turn}"));
            verdict.clone_from(&arguments[at]);
        }
    }
    let program = reef_files::program().map_err(|error| lacking(error.to_string()))?;
    let quiet = Command::new(program).args(arguments).stdin(Stdio::null()).stdout(Stdio::null()).status();
    quiet.map_err(|error| lacking(error.to_string()))?;
    let written =
        std::fs::read(&verdict).map_err(|_| Not::Kept("the other process left no verdict".into()))?;
    match serde_json::from_slice(&written) {
        Ok(super::verdict::Verdict::Passed(Some(hash))) => Ok(hash),
        Ok(other) => Err(Not::Kept(format!("in another process: {other:?}"))),
        Err(error) => Err(lacking(error.to_string())),
    }
}

fn clock(subject: &Subject) -> Outcome {
    let plugin = subject.load(WORKERS)?;
    let first = left(subject, &plugin, &Sea::full())?;
    let mut instance = subject.create(&plugin)?;
    run(&mut instance, &Sea::full(), 0..STEPS / 2)?;
    thread::sleep(Duration::from_millis(500));
    run(&mut instance, &Sea::full(), STEPS / 2..STEPS)?;
    match difference(&first, &everything(&mut instance)?) {
        Some(difference) => broken!("after a rest of half a second between two steps: {difference}"),
        None => Ok(None),
    }
}
