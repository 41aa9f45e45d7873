//! A few inputs for each target: `cargo xtask fuzz TARGET --minutes N` gives more.

use std::time::Duration;

use reef_fuzz::{
    run::{Length, run},
    targets::TARGETS,
};

/// Time for each target.
const TIME: Duration = Duration::from_millis(1500);

#[test]
fn what_nobody_would_write_is_answered_and_nothing_fails() {
    let folder = tempfile::tempdir().expect("a folder");
    for target in &TARGETS {
        let report = run(target, Length { time: TIME, inputs: 3000 }, 7, folder.path());
        assert!(report.findings.is_empty(), "{}: {:#?}", target.name, report.findings);
        // The inputs themselves at least reach what they are for.
        assert!(report.taken > 0 && report.inputs > report.taken, "{}: {report:?}", target.name);
    }
}
