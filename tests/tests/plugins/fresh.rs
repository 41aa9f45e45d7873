//! An edited plugin is the one that gets loaded, always.

use std::{fs, path::Path};

use reef_tests::{
    artifacts::{artifacts, build},
    own::OWN,
};

use crate::load;

/// A plugin without any dependency: builds in a second.
const SOURCE: &str = include_str!("../../fixtures/tiny.rs.in");

fn write(folder: &Path, version: &str) {
    let source = SOURCE
        .replace("@VERSION@", version)
        .replace("@MAGIC@", &reef_abi::MAGIC.to_string())
        .replace("@CONTRACT@", &reef_abi::VERSION.to_string())
        .replace("@HASH@", &reef_abi::HEADER_HASH.to_string());
    fs::write(folder.join("src/lib.rs"), source).unwrap();
}

#[test]
fn an_edited_source_gives_the_new_library_even_in_the_same_second() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("src")).unwrap();
    fs::write(
        folder.path().join("Cargo.toml"),
        "[workspace]\n[package]\nname = \"tiny\"\nversion = \"0.1.0\"\nedition = \"2024\"\n\
         [lib]\nname = \"tiny\"\ncrate-type = [\"cdylib\"]\n",
    )
    .unwrap();
    let target = folder.path().join("target");
    for version in ["1.0.0", "2.0.0", "3.0.0"] {
        write(folder.path(), version);
        let built = build(folder.path(), &["tiny"], Some(&target));
        assert_eq!(load(built.plugin("tiny"), 1).info().version, version);
    }
}

#[test]
fn the_build_names_every_plugin_and_the_program() {
    let built = artifacts();
    assert!(built.reef().is_file());
    for name in OWN.iter().map(|plugin| plugin.library).chain(["reef_fixture_faulty"]) {
        assert!(built.plugin(name).is_file(), "{name}");
    }
}
