//! Code of a plugin that ends in a signal or does not end: the host lives, says what happened, never calls
//! that library again, and the rest of the sea is as it would have been without it.

use reef_plugin::{Health, PluginError, StepStatus};
use reef_tests::{
    artifacts::artifacts,
    sea::{Sea, config},
};

use crate::load;

fn faulty(workers: usize) -> reef_plugin::Plugin {
    load(artifacts().plugin("reef_fixture_faulty"), workers)
}

fn table(strike: &str, place: &str) -> String {
    config(&format!(r#"{{"strike": "{strike}", "where": "{place}", "in_step": 3}}"#))
}

/// Signals, and what a message about them says.
const SIGNALS: [(&str, &str); 10] = [
    ("bad_pointer", "SIGSEGV: address 0x10 is not mapped"),
    ("bad_copy", "SIGSEGV: address 0x10 is not mapped, at libc"),
    ("wild_call", "SIGSEGV: address 0x1234 is not mapped"),
    ("no_memory", "SIGBUS: there is no memory behind address"),
    ("bad_instruction", "SIGILL: no instruction at address"),
    ("divide_by_zero", "SIGFPE"),
    ("abort", "SIGABRT: it aborted"),
    ("panic_through_c", "SIGABRT: it aborted"),
    ("stack_overflow", "SIGSEGV: its stack is full"),
    ("overflow_in_service", "SIGSEGV: its stack is full"),
];

#[test]
fn a_step_that_ends_in_a_signal_stops_the_library_and_leaves_the_last_outputs() {
    let sea = Sea::default();
    for (strike, expected) in SIGNALS {
        for place in ["step", "job", "worker"] {
            let plugin = faulty(2);
            let mut instance = plugin.create(&table(strike, place)).unwrap();
            let mut sibling = plugin.create(&config("{}")).unwrap();
            for step in 0..3 {
                assert_eq!(instance.step(&sea.input(step), &[]).status, StepStatus::Ok);
                assert_eq!(sibling.step(&sea.input(step), &[]).status, StepStatus::Ok);
            }
            let before = instance.outputs().clone();
            assert!(!before.fibre_nodes.is_empty());
            let report = instance.step(&sea.input(3), &[]);
            assert_eq!(report.status, StepStatus::Failed);
            let message = report.message.unwrap();
            assert!(message.contains(expected), "{strike} in {place}: {message}");
            assert!(message.starts_with("plugin `fixture.faulty`: step was stopped: "), "{message}");
            assert_eq!(message.contains("in job "), place != "step", "{message}");
            assert_eq!(instance.health(), &Health::Faulty(message.clone()));
            assert_eq!(instance.outputs().fibre_nodes, before.fibre_nodes);
            assert_eq!(instance.step(&sea.input(4), &[]).status, StepStatus::Standing);

            // All instances of the library stand still, and nothing brings one back.
            assert_eq!(sibling.health(), &Health::Faulty(message.clone()));
            let report = sibling.step(&sea.input(3), &[]);
            assert_eq!((report.status, report.message), (StepStatus::Standing, Some(message.clone())));
            for error in [
                sibling.reset().unwrap_err(),
                sibling.save().unwrap_err(),
                sibling.param(1).unwrap_err(),
                plugin.create(&config("{}")).unwrap_err(),
            ] {
                assert!(
                    matches!(&error, PluginError::Fault { message: told, .. } if *told == message),
                    "{error}"
                );
            }
            assert!(matches!(sibling.health(), Health::Faulty(_)));
            drop((instance, sibling, plugin));
        }
    }
}

#[test]
fn every_call_of_an_instance_is_guarded() {
    let sea = Sea::default();
    let message = |error: PluginError, call: &str| {
        let PluginError::Fault { plugin, call: name, message } = error else { panic!("{error}") };
        assert_eq!((plugin.as_str(), name), ("fixture.faulty", call));
        assert!(message.contains(&format!("{call} was stopped: SIGSEGV: address 0x10")), "{message}");
        message
    };
    let made = |place: &str| faulty(2).create(&table("bad_pointer", place));
    message(made("create").unwrap_err(), "create");
    message(made("reset").unwrap().reset().unwrap_err(), "reset");
    let mut instance = made("save").unwrap();
    assert_eq!(instance.step(&sea.input(1), &[]).status, StepStatus::Ok);
    let told = message(instance.save().unwrap_err(), "save_state");
    assert_eq!(instance.health(), &Health::Faulty(told));
    let state = faulty(1).create(&config("{}")).unwrap().save().unwrap();
    message(made("load").unwrap().load(&state).unwrap_err(), "load_state");
    drop(made("destroy").unwrap());
}
