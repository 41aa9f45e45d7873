//! A few inputs for each target: `cargo xtask fuzz TARGET --minutes N` gives more.

use std::time::Duration;

use reef_fuzz::{
    run::{Length, run},
    targets::TARGETS,
};

/// Nobody waits longer for a target: its inputs take a second or two.
const LONGEST: Duration = Duration::from_secs(120);

#[test]
fn what_nobody_would_write_is_answered_and_nothing_fails() {
    let folder = tempfile::tempdir().expect("a folder");
    for target in &TARGETS {
        let report = run(target, Length { time: LONGEST, inputs: target.few }, 7, folder.path());
        assert!(report.findings.is_empty(), "{}: {:#?}", target.name, report.findings);
        assert_eq!(report.inputs, target.few, "{}: {report:?}", target.name);
        // The inputs themselves at least reach what they are for, and most of what comes of them does.
        let refused = report.inputs - report.taken - report.skipped;
        assert!(report.taken > 0 && refused > 0, "{}: {report:?}", target.name);
        assert!(report.skipped < report.inputs / 2, "{}: {report:?}", target.name);
        println!("{}: {report:?}", target.name);
    }
}
