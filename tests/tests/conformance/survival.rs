//! Whatever a plugin does in a check's process, the checker goes on, says what happened, and leaves nothing
//! behind.

use std::{
    fs,
    time::{Duration, Instant},
};

use reef_tests::artifacts::artifacts;

use crate::{command, ended, json, message};

/// The message of load-open when open() does this.
fn opened(breach: &str) -> String {
    let library = artifacts().plugin("reef_fixture_faulty");
    let mut command = command(&[&library, &"--json", &"--only", &"load-open", &"--timeout", &"1"]);
    let start = Instant::now();
    let output = command.env("REEF_FAULTY_BREACH", breach).output().unwrap();
    assert!(start.elapsed() < Duration::from_secs(30), "{breach}");
    let answer = json(&output);
    assert_eq!(ended(&answer, "fail"), ["load-open"], "{breach}: {answer:#}");
    assert_eq!(output.status.code(), Some(1), "{breach}");
    message(&answer, "load-open")
}

#[test]
fn a_process_that_ends_itself_is_no_pass() {
    assert!(opened("exit").contains("open was stopped: it called exit"));
    assert!(
        opened("exit_by_kernel")
            .starts_with("its process ended itself with exit code 0 before the check was over")
    );
    assert_eq!(opened("kill"), "its process was ended by signal 9 before the check was over");
}

#[test]
fn a_process_that_does_not_end_is_killed() {
    assert_eq!(opened("stop"), "it did not end within 1 s, and was killed");
}

#[test]
fn garbage_on_its_outputs_confuses_nobody() {
    let message = opened("shout");
    assert!(message.contains("SIGABRT: it aborted"), "{message}");
}

#[test]
fn children_of_a_process_that_is_killed_die_too_even_in_a_session_of_their_own() {
    let marked = || {
        let processes = fs::read_dir("/proc").unwrap().flatten();
        let environments = processes.filter_map(|process| fs::read(process.path().join("environ")).ok());
        environments.filter(|text| text.split(|b| *b == 0).any(|v| v == b"REEF_FAULTY_BREACH=flee")).count()
    };
    assert_eq!(opened("flee"), "it did not end within 1 s, and was killed");
    // The kernel takes a moment to bury them.
    let end = Instant::now() + Duration::from_secs(5);
    while marked() > 0 && Instant::now() < end {
        std::thread::sleep(Duration::from_millis(5));
    }
    assert_eq!(marked(), 0);
}
