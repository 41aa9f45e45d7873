//! The host's own faults are nobody else's: with the guards in place, and even in a service that a plugin
//! called, they end the program as they always did.

use std::{hint, os::unix::process::ExitStatusExt, ptr, time::Duration};

use reef_tests::{artifacts::artifacts, child, sea::config};

use crate::load;

/// What the child does, the signal that ends it, and what it says on the way.
const ENDS: [(&str, i32, &str); 4] = [
    ("bad pointer", libc::SIGSEGV, ""),
    ("abort", libc::SIGABRT, ""),
    ("full stack", libc::SIGABRT, "has overflowed its stack"),
    ("bad pointer in a service", libc::SIGSEGV, "the host logs"),
];

#[test]
fn the_hosts_own_faults_end_the_program_with_their_signal() {
    for (task, signal, says) in ENDS {
        let ended = child::run("own_faults::child_with_a_fault", task, Duration::from_secs(60));
        let found = ended.status.and_then(|status| status.signal());
        assert_eq!(found, Some(signal), "{task}: {ended:?}");
        assert!(ended.text.contains("the library is loaded") && ended.text.contains(says), "{}", ended.text);
    }
}

#[test]
#[ignore = "in a process of its own"]
fn child_with_a_fault() {
    let Some(task) = child::task() else { return };
    // No file of a megabyte for each of them.
    // SAFETY: a limit of this process.
    unsafe { libc::setrlimit(libc::RLIMIT_CORE, &libc::rlimit { rlim_cur: 0, rlim_max: 0 }) };
    let plugin = load(artifacts().plugin("reef_fixture_faulty"), 2);
    println!("the library is loaded");
    match task.as_str() {
        "bad pointer" => fault(),
        // SAFETY: no arguments.
        "abort" => unsafe { libc::abort() },
        "full stack" => {
            hint::black_box(recurse(1));
        }
        "bad pointer in a service" => {
            tracing::subscriber::set_global_default(Broken).unwrap();
            // Writes a line to the log.
            drop(plugin.create(&config("{}")));
        }
        other => panic!("unknown task {other:?}"),
    }
    println!("it survived");
}

fn fault() {
    // SAFETY: none: this is the fault.
    unsafe { hint::black_box(ptr::without_provenance_mut::<u8>(0x10)).write_volatile(1) };
}

fn recurse(depth: u64) -> u64 {
    let place = hint::black_box([depth; 32]);
    if place[7] == 0 {
        return 0;
    }
    recurse(place[7] + 1) + place[3]
}

/// A log that faults, in the host.
struct Broken;

impl tracing::Subscriber for Broken {
    fn enabled(&self, _: &tracing::Metadata<'_>) -> bool {
        true
    }

    fn new_span(&self, _: &tracing::span::Attributes<'_>) -> tracing::span::Id {
        tracing::span::Id::from_u64(1)
    }

    fn record(&self, _: &tracing::span::Id, _: &tracing::span::Record<'_>) {}

    fn record_follows_from(&self, _: &tracing::span::Id, _: &tracing::span::Id) {}

    fn event(&self, event: &tracing::Event<'_>) {
        if event.metadata().target() == "reef::plugin" {
            println!("the host logs");
            fault();
        }
    }

    fn enter(&self, _: &tracing::span::Id) {}

    fn exit(&self, _: &tracing::span::Id) {}
}
