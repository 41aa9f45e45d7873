//! The example in C, compiled here and stepped by the host.

use std::{env, path::PathBuf, process::Command};

use reef::plugin::{PluginError, StepStatus};
use reef_tests::{
    artifacts::workspace,
    sea::{Sea, config, set_param},
    skip,
};
use tempfile::TempDir;

use crate::{everything, load};

/// Compiles the reeds; None where there is no compiler.
fn reeds() -> Option<(TempDir, PathBuf)> {
    let works =
        |name: &String| Command::new(name).arg("--version").output().is_ok_and(|o| o.status.success());
    let names = env::var("CC").ok().into_iter().chain(["cc", "gcc", "clang"].map(str::to_owned));
    let Some(compiler) = names.into_iter().find(works) else {
        skip("there is no C compiler (tried $CC, cc, gcc, clang)");
        return None;
    };
    let folder = tempfile::tempdir().unwrap();
    let library = folder.path().join(format!("libreeds{}", env::consts::DLL_SUFFIX));
    let output = Command::new(&compiler)
        .args([
            "-std=c11",
            "-O2",
            "-fPIC",
            "-shared",
            "-Wall",
            "-Wextra",
            "-Werror",
            "-ffp-contract=off",
            "-I",
        ])
        .arg(workspace().join("sim-plugins/abi"))
        .arg(workspace().join("sim-plugins/examples/c/reeds.c"))
        .arg("-o")
        .arg(&library)
        .output()
        .unwrap();
    assert!(output.status.success(), "{compiler}: {}", String::from_utf8_lossy(&output.stderr));
    Some((folder, library))
}

#[test]
fn a_plugin_in_c_describes_itself() {
    let Some((_folder, library)) = reeds() else { return };
    let plugin = load(&library, 2);
    let info = plugin.info();
    assert_eq!(
        (info.id.as_str(), info.version.as_str(), info.state_version),
        ("example.reeds-c", "1.0.0", 1)
    );
    let lean = info.param("lean").unwrap();
    assert_eq!(
        (lean.id, lean.minimum, lean.maximum, lean.default, lean.unit.as_str()),
        (1, 0.0, 10.0, 1.0, "s")
    );
}

#[test]
fn fibres_in_c_bend_with_the_current_and_with_their_parameter() {
    let Some((_folder, library)) = reeds() else { return };
    let mut instance = load(&library, 2).create(&config("{}")).unwrap();
    let sea = Sea::default();
    assert_eq!(instance.step(&sea.input(0), &[]).status, StepStatus::Ok);
    assert_eq!(instance.outputs().fibres.len(), 16);
    assert_eq!(instance.outputs().fibre_nodes[7].position, [0.0, 0.3, 0.0]);
    for step in 1..=600 {
        let report = instance.step(&sea.input(step), &[]);
        assert_eq!(report.message, None);
    }
    // As for the reeds in Rust: 0.2 m/s · 1 s after 33 time constants, to rounding.
    let tip = |i: &reef::plugin::Instance| i.outputs().fibre_nodes[7].position[0];
    assert!((tip(&instance) - 0.2).abs() < 1e-6, "{}", tip(&instance));
    for step in 601..=1200 {
        let events = if step == 601 { vec![set_param(1, 2.0)] } else { vec![] };
        instance.step(&sea.input(step), &events);
    }
    assert!((tip(&instance) - 0.4).abs() < 1e-6, "{}", tip(&instance));
    assert_eq!(instance.param(1).unwrap(), 2.0);
    instance.reset().unwrap();
    assert_eq!(instance.param(1).unwrap(), 1.0);
}

#[test]
fn c_gives_the_same_bytes_with_one_and_two_workers_and_over_a_save() {
    let Some((_folder, library)) = reeds() else { return };
    let sea = Sea::default();
    let run = |workers: usize, save: bool| {
        let plugin = load(&library, workers);
        let mut instance = plugin.create(&config("{}")).unwrap();
        for step in 1..=40 {
            if save && step == 20 {
                let state = instance.save().unwrap();
                instance = plugin.create(&config("{}")).unwrap();
                instance.load(&state).unwrap();
            }
            instance.step(&sea.input(step), &[]);
        }
        everything(&mut instance)
    };
    let one = run(1, false);
    assert_eq!(one, run(2, false));
    assert_eq!(one, run(2, true));
}

#[test]
fn c_and_rust_give_the_same_nodes() {
    let Some((_folder, library)) = reeds() else { return };
    let sea = Sea::default();
    let rust = reef_tests::artifacts::artifacts().plugin("reef_example_rust");
    let nodes = |path: &std::path::Path, table: &str| {
        let mut instance = load(path, 2).create(&config(table)).unwrap();
        for step in 1..=100 {
            instance.step(&sea.input(step), &[]);
        }
        let nodes: Vec<[u32; 4]> = instance
            .outputs()
            .fibre_nodes
            .iter()
            .map(|n| [n.position[0], n.position[1], n.position[2], n.radius].map(f32::to_bits))
            .collect();
        nodes
    };
    assert_eq!(nodes(&library, "{}"), nodes(rust, r#"{"count": 16}"#));
}

#[test]
fn a_state_that_the_c_plugin_refuses_leaves_it_as_it_was() {
    let Some((_folder, library)) = reeds() else { return };
    let mut instance = load(&library, 1).create(&config("{}")).unwrap();
    instance.step(&Sea::default().input(1), &[]);
    let before = instance.save().unwrap();
    let forged =
        reef::plugin::envelope::Envelope { plugin: "example.reeds-c", state_version: 1, payload: b"short" }
            .seal();
    let error = instance.load(&forged).unwrap_err();
    assert!(
        matches!(&error, PluginError::State { message, .. } if message.contains("no state of these reeds")),
        "{error}"
    );
    assert_eq!(instance.save().unwrap(), before);
    let newer =
        reef::plugin::envelope::Envelope { plugin: "example.reeds-c", state_version: 2, payload: b"" }.seal();
    assert!(instance.load(&newer).unwrap_err().to_string().contains("reads 1 to 1"));
}
