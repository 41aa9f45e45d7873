//! What a plugin leaves alone in the process that it is a guest in.

use std::{collections::BTreeMap, env, fs, path::PathBuf};

use super::{
    close::life,
    sea::Sea,
    subject::{Subject, WORKERS, run},
    table::{Check, Of, Rule, Rule::Guide},
    verdict::{Not, Outcome, broken, must},
};
use reef_plugin::bare::process::{Caught, priority};

const GUEST: Rule = Guide(
    "leave its working folder, the mask of new files, its priority, its open files and its standard output alone",
);

pub(super) const CHECKS: &[Check] = &[
    check("guest-folder", "The working folder is what it was.", folder),
    check("guest-mask", "The mask of new files is what it was.", mask),
    check("guest-priority", "The priority of the host's thread is what it was.", nice),
    check("guest-files", "Files that the host has open stay open.", files),
    check("guest-output", "Nothing is printed to standard output.", output),
];

const fn check(name: &'static str, about: &'static str, run: fn(&Subject) -> Outcome) -> Check {
    Check { name, about, rule: GUEST, needs: &["close-returns", "load-again"], of: Of::Library, run }
}

fn folder(subject: &Subject) -> Outcome {
    let before = env::current_dir().ok();
    life(subject)?;
    let after = env::current_dir().ok();
    must!(before == after, "the working folder was {before:?} and is {after:?}");
    Ok(None)
}

/// The mask of new files, as the system tells it.
fn file_mask() -> Option<String> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    status.lines().find_map(|line| line.strip_prefix("Umask:")).map(|mask| mask.trim().to_owned())
}

fn mask(subject: &Subject) -> Outcome {
    let before = file_mask();
    life(subject)?;
    let after = file_mask();
    must!(before == after, "the mask of new files was {before:?} and is {after:?}");
    Ok(None)
}

fn nice(subject: &Subject) -> Outcome {
    let Ok(plugin) = subject.load(WORKERS) else {
        return Err(Not::There("it cannot be loaded".into()));
    };
    let now = || plugin.library().on_control(priority).map_err(Not::Kept);
    // The thread is one that the host has just started, as this one was.
    let before = priority();
    // Whether it can be made and steps is for other checks.
    if let Ok(mut instance) = subject.create(&plugin) {
        let _ = run(&mut instance, &Sea::usual(), 0..10);
    }
    let after = now()?;
    must!(before == after, "the priority (nice) of its control thread was {before} and is {after}");
    Ok(None)
}

/// What is open, by number.
fn open_files() -> BTreeMap<i32, PathBuf> {
    let entries = fs::read_dir("/proc/self/fd").into_iter().flatten().flatten();
    let file = |entry: fs::DirEntry| {
        Some((entry.file_name().to_str()?.parse().ok()?, fs::read_link(entry.path()).ok()?))
    };
    entries.filter_map(file).collect()
}

fn files(subject: &Subject) -> Outcome {
    let mut before = open_files();
    let second = open_files();
    // What reads the list is open only while it does.
    before.retain(|file, path| second.get(file) == Some(path) && !path.starts_with("/proc"));
    life(subject)?;
    let after = open_files();
    match before.iter().find(|(file, path)| after.get(file) != Some(*path)) {
        Some((file, path)) => broken!("file {file} ({}) was open, and is not any more", path.display()),
        None => Ok(None),
    }
}

fn output(subject: &Subject) -> Outcome {
    let caught =
        Caught::begin().map_err(|error| Not::There(format!("standard output cannot be caught: {error}")))?;
    life(subject)?;
    let printed = caught.bytes();
    must!(printed == 0, "it printed {printed} bytes to standard output");
    Ok(None)
}
