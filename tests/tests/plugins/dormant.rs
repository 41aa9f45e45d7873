//! Plugins that were found and that nobody has asked for yet, in a process of its own: builds are tried by
//! another one first, from then on.

use std::{fs, slice, time::Duration};

use reef_plugin::{
    Registry,
    probe::{self, Probe},
};
use reef_tests::{artifacts::artifacts, child};

const ID: &str = "example.kelp-rust";

#[test]
fn what_a_newer_build_replaced_is_not_loaded_any_more() {
    let ended = child::run("dormant::child_that_replaces", "run", Duration::from_secs(60));
    assert!(ended.status.is_some_and(|status| status.success()), "{}", ended.text);
}

#[test]
#[ignore = "in a process of its own"]
fn child_that_replaces() {
    if child::task().is_none() {
        return;
    }
    probe::offer(Probe { program: artifacts().reef().to_owned(), known: None, patience: None });
    let folder = tempfile::tempdir().unwrap();
    let library = folder.path().join(format!("libkelp{}", std::env::consts::DLL_SUFFIX));
    fs::copy(artifacts().plugin("reef_example_rust"), &library).unwrap();
    let mut registry = Registry::new();
    registry.load_folder(folder.path(), 1, true);
    assert!(registry.plugins().is_empty(), "it is dormant");
    assert_eq!(registry.ids().collect::<Vec<_>>(), [ID]);
    let newer = crate::load(&library, 1);
    assert!(registry.replace(slice::from_ref(&newer)).is_empty(), "none was loaded");
    assert_eq!((registry.ids().collect::<Vec<_>>(), registry.paths()), (vec![ID], vec![&*library]));
    registry.wake();
    assert_eq!(registry.plugins().len(), 1);
}
