//! What `reef bench churn` and `reef bench reload` measure, in a few seconds and with room for a busy
//! machine.

use std::{
    env, fs,
    path::{Path, PathBuf},
    time::Duration,
};

use reef_bench::{churn::churn, reload::soon};
use reef_tests::{artifacts::workspace, child};
use tempfile::TempDir;

use crate::build_file;

/// A build in a file whose name no other test's copies have.
fn place(build: &Path, stem: &str) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(format!("{stem}{}", env::consts::DLL_SUFFIX));
    fs::copy(build, &path).unwrap();
    (folder, path)
}

#[test]
#[cfg(target_os = "linux")]
fn reloads_leave_no_mapping_no_file_and_no_copy_behind_even_with_thread_locals() {
    // Alone: what other tests of this program hold open meanwhile is counted, too.
    for (features, stem) in [("", "libplain_of_figures"), ("thread-local", "liblocal_of_figures")] {
        let task = format!("{stem}\n{}", build_file(features).display());
        let ended = child::run("figures::child_that_reloads", &task, Duration::from_secs(120));
        assert!(ended.status.is_some_and(|status| status.success()), "{ended:#?}");
    }
}

#[test]
#[ignore = "in a process of its own"]
fn child_that_reloads() {
    let Some(task) = child::task() else { return };
    let (stem, build) = task.split_once('\n').expect("a name and a build");
    let (_folder, path) = place(Path::new(build), stem);
    let churn = churn(&path, "fixture.growing", &workspace().join("assets"), 20, 100).unwrap().unwrap();
    assert_eq!((churn.refused, churn.pinned), (0, 0), "{stem}");
    assert_eq!(churn.after.copies, 0, "{stem}");
    let mapped = fs::read_to_string("/proc/self/maps").unwrap();
    assert!(!mapped.contains(stem), "{stem} is still mapped");
    assert_eq!(churn.after.descriptors, churn.before.descriptors, "{stem}: {churn:?}");
}

#[test]
fn a_build_that_is_renamed_into_place_runs_within_a_few_steps() {
    let (_folder, path) = place(&build_file(""), "libsoon_of_figures");
    let soon = soon(&path, "fixture.growing", &workspace().join("assets"), 12).unwrap().unwrap();
    println!("{soon:?}");
    assert_eq!(soon.missed, 0, "{soon:?}");
    // Four steps; alone on the machine it is one.
    assert!(soon.whole.within(0.5) < 4.0 / 60.0, "{soon:?}");
}
