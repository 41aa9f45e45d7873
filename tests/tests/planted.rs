//! `reef validate` finds what it is there to find: each fault that is planted on purpose makes it fail and
//! say so.

use std::process::{Command, Output};

use reef_tests::{
    artifacts::{artifacts, workspace},
    own, skip,
};

/// Validates the smallest scene, with a fault planted.
fn validate(fault: &str) -> Output {
    let plugins = artifacts().folder_of(&own::libraries());
    Command::new(artifacts().reef())
        .current_dir(workspace())
        .arg("--plugin-dir")
        .arg(plugins.path())
        .args(["validate", "assets/scenes/anemone-fig10-exponent.toml"])
        .env("REEF_PLANT_FAULT", fault)
        .output()
        .expect("reef starts")
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

#[test]
fn validation_fails_for_every_planted_fault_and_hears_nothing_without_one() {
    let clean = validate("");
    if clean.status.code() == Some(3) {
        return skip(&said(&clean));
    }
    // What each fault is known by: a hazard that synchronisation validation names, a layout that core
    // validation names, and the leaked buffer's name from the list of the living.
    let marks = [("barrier", "SYNC-HAZARD"), ("layout", "layout"), ("leak", "REEF-leak")];
    for (_, mark) in marks {
        assert!(!said(&clean).contains(mark), "without a fault:\n{}", said(&clean));
    }
    for (fault, mark) in marks {
        let output = validate(fault);
        assert_eq!(output.status.code(), Some(1), "{fault}:\n{}", said(&output));
        assert!(said(&output).contains(mark), "{fault}:\n{}", said(&output));
    }
}
