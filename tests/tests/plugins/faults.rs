//! A plugin in a library of its own whose fault its configuration chooses: each gives a clear error, the host
//! lives, and other instances go on.

use reef_plugin::{Health, Instance, PluginError, StepStatus};
use reef_tests::{
    artifacts::artifacts,
    sea::{Sea, config, set_param},
};

use crate::load;

fn plugin(workers: usize) -> reef_plugin::Plugin {
    load(artifacts().plugin("reef_fixture_faulty"), workers)
}

fn with_fault(fault: &str) -> Instance {
    plugin(2).create(&config(&format!(r#"{{"fault": "{fault}", "in_step": 3}}"#))).unwrap()
}

/// Steps until the fault strikes in the third step; returns its message.
fn strike(instance: &mut Instance) -> String {
    let sea = Sea::default();
    for step in 0..3 {
        assert_eq!(instance.step(&sea.input(step), &[]).status, StepStatus::Ok);
    }
    let before = instance.outputs().clone();
    let report = instance.step(&sea.input(3), &[]);
    assert_eq!(report.status, StepStatus::Failed, "{report:?}");
    assert_eq!(before.fibre_nodes, instance.outputs().fibre_nodes, "the last good outputs stand still");
    assert!(!before.fibre_nodes.is_empty());
    assert_eq!(instance.step(&sea.input(4), &[]).status, StepStatus::Standing);
    report.message.expect("a failure has a message")
}

#[test]
fn outputs_that_are_no_numbers_or_point_nowhere_are_refused_by_stream_element_and_field() {
    let mut instance = with_fault("not_a_number");
    assert!(strike(&mut instance).starts_with("stream fibre node, element 1: position is NaN"));
    assert!(matches!(instance.health(), Health::Faulty(_)));
    let mut instance = with_fault("index_out_of_range");
    assert_eq!(strike(&mut instance), "stream fibre, element 0: object is 1, there are 1 objects");
}

#[test]
fn too_much_output_is_refused_with_the_limit() {
    let mut instance = with_fault("no_space");
    let message = strike(&mut instance);
    assert!(matches!(instance.health(), Health::Stopped(_)), "what asks for too much is not broken");
    assert!(message.contains("REEF_NO_SPACE") && message.contains("the limit is 16777216"), "{message}");
}

#[test]
fn a_panic_in_a_step_is_fatal_and_carries_place_and_message() {
    let mut instance = with_fault("panic_in_step");
    let message = strike(&mut instance);
    assert!(message.contains("REEF_FATAL") && message.contains("chosen PanicInStep in step 3"), "{message}");
    assert!(message.contains("lib.rs:"), "{message}");
    assert!(matches!(instance.health(), Health::Faulty(_)));
}

#[test]
fn of_panics_in_jobs_the_lowest_index_is_reported_whatever_worker_ran_it() {
    for _ in 0..10 {
        let message = strike(&mut with_fault("panic_in_job"));
        assert!(message.contains("chosen panic in job 7"), "{message}");
    }
}

#[test]
fn the_error_codes_stop_the_instance_with_its_own_message() {
    let mut instance = with_fault("error");
    assert!(strike(&mut instance).contains("chosen Error in step 3"));
    assert!(matches!(instance.health(), Health::Stopped(_)));
    let mut instance = with_fault("fatal");
    assert!(strike(&mut instance).contains("chosen Fatal in step 3"));
    assert!(matches!(instance.health(), Health::Faulty(_)));
}

#[test]
fn a_stopped_instance_runs_again_after_a_reset() {
    for fault in ["error", "fatal", "panic_in_step", "not_a_number"] {
        let mut instance = with_fault(fault);
        strike(&mut instance);
        instance.reset().unwrap();
        assert!(instance.outputs().fibre_nodes.is_empty());
        strike(&mut instance);
    }
}

#[test]
fn sleep_and_discard_keep_the_last_outputs_and_the_instance_running() {
    for (fault, expected) in [("sleep", StepStatus::Sleep), ("discard", StepStatus::Discarded)] {
        let mut instance = with_fault(fault);
        let sea = Sea::default();
        let grow = [set_param(3, 1.0)];
        for step in 0..3 {
            assert_eq!(
                instance.step(&sea.input(step), if step == 1 { &grow } else { &[] }).status,
                StepStatus::Ok
            );
        }
        let nodes = instance.outputs().fibre_nodes.clone();
        assert_eq!(nodes[1].position[1], 1.0 + 2.0, "two steps, two metres");
        let report = instance.step(&sea.input(3), &[set_param(1, 0.5)]);
        assert_eq!(report.status, expected);
        assert_eq!(instance.outputs().fibre_nodes, nodes);
        assert_eq!(instance.health(), &Health::Running);
        // A step that was refused takes its parameter events back.
        assert_eq!(instance.param(1).unwrap(), if fault == "discard" { 1.0 } else { 0.5 });
    }
}

#[test]
fn a_panic_in_create_and_a_bad_configuration_are_told_apart() {
    let error = plugin(1).create(&config(r#"{"fault": "panic_in_create"}"#)).unwrap_err();
    assert!(error.to_string().contains("chosen panic in create"), "{error}");
    assert!(matches!(error, PluginError::Call { call: "create", .. }));

    let error = plugin(1).create(&config(r#"{"fault": "bad_config"}"#)).unwrap_err();
    let PluginError::Config { path, message, .. } = &error else { panic!("{error}") };
    assert_eq!(path.as_deref(), Some("things[3].size"));
    assert_eq!(message, "is -1, allowed is 0 and more");

    for (table, path, part) in [
        (r#"{"fault": "melt"}"#, Some("fault"), "unknown variant `melt`"),
        (r#"{"in_step": -1}"#, Some("in_step"), "invalid value"),
        (r#"{"colour": 1}"#, Some("colour"), "unknown field `colour`"),
    ] {
        let error = plugin(1).create(&config(table)).unwrap_err();
        let PluginError::Config { path: found, message, .. } = &error else { panic!("{error}") };
        assert_eq!(found.as_deref(), path, "{error}");
        assert!(message.contains(part), "{error}");
    }
    assert!(plugin(1).create("not json").unwrap_err().to_string().contains("not valid JSON"));
}

#[test]
fn a_panic_while_saving_is_an_error_and_the_instance_steps_on() {
    let mut instance = plugin(1).create(&config(r#"{"fault": "panic_in_save"}"#)).unwrap();
    let sea = Sea::default();
    assert_eq!(instance.step(&sea.input(1), &[]).status, StepStatus::Ok);
    let error = instance.save().unwrap_err();
    assert!(error.to_string().contains("chosen panic in save"), "{error}");
    assert_eq!(instance.step(&sea.input(2), &[]).status, StepStatus::Ok);
}

#[test]
fn a_load_that_panics_or_refuses_leaves_the_instance_as_it_was() {
    let sea = Sea::default();
    let plugin = plugin(1);
    let mut good = plugin.create(&config("{}")).unwrap();
    for step in 1..=5 {
        good.step(&sea.input(step), &[]);
    }
    let state = good.save().unwrap();
    for (fault, part) in [("panic_in_load", "chosen panic in load"), ("refuse_load", "chosen refusal")] {
        let mut instance = plugin.create(&config(&format!(r#"{{"fault": "{fault}"}}"#))).unwrap();
        instance.step(&sea.input(1), &[set_param(1, 0.25)]);
        let before = instance.save().unwrap();
        let error = instance.load(&state).unwrap_err();
        assert!(error.to_string().contains(part), "{error}");
        assert_eq!(instance.save().unwrap(), before);
        assert_eq!(instance.param(1).unwrap(), 0.25);
        assert_eq!(instance.health(), &Health::Running);
    }
}

#[test]
fn a_state_comes_back_with_parameters_and_a_foreign_or_damaged_one_is_refused() {
    let sea = Sea::default();
    let faulty = plugin(1);
    let mut instance = faulty.create(&config("{}")).unwrap();
    instance.step(&sea.input(1), &[set_param(1, 0.7), set_param(2, 11.4), set_param(3, 1.0)]);
    let state = instance.save().unwrap();
    let mut other = faulty.create(&config("{}")).unwrap();
    other.load(&state).unwrap();
    assert_eq!(other.save().unwrap(), state);
    assert_eq!([other.param(1), other.param(2), other.param(3)].map(Result::unwrap), [0.7, 11.0, 1.0]);

    let mut damaged = state.clone();
    *damaged.last_mut().unwrap() ^= 1;
    let mut cut = state.clone();
    cut.truncate(state.len() - 3);
    let foreign =
        load(artifacts().plugin("reef_example_rust"), 1).create(&config("{}")).unwrap().save().unwrap();
    for (bytes, part) in [
        (&damaged, "hash"),
        (&cut, "cut or grown"),
        (&foreign, "of plugin `example.kelp-rust`"),
        (&vec![], "no saved"),
    ] {
        let error = other.load(bytes).unwrap_err();
        assert!(matches!(error, PluginError::State { .. }) && error.to_string().contains(part), "{error}");
        assert_eq!(other.save().unwrap(), state);
    }
}

#[test]
fn parameters_are_clamped_and_unknown_ones_change_nothing() {
    let mut instance = plugin(1).create(&config("{}")).unwrap();
    let events = [set_param(1, 99.0), set_param(2, f64::NAN), set_param(4, 0.4), set_param(77, 1.0)];
    assert_eq!(instance.step(&Sea::default().input(1), &events).status, StepStatus::Ok);
    assert_eq!(instance.param(1).unwrap(), 2.0);
    assert_eq!(instance.param(2).unwrap(), 8.0);
    assert_eq!(instance.param(4).unwrap(), 0.0);
    assert!(instance.param(77).is_err());
}

#[test]
fn a_panic_in_reset_is_survived_and_the_next_reset_makes_the_instance_anew() {
    let mut instance = plugin(1).create(&config(r#"{"fault": "panic_in_reset"}"#)).unwrap();
    assert!(instance.reset().unwrap_err().to_string().contains("chosen panic in reset"));
    assert!(matches!(instance.health(), Health::Faulty(_)));
    instance.reset().unwrap();
    assert_eq!(instance.step(&Sea::default().input(1), &[]).status, StepStatus::Ok);
}

#[test]
fn a_panic_in_a_destructor_reaches_nobody() {
    drop(plugin(1).create(&config(r#"{"fault": "panic_in_drop"}"#)).unwrap());
}

#[test]
fn a_faulty_instance_does_not_stop_its_siblings() {
    let plugin = plugin(2);
    let mut sick = plugin.create(&config(r#"{"fault": "panic_in_job"}"#)).unwrap();
    let mut well = plugin.create(&config("{}")).unwrap();
    let sea = Sea::default();
    for step in 1..=20 {
        let expected = if step == 1 { StepStatus::Failed } else { StepStatus::Standing };
        assert_eq!(sick.step(&sea.input(step), &[]).status, expected);
        assert_eq!(well.step(&sea.input(step), &[]).status, StepStatus::Ok);
    }
}
