//! Meshes of a plugin, from its step to the picture: plants that sway, bodies that swim, bells that pulse.

use std::path::PathBuf;

use reef_tests::artifacts::workspace;

use super::{lacking, reef_with, told};

fn assets() -> PathBuf {
    workspace().join("tests/fixtures/meshes/assets")
}

#[test]
fn meshes_are_as_in_their_golden_pictures_under_the_layers() {
    let output = reef_with(&["reef_fixture_meshes"], &assets(), &["validate"], None);
    if lacking(&output) {
        return;
    }
    assert!(output.status.success(), "{}", told(&output));
}
