//! A library leaves the process when nobody uses it any more, and its code never runs on a thread of the
//! host's own.

use std::fs;

use reef_plugin::StepStatus;
use reef_tests::{
    artifacts::artifacts,
    sea::{Sea, config},
};

use crate::load;

/// Is a file whose name begins like this mapped into the process?
fn mapped(stem: &str) -> bool {
    fs::read_to_string("/proc/self/maps").unwrap().contains(stem)
}

#[test]
#[cfg(target_os = "linux")]
fn a_library_is_unmapped_when_its_last_instance_is_gone_even_after_panics() {
    let folder = tempfile::tempdir().unwrap();
    let stem = "libleaves_no_trace";
    let path = folder.path().join(format!("{stem}.so"));
    fs::copy(artifacts().plugin("reef_fixture_faulty"), &path).unwrap();
    for fault in ["none", "panic_in_step", "panic_in_job"] {
        let plugin = load(&path, 3);
        let mut instance = plugin.create(&config(&format!(r#"{{"fault": "{fault}"}}"#))).unwrap();
        drop(plugin);
        let status = instance.step(&Sea::default().input(1), &[]).status;
        assert_eq!(status, if fault == "none" { StepStatus::Ok } else { StepStatus::Failed });
        assert!(mapped(stem), "the library is in use");
        drop(instance);
        assert!(!mapped(stem), "{fault}: the library is still mapped");
    }
}

#[test]
fn a_loaded_library_may_be_overwritten_or_deleted_on_disk() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(format!("libchanging{}", std::env::consts::DLL_SUFFIX));
    fs::copy(artifacts().plugin("reef_fixture_faulty"), &path).unwrap();
    let mut instance = load(&path, 1).create(&config("{}")).unwrap();
    fs::write(&path, "half a build").unwrap();
    assert_eq!(instance.step(&Sea::default().input(1), &[]).status, StepStatus::Ok);
    fs::remove_file(&path).unwrap();
    assert_eq!(instance.step(&Sea::default().input(2), &[]).status, StepStatus::Ok);
}
