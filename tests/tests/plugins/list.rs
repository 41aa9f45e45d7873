//! `reef plugin list`, as a person and a program read it.

use std::{
    fs,
    process::{Command, Output},
};

use reef_tests::artifacts::artifacts;

fn list(beside: &[&str], arguments: &[&std::ffi::OsStr]) -> Output {
    let installed = artifacts().side_by_side(beside);
    let program = installed.path().join(artifacts().reef().file_name().unwrap());
    Command::new(program).args(["plugin", "list"]).args(arguments).output().unwrap()
}

#[test]
fn the_list_names_plugins_parameters_and_versions_and_ends_with_0() {
    let output = list(&["reef_fixture_faulty", "reef_example_rust"], &[]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "{text}");
    for part in
        ["fixture.faulty  Faulty 1.0.0", "example.kelp-rust", "height", "0.1 to 2 m (default 1)", "red/green"]
    {
        assert!(text.contains(part), "no {part:?} in:\n{text}");
    }
}

#[test]
fn the_json_list_is_one_object_with_schema_and_parameters() {
    let output = list(&["reef_fixture_faulty"], &["--json".as_ref()]);
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(output.status.success());
    let plugin = &json["plugins"][0];
    assert_eq!(plugin["id"], "fixture.faulty");
    assert_eq!(plugin["params"].as_array().unwrap().len(), 4);
    assert_eq!(plugin["config_schema"]["properties"]["in_step"]["type"], "integer");
    assert_eq!(json["refused"].as_array().unwrap().len(), 0);
}

#[test]
fn a_refused_file_in_a_named_folder_is_shown_with_its_reason_and_the_exit_code_is_2() {
    let folder = artifacts().folder_of(&["reef_example_rust"]);
    let bad = folder.path().join(format!("libbad{}", std::env::consts::DLL_SUFFIX));
    fs::write(&bad, "no library").unwrap();
    let output = list(&[], &["--plugin-dir".as_ref(), folder.path().as_os_str()]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(text.contains("example.kelp-rust"), "the good one is there, too:\n{text}");
    assert!(text.contains("libbad") && text.contains("is no dynamic library"), "{text}");
}

#[test]
fn a_named_folder_replaces_what_lies_beside_the_program() {
    let folder = artifacts().folder_of(&["reef_example_rust"]);
    let output = list(
        &["reef_example_rust"],
        &["--json".as_ref(), "--plugin-dir".as_ref(), folder.path().as_os_str()],
    );
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(output.status.success(), "{json:#}");
    let path = json["plugins"][0]["path"].as_str().unwrap();
    assert!(path.starts_with(&*folder.path().to_string_lossy()), "{path}");
    assert!(json["notes"][0]["note"].as_str().unwrap().contains("already there"));
}

#[test]
fn without_plugins_the_list_says_so() {
    let output = list(&[], &[]);
    assert!(output.status.success());
    assert!(String::from_utf8(output.stdout).unwrap().starts_with("No plugins"));
}

/// `reef plugin list` where the shell's words were done first, with mounts of its own; None: nobody may make
/// any.
#[cfg(target_os = "linux")]
fn list_after(words: &str, program: &std::path::Path, plugins: &std::path::Path) -> Option<Output> {
    let shell = format!("{words} || exit 99; exec \"$@\"");
    let mut command = Command::new("unshare");
    command.args(["-Urm", "sh", "-c", &shell, "sh"]).arg(program).args(["plugin", "list"]);
    let output = command.arg("--plugin-dir").arg(plugins).output().expect("unshare is there");
    let told = String::from_utf8_lossy(&output.stderr);
    let made = output.status.code() != Some(99) && !told.starts_with("unshare: ");
    if !made {
        assert!(told.contains("not permitted") || told.contains("ermission denied"), "{told}");
        reef_tests::skip(&format!("mounts are not allowed here: {told}"));
    }
    made.then_some(output)
}

#[test]
#[cfg(target_os = "linux")]
fn a_folder_for_copies_in_which_nothing_runs_is_named_with_a_way_out() {
    let (plugins, copies) = (artifacts().folder_of(&["reef_example_rust"]), tempfile::tempdir().unwrap());
    let words =
        format!("mount -t tmpfs -o noexec t {0} && TMPDIR={0} && export TMPDIR", copies.path().display());
    let Some(output) = list_after(&words, artifacts().reef(), plugins.path()) else { return };
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(2), "{text}");
    let told =
        format!("from {}, in which the system runs nothing (noexec): set TMPDIR", copies.path().display());
    assert!(text.contains(&told), "{text}");
}

#[test]
#[cfg(target_os = "linux")]
fn plugins_beside_the_program_are_found_where_there_is_no_proc() {
    let installed = artifacts().side_by_side(&["reef_example_rust"]);
    let program = installed.path().join(artifacts().reef().file_name().unwrap());
    let empty = tempfile::tempdir().unwrap();
    let Some(output) = list_after("mount -t tmpfs t /proc", &program, empty.path()) else { return };
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("example.kelp-rust"), "{text}");
}
