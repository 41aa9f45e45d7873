//! Reef's own plugins, the examples in all languages: all pass. (The scaffolds are checked where they are
//! built.)

use std::{path::Path, process::Command};

use reef_tests::{
    artifacts::{artifacts, workspace},
    languages::{C, CPP},
    own::OWN,
    zig,
};

use crate::passes;

/// What no plugin of ours does.
const NEVER: [&str; 1] = ["step-sleep"];

#[test]
fn reefs_own_plugins_pass_all_checks() {
    for plugin in OWN {
        passes(artifacts().plugin(plugin.library), plugin.config, &[&NEVER, plugin.lacks].concat());
    }
}

#[test]
fn the_examples_in_c_and_cpp_pass_all_checks() {
    for language in [C, CPP] {
        let Some(built) = language.kelp(None) else { continue };
        passes(&built.library(), None, &NEVER);
    }
}

#[test]
fn zig_reads_the_header_and_the_example_in_zig_passes_all_checks() {
    let Some(built) = zig::blade() else { return };
    // Its only parameter is a length.
    passes(&built.library(), None, &[&NEVER[..], &["param-whole"]].concat());
}

#[test]
fn every_plugin_of_the_workspace_is_listed_as_reefs_own() {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(cargo)
        .current_dir(workspace())
        .args(["metadata", "--no-deps", "--format-version", "1", "--offline"])
        .output()
        .unwrap();
    let metadata: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let ours = workspace().join("sim-plugins");
    let mut found = Vec::new();
    for package in metadata["packages"].as_array().unwrap() {
        let is_library =
            |target: &serde_json::Value| target["kind"].as_array().unwrap().iter().any(|k| k == "cdylib");
        if Path::new(package["manifest_path"].as_str().unwrap()).starts_with(&ours)
            && package["targets"].as_array().unwrap().iter().any(is_library)
        {
            found.push(package["name"].as_str().unwrap().to_owned());
        }
    }
    found.sort();
    let mut listed: Vec<&str> = OWN.iter().map(|plugin| plugin.package).collect();
    listed.sort_unstable();
    assert_eq!(found, listed, "tests/src/own.rs lists them");
}
