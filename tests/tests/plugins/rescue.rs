//! A program that a plugin takes down, where no guard can help, leaves the state of its sea: a run goes on
//! from there as if nothing had happened.

use std::fs;

use reef_tests::hostile::{Met, STEPS, meet, scene, sim, sim_with};

fn hash(met: &Met) -> Option<&str> {
    met.text.lines().find_map(|line| line.strip_prefix("hash "))
}

/// The step of the state that the last words say is in this file.
fn step_of(met: &Met, file: &str) -> Option<u64> {
    let words = met.text.split("The sea at step ").nth(1)?;
    let (step, rest) = words.split_once(" is in ")?;
    rest.strip_prefix(file)?.strip_prefix(". ")?;
    step.parse().ok()
}

#[test]
fn a_run_that_a_plugin_took_down_goes_on_from_its_last_state() {
    let Some(sound) = sim("nothing@nowhere") else { return };
    for (wish, option) in [
        ("fault_apart@step", "--journal"),
        ("abort_apart@step", "--save-state"),
        // All of the heap is written over.
        ("ruin_apart@step", "--journal"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("run").to_string_lossy().into_owned();
        let last = format!("{file}.last");
        let Some(met) = sim_with(wish, &[option, &file]) else { return };
        assert!(met.code.is_none(), "{wish}: {}", met.text);
        let step = step_of(&met, &last).unwrap_or_else(|| panic!("{wish}: {}", met.text));
        // It strikes in the third.
        assert!((1..=2).contains(&step), "{wish}: {}", met.text);
        let parts = fs::read_dir(folder.path()).unwrap().flatten().map(|entry| entry.file_name());
        let parts: Vec<_> = parts.filter(|name| name.to_string_lossy().contains(".last.")).collect();
        assert!(parts.is_empty(), "{parts:?}");
        let rest = (STEPS - step).to_string();
        let again = ["sim", &scene(), "--steps", &rest, "--hash", "--load-state", &last];
        let Some(met) = meet("nothing@nowhere", &again) else { return };
        assert_eq!((met.code, hash(&met)), (Some(0), hash(&sound)), "{wish}: {}", met.text);
    }
}

#[test]
fn a_watched_run_without_files_of_its_own_leaves_its_state_in_the_cache() {
    let arguments = ["sim", &scene(), "--watch", "--steps", "5"];
    let Some(met) = meet("abort_apart@step", &arguments) else { return };
    assert!(met.code.is_none(), "{}", met.text);
    let file = met.text.split(" is in ").nth(1).and_then(|words| words.split_once(". ")).map(|it| it.0);
    let file = file.filter(|file| file.ends_with("last.state")).unwrap_or_else(|| panic!("{}", met.text));
    let step = step_of(&met, file).unwrap_or_else(|| panic!("{}", met.text));
    let again = ["sim", &scene(), "--steps", "1", "--load-state", file, "--json"];
    let Some(met) = meet("nothing@nowhere", &again) else { return };
    assert!(met.code == Some(0) && met.text.contains(&format!("\"step\":{}", step + 1)), "{}", met.text);
}

#[test]
fn a_run_that_ends_well_leaves_no_state_behind() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run").to_string_lossy().into_owned();
    let Some(met) = sim_with("nothing@nowhere", &["--journal", &file]) else { return };
    assert_eq!(met.code, Some(0), "{}", met.text);
    let names: Vec<_> =
        fs::read_dir(folder.path()).unwrap().flatten().map(|entry| entry.file_name()).collect();
    assert_eq!(names, ["run"]);
}
