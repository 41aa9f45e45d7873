//! For every check a fault that it catches, and that nothing but it catches: the library reef_fixture_faulty
//! breaks one rule at a time. What stands in the file is changed in a copy.

use std::{
    fs,
    path::Path,
    process::Command,
    sync::{
        Mutex,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
};

use object::{Object, ObjectSection};
use reef_abi as abi;
use reef_tests::{artifacts::artifacts, libraries::entry_at};

use crate::{command, ended, json, message, told};

/// Where a fault is planted. In the library it has the check's name.
#[derive(Clone, Copy)]
enum Fault {
    /// In the file.
    File(fn(&mut Vec<u8>)),
    /// In the library, by its environment.
    Environment,
    /// In the library, by its configuration.
    Configuration,
}

use Fault::{Configuration, Environment, File};

/// One fault a check.
const FAULTS: &[(&str, Fault)] = &[
    ("file-library", File(|bytes| bytes.truncate(bytes.len() / 2))),
    ("file-unique", File(|bytes| symbol(bytes, 10 << 4 | 1))),
    ("file-nodelete", File(|bytes| nodelete(bytes))),
    ("entry-symbol", File(|bytes| rename(bytes))),
    ("entry-data", File(|bytes| symbol(bytes, 1 << 4 | 2))),
    ("entry-magic", File(|bytes| entry(bytes, 0, |magic| magic ^ 0xff))),
    ("entry-version", File(|bytes| entry(bytes, 12, |_| 7 << 16))),
    ("entry-header", File(|bytes| entry(bytes, 16, |hash| hash ^ 1))),
    ("entry-size", File(|bytes| entry(bytes, 8, |_| 48))),
    ("entry-spare", File(|bytes| entry(bytes, 28, |_| 3))),
    ("load-open", Environment),
    ("load-twice", Environment),
    ("load-again", Environment),
    ("close-returns", Environment),
    ("close-threads", Environment),
    ("close-children", Environment),
    ("close-thread-locals", Environment),
    ("close-files", Environment),
    ("close-signals", Environment),
    ("close-guards", Environment),
    ("guest-folder", Environment),
    ("guest-mask", Environment),
    ("guest-priority", Environment),
    ("guest-files", Environment),
    ("guest-output", Environment),
    ("schema-references", Environment),
    ("schema-properties", Environment),
    ("schema-patterns", Environment),
    ("schema-texts", Environment),
    ("close-unmaps", Environment),
    ("descriptor-count", File(|bytes| entry(bytes, 24, |_| 65))),
    ("descriptor-pointers", Environment),
    ("descriptor-size", Environment),
    ("descriptor-id", Environment),
    ("descriptor-ids", File(|bytes| entry(bytes, 24, |_| 2))),
    ("descriptor-texts", Environment),
    ("descriptor-version", Environment),
    ("descriptor-schema", Environment),
    ("descriptor-states", Environment),
    ("descriptor-create", Environment),
    ("descriptor-spare", Environment),
    ("descriptor-traces", Environment),
    ("descriptor-constant", Configuration),
    ("param-present", Environment),
    ("param-id", Environment),
    ("param-key", Environment),
    ("param-kind", Environment),
    ("param-range", Environment),
    ("param-default", Environment),
    ("param-choices", Environment),
    ("param-log", Environment),
    ("param-texts", Environment),
    ("param-spare", Environment),
    ("create-works", Configuration),
    ("destroy-fresh", Configuration),
    ("create-table", Configuration),
    ("create-garbage", Environment),
    ("create-message", Environment),
    ("create-copies", Configuration),
    ("create-many", Configuration),
    ("create-extensions", Configuration),
    ("step-runs", Configuration),
    ("step-refused", Configuration),
    ("step-emits", Configuration),
    ("state-saves", Configuration),
    ("state-twice", Configuration),
    ("repeat-instances", Configuration),
    ("step-long", Configuration),
    ("step-empty", Configuration),
    ("step-full", Configuration),
    ("step-storm", Configuration),
    ("step-awake", Configuration),
    ("step-sleep", Configuration),
    ("step-zero", Configuration),
    ("step-trace", Configuration),
    ("step-debug", Configuration),
    ("step-unseen", Configuration),
    ("step-lengths", Configuration),
    ("step-late", Configuration),
    ("step-poke", Configuration),
    ("step-message", Configuration),
    ("input-unwritten", Configuration),
    ("input-forgotten", Configuration),
    ("services-scratch", Configuration),
    ("services-float", Configuration),
    ("services-threads", Configuration),
    ("services-jobs", Configuration),
    ("services-libm", Configuration),
    ("services-texture", Configuration),
    ("services-textures", Configuration),
    ("services-texture-there", Configuration),
    ("services-mesh", Configuration),
    ("services-meshes", Configuration),
    ("services-mesh-there", Configuration),
    ("output-written", Configuration),
    ("output-ids", Configuration),
    ("output-bounds", Configuration),
    ("output-owner", Configuration),
    ("output-parent", Configuration),
    ("output-phase", Configuration),
    ("output-flatness", Configuration),
    ("output-jump", Configuration),
    ("output-unasked", Configuration),
    ("destroy-stepped", Configuration),
    ("destroy-among", Configuration),
    ("reset-fresh", Configuration),
    ("reset-works", Configuration),
    ("reset-state", Configuration),
    ("reset-repeats", Configuration),
    ("param-get", Configuration),
    ("param-first", Configuration),
    ("param-set", Configuration),
    ("param-order", Configuration),
    ("param-beyond", Configuration),
    ("param-nan", Configuration),
    ("param-whole", Configuration),
    ("param-stranger", Configuration),
    ("param-apart", Configuration),
    ("param-reset", Configuration),
    ("param-saved", Configuration),
    ("state-loads", Configuration),
    ("state-bytes", Configuration),
    ("state-goes-on", Configuration),
    ("state-unseen", Configuration),
    ("state-over", Configuration),
    ("state-back", Configuration),
    ("state-trial", Configuration),
    ("state-short-reads", Configuration),
    ("state-full", Configuration),
    ("state-steady", Configuration),
    ("state-empty", Configuration),
    ("state-truncated", Configuration),
    ("state-longer", Configuration),
    ("state-random", Configuration),
    ("state-foreign", Configuration),
    ("state-flipped", Configuration),
    ("state-newer", Configuration),
    ("state-older", Configuration),
    ("state-untouched", Configuration),
    ("state-status", Configuration),
    ("state-message", Configuration),
    ("size-instance-less", Configuration),
    ("size-instance-more", Configuration),
    ("size-host", Configuration),
    ("size-step", Configuration),
    ("size-output", Configuration),
    ("size-writer", Configuration),
    ("size-reader", Configuration),
    ("repeat-loads", Environment),
    ("repeat-apart", Configuration),
    ("repeat-workers", Configuration),
    ("repeat-simd", Configuration),
    ("repeat-processes", Configuration),
    ("repeat-clock", Configuration),
    ("growth-allocations", Configuration),
    ("growth-steps", Configuration),
    ("growth-instances", Configuration),
    ("growth-states", Configuration),
    ("growth-loads", Environment),
    ("time-step", Configuration),
    ("time-spread", Configuration),
];

/// Changes a word of 32 bits of the entry.
fn entry(bytes: &mut [u8], offset: usize, change: fn(u32) -> u32) {
    let at = entry_at(bytes) + offset;
    let word = u32::from_ne_bytes(bytes[at..at + 4].try_into().unwrap());
    bytes[at..at + 4].copy_from_slice(&change(word).to_ne_bytes());
}

/// Where a section lies in the file.
fn section(bytes: &[u8], name: &str) -> (usize, usize) {
    let file = object::File::parse(bytes).unwrap();
    let (start, size) = file.section_by_name(name).unwrap().file_range().unwrap();
    (start as usize, size as usize)
}

/// Gives the entry's symbol another binding and type.
fn symbol(bytes: &mut [u8], info: u8) {
    let (names, _) = section(bytes, ".dynstr");
    let (start, size) = section(bytes, ".dynsym");
    let wanted = format!("{}\0", abi::ENTRY_SYMBOL);
    let found = (start..start + size).step_by(24).find(|at| {
        let name = u32::from_ne_bytes(bytes[*at..*at + 4].try_into().unwrap()) as usize;
        bytes[names + name..].starts_with(wanted.as_bytes())
    });
    bytes[found.unwrap() + 4] = info;
}

fn rename(bytes: &mut [u8]) {
    let (names, size) = section(bytes, ".dynstr");
    let name = abi::ENTRY_SYMBOL.as_bytes();
    let at = bytes[names..names + size].windows(name.len()).position(|w| w == name).unwrap();
    bytes[names + at] = b'x';
}

/// Asks the system's loader to keep the library.
fn nodelete(bytes: &mut [u8]) {
    const FLAGS_1: u64 = 0x6fff_fffb;
    const NODELETE: u8 = 8;
    let (start, size) = section(bytes, ".dynamic");
    let found = (start..start + size).step_by(16).find(|at| bytes[*at..*at + 8] == FLAGS_1.to_ne_bytes());
    bytes[found.expect("a library that is bound at once has flags") + 8] |= NODELETE;
}

/// Which checks look at the library with fault number `number`: all with `REEF_PLANTED=all`, which takes
/// minutes; else the fault's family, and of the others a twelfth, others for each fault. What these need
/// looks, too.
fn lookers(number: usize) -> Vec<&'static str> {
    let family = |name: &'static str| name.split('-').next();
    let all = std::env::var("REEF_PLANTED").is_ok_and(|value| value == "all");
    let looks = |at: usize| {
        all || family(FAULTS[at].0) == family(FAULTS[number].0) || (at + number).is_multiple_of(12)
    };
    (0..FAULTS.len()).filter(|at| looks(*at)).map(|at| FAULTS[at].0).collect()
}

/// Checks of a library with one fault.
fn check(library: &Path, number: usize) -> Command {
    let (name, fault) = FAULTS[number];
    let mut command = command(&[&library, &"--json", &"--jobs", &"2"]);
    for looker in lookers(number) {
        command.args(["--only", looker]);
    }
    let breach = name.replace('-', "_");
    match fault {
        File(_) => {}
        Environment => {
            command.env("REEF_FAULTY_BREACH", breach);
        }
        Configuration => {
            command.arg("--config").arg(format!(r#"{{"breach": "{breach}"}}"#));
        }
    }
    command
}

/// What is wrong with the answer to one planted fault.
fn caught(number: usize) -> Result<(), String> {
    let (name, fault) = FAULTS[number];
    let folder = tempfile::tempdir().unwrap();
    let own = artifacts().plugin("reef_fixture_faulty");
    let copy = folder.path().join(own.file_name().unwrap());
    let library = match fault {
        File(spoil) => {
            let mut bytes = fs::read(own).unwrap();
            spoil(&mut bytes);
            fs::write(&copy, bytes).unwrap();
            &copy
        }
        _ => own,
    };
    let output = check(library, number).output().unwrap();
    let answer = json(&output);
    let failed = ended(&answer, "fail");
    if failed != [name] {
        let why: Vec<String> =
            failed.iter().map(|failed| format!("{failed}: {}", message(&answer, failed))).collect();
        return Err(format!("{name} is planted, and what failed is {why:#?}"));
    }
    if output.status.code() != Some(1) {
        return Err(format!("{name}: {:?}: {}", output.status, told(&output)));
    }
    let why = message(&answer, name);
    if why.is_empty() || why.contains('\n') {
        return Err(format!("{name}: {why:?} is no sentence"));
    }
    println!("{name}: {why}");
    Ok(())
}

#[test]
fn each_check_catches_the_fault_that_is_planted_for_it_and_no_other() {
    let next = AtomicUsize::new(0);
    let wrong: Mutex<Vec<String>> = Mutex::default();
    thread::scope(|scope| {
        for _ in 0..thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(|| {
                loop {
                    let number = next.fetch_add(1, Ordering::Relaxed);
                    if number >= FAULTS.len() {
                        return;
                    }
                    if let Err(problem) = caught(number) {
                        wrong.lock().unwrap().push(problem);
                    }
                }
            });
        }
    });
    let wrong = wrong.into_inner().unwrap();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_check_has_a_planted_fault() {
    let output = command(&[&"--list", &"--json"]).output().unwrap();
    let answer = json(&output);
    let listed: Vec<&str> =
        answer["checks"].as_array().unwrap().iter().map(|check| check["name"].as_str().unwrap()).collect();
    let mut planted: Vec<&str> = FAULTS.iter().map(|(name, _)| *name).collect();
    for name in &listed {
        assert!(planted.contains(name), "there is no fault for {name}");
    }
    planted.retain(|name| !listed.contains(name));
    assert!(planted.is_empty(), "there is no check for {planted:?}");
}

#[test]
fn without_a_fault_the_library_passes() {
    crate::passes(artifacts().plugin("reef_fixture_faulty"), None, &["step-sleep"]);
}
