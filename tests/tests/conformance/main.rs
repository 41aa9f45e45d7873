//! `reef plugin check`: Reef's own plugins pass, each check catches a fault that is planted for it, and
//! nothing that a plugin does confuses the checker. Where there are no guards there is no checker.
#![cfg(all(target_os = "linux", any(target_arch = "x86_64", target_arch = "aarch64")))]

mod command;
mod own;
mod planted;
mod survival;

use std::{
    ffi::OsStr,
    path::Path,
    process::{Command, Output},
};

use reef_tests::artifacts::{artifacts, workspace};
use serde_json::Value;

/// `reef plugin check` with these arguments.
fn command(arguments: &[&dyn AsRef<OsStr>]) -> Command {
    let mut command = Command::new(artifacts().reef());
    command.args(["plugin", "check"]).args(arguments).arg("--assets").arg(workspace().join("assets"));
    command
}

/// All that a command said.
fn told(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

/// The answer for programs.
fn json(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{error}: {}", told(output)))
}

/// Names of the checks that ended so.
fn ended(answer: &Value, result: &str) -> Vec<String> {
    let checks = answer["checks"].as_array().expect("checks");
    let so = checks.iter().filter(|check| check["result"] == result);
    so.map(|check| check["name"].as_str().expect("a name").to_owned()).collect()
}

/// The message of a check.
fn message(answer: &Value, name: &str) -> String {
    let checks = answer["checks"].as_array().expect("checks");
    let check = checks.iter().find(|check| check["name"] == name).unwrap_or_else(|| panic!("no {name}"));
    check["message"].as_str().unwrap_or_default().to_owned()
}

/// The library must pass, and not by skipping: what it has not is named.
fn passes(library: &Path, config: Option<&str>, skipped: &[&str]) {
    let mut command = command(&[&library, &"--json"]);
    command.args(config.map(|config| ["--config", config]).iter().flatten());
    let output = command.output().unwrap();
    let answer = json(&output);
    let failed = ended(&answer, "fail");
    let why: Vec<String> = failed.iter().map(|name| format!("{name}: {}", message(&answer, name))).collect();
    assert!(output.status.success() && failed.is_empty(), "{}: {why:#?}", library.display());
    let unexpected: Vec<String> =
        ended(&answer, "skip").into_iter().filter(|name| !skipped.contains(&name.as_str())).collect();
    assert!(unexpected.is_empty(), "{}: skipped {unexpected:?}", library.display());
    assert!(answer["passed"].as_u64().unwrap() >= 60, "{}", answer["passed"]);
}
