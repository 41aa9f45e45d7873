//! Code of a plugin that does not end: asked to stop, then stopped. In a process with short limits.

use std::time::{Duration, Instant};

use reef_plugin::{Health, Instance, Limits, StepStatus, set_limits};
use reef_tests::{
    artifacts::artifacts,
    child,
    sea::{Sea, config},
};

use crate::load;

fn made(strike: &str, place: &str) -> Result<Instance, reef_plugin::PluginError> {
    load(artifacts().plugin("reef_fixture_faulty"), 2)
        .create(&config(&format!(r#"{{"strike": "{strike}", "where": "{place}"}}"#)))
}

fn child_passes(test: &str) {
    let ended = child::run(&format!("runaways::{test}"), "run", Duration::from_secs(60));
    assert!(ended.status.is_some_and(|status| status.success()), "{}: {ended:?}", ended.text);
}

fn short_limits() -> Limits {
    let limit = Duration::from_millis(40);
    let limits = Limits { step: limit, other: limit, grace: Duration::from_millis(20) };
    set_limits(limits);
    limits
}

#[test]
fn runaways_of_all_kinds_are_stopped() {
    child_passes("child_runaways_of_all_kinds");
}

#[test]
#[ignore = "in a process of its own"]
fn child_runaways_of_all_kinds() {
    if child::task().is_none() {
        return;
    }
    let limits = short_limits();
    let sea = Sea::default();
    for strike in ["loop", "allocating_loop", "sleep", "deadlock", "loop_in_library"] {
        for place in ["step", "job", "worker"] {
            let mut instance = made(strike, place).unwrap();
            let began = Instant::now();
            let report = instance.step(&sea.input(1), &[]);
            let took = began.elapsed();
            println!("{strike} in {place}: {} ms, {:?}", took.as_millis(), report.message);
            assert_eq!(report.status, StepStatus::Failed);
            let message = report.message.unwrap();
            assert!(message.contains("step was stopped: it did not end 40 ms after it began"), "{message}");
            assert_eq!(instance.health(), &Health::Faulty(message));
            assert!(took >= limits.step + limits.grace, "{took:?}");
        }
        let error = made(strike, "create").unwrap_err().to_string();
        assert!(error.contains("create was stopped: it did not end 40 ms after it began"), "{error}");
    }
    // Memory of the C library is in order, and so are new libraries.
    let mut well = made("none", "step").unwrap();
    assert_eq!(well.step(&sea.input(1), &[]).status, StepStatus::Ok);
}

#[test]
fn a_call_that_obeys_goes_on_unharmed() {
    child_passes("child_that_obeys");
}

#[test]
#[ignore = "in a process of its own"]
fn child_that_obeys() {
    if child::task().is_none() {
        return;
    }
    let limits = short_limits();
    let sea = Sea::default();
    let mut instance = made("obedient_loop", "step").unwrap();
    for step in 1..4 {
        let began = Instant::now();
        assert_eq!(instance.step(&sea.input(step), &[]).status, StepStatus::Ok);
        assert!(began.elapsed() >= limits.step);
        assert_eq!(instance.health(), &Health::Running);
    }
    let mut instance = made("obedient_loop", "job").unwrap();
    assert_eq!(instance.step(&sea.input(1), &[]).status, StepStatus::Ok);
}
