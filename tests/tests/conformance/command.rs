//! The command as people and programs meet it.

use std::fs;

use reef_tests::artifacts::{artifacts, workspace};

use crate::{command, ended, json, told};

#[test]
fn the_guide_has_the_table_of_all_checks() {
    let answer = json(&command(&[&"--list", &"--json"]).output().unwrap());
    let checks = answer["checks"].as_array().unwrap();
    assert!(checks.len() >= 60, "{}", checks.len());
    let rows: Vec<String> = checks
        .iter()
        .map(|check| {
            format!("| `{}` | {} |", check["name"].as_str().unwrap(), check["about"].as_str().unwrap())
        })
        .collect();
    let guide = fs::read_to_string(workspace().join("sim-plugins/README.md")).unwrap();
    let table = rows.join("\n");
    assert!(guide.contains(&table), "sim-plugins/README.md should have these rows:\n{table}");

    let listed = told(&command(&[&"--list"]).output().unwrap());
    assert_eq!(listed.lines().count(), checks.len());
    assert!(listed.starts_with("file-library "), "{listed}");
}

#[test]
fn a_sound_plugin_is_0_and_the_answer_names_every_check() {
    let library = artifacts().plugin("reef_example_rust");
    let output = command(&[&library, &"--only", &"descriptor", &"--only", &"file-library"]).output().unwrap();
    let text = told(&output);
    assert_eq!(output.status.code(), Some(0), "{text}");
    assert!(text.contains("pass  file-library") && text.contains("pass  descriptor-id"), "{text}");
    assert!(!text.contains("entry-") && text.contains("14 checks: 14 passed, 0 failed, 0 skipped"), "{text}");
}

#[test]
fn a_broken_rule_is_1_and_is_quoted() {
    let library = artifacts().plugin("reef_fixture_faulty");
    let config = r#"{"breach": "state_truncated"}"#;
    let output = command(&[&library, &"--only", &"state-truncated", &"--config", &config]).output().unwrap();
    let text = told(&output);
    assert_eq!(output.status.code(), Some(1), "{text}");
    for part in [
        "FAIL  state-truncated",
        "load_state() returned REEF_OK",
        "reef_sim.h says: \"load_state: not readable; the instance is untouched\"",
        "1 checks: 0 passed, 1 failed, 0 skipped",
        "one check failed",
    ] {
        assert!(text.contains(part), "no {part:?} in:\n{text}");
    }
}

#[test]
fn what_a_failed_check_is_needed_for_is_skipped_and_says_so() {
    let library = artifacts().plugin("reef_fixture_faulty");
    let mut command = command(&[&library, &"--json", &"--only", &"state"]);
    let answer = json(&command.env("REEF_FAULTY_BREACH", "load_open").output().unwrap());
    // What was not asked for is told only where it is the reason.
    assert_eq!(ended(&answer, "fail"), ["load-open"]);
    assert!(ended(&answer, "pass").is_empty());
    let skipped = ended(&answer, "skip");
    assert!(skipped.len() > 20 && skipped.iter().all(|name| name.starts_with("state-")), "{skipped:?}");
}

#[test]
fn what_cannot_be_checked_as_asked_is_2() {
    let library = artifacts().plugin("reef_fixture_faulty");
    let folder = tempfile::tempdir().unwrap();
    for (arguments, part) in [
        (&[&"no/such/library.so" as &dyn AsRef<std::ffi::OsStr>][..], "no/such/library.so: cannot be read"),
        (&[&folder.path()], "is a folder"),
        (&[&library, &"--only", &"state-trunkated"], "did you mean \"state-truncated\"?"),
        (&[&library, &"--config", &"{"], "--config: it is not JSON"),
        (&[&library, &"--config", &r#"{"brech": 1}"#], "modules.checked.brech"),
        (&[&library, &"--config", &r#"{"fault": "bad_config"}"#], "things[3].size: is -1"),
        (&[&library, &"--timeout", &"0"], "--timeout"),
        (&[], "<PATH>"),
    ] {
        let output = command(arguments).output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{}", told(&output));
        assert!(told(&output).contains(part), "no {part:?} in:\n{}", told(&output));
    }
}

#[test]
fn a_text_file_is_no_plugin_and_that_is_1() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("libletter.so");
    fs::write(&path, "Dear Sir or Madam,\n").unwrap();
    let output = command(&[&path, &"--json"]).output().unwrap();
    let answer = json(&output);
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(ended(&answer, "fail"), ["file-library"]);
    assert!(ended(&answer, "pass").is_empty());
}

#[test]
fn a_configuration_may_be_a_file_or_a_scene() {
    let library = artifacts().plugin("reef_anemone");
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("table.json");
    fs::write(&table, r#"{"fibres": [{"position": [0.0, -4.0, 0.0]}]}"#).unwrap();
    let scene = workspace().join("assets/scenes/anemone-fig13-36-anemones.toml");
    for config in [table, scene] {
        let output = command(&[&library, &"--only", &"step-runs", &"--config", &config]).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{}", told(&output));
    }
}

#[test]
#[cfg(target_os = "linux")]
fn a_check_that_is_ended_from_outside_tells_what_it_has_found() {
    use std::{
        io::{BufRead, BufReader, Read},
        os::unix::process::ExitStatusExt,
        process::Stdio,
        time::Duration,
    };

    let library = artifacts().plugin("reef_example_rust");
    let mut command = command(&[&library, &"--jobs", &"1"]);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut answer = BufReader::new(child.stdout.take().unwrap());
    let mut text = String::new();
    while !text.contains("pass  file-library") {
        assert!(answer.read_line(&mut text).unwrap() > 0, "{text}");
    }
    // SAFETY: the child was not waited for.
    unsafe { libc::kill(child.id() as i32, libc::SIGTERM) };
    answer.read_to_string(&mut text).unwrap();
    let output = reef_tests::child::wait(child, Duration::from_secs(60), "the check");
    assert_eq!(output.status.signal(), Some(libc::SIGTERM), "{text}");
    assert!(text.contains("ended by SIGTERM") && !text.contains("FAIL"), "{text}");
    let sum = text.lines().last().unwrap();
    assert!(sum.contains(" passed, 0 failed, ") && !sum.contains(" 0 passed"), "{sum}");
}
