//! Files that are no plugin for this host: each is refused with its reason before any of its code runs.

use std::{
    fs,
    path::{Path, PathBuf},
};

use reef_abi as abi;
use reef_plugin::{Refusal, Registry};
use reef_tests::{artifacts::artifacts, libraries::entry_at};
use tempfile::TempDir;

use crate::refusal;

/// A copy of a good library after `spoil` changed its bytes.
fn spoilt(spoil: impl FnOnce(&mut Vec<u8>)) -> (TempDir, PathBuf) {
    let mut bytes = fs::read(artifacts().plugin("reef_fixture_faulty")).unwrap();
    spoil(&mut bytes);
    file(&bytes)
}

fn file(bytes: &[u8]) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(format!("libspoilt{}", std::env::consts::DLL_SUFFIX));
    fs::write(&path, bytes).unwrap();
    (folder, path)
}

#[test]
fn an_empty_file_is_refused() {
    let (_folder, path) = file(b"");
    assert_eq!(refusal(&path), Refusal::Empty);
}

#[test]
fn a_text_file_is_refused() {
    let (_folder, path) = file(b"I am a letter that somebody misnamed.\n");
    assert!(matches!(refusal(&path), Refusal::NoLibrary(_)));
}

#[test]
fn a_library_that_was_cut_off_is_refused() {
    let (_folder, path) = spoilt(|bytes| bytes.truncate(bytes.len() / 2));
    let refusal = refusal(&path);
    assert!(matches!(refusal, Refusal::NoLibrary(_) | Refusal::BadEntry(_) | Refusal::NoEntry), "{refusal}");
}

#[test]
fn a_folder_and_a_file_that_is_not_there_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(refusal(folder.path()), Refusal::Folder);
    assert!(matches!(refusal(&folder.path().join("libgone.so")), Refusal::Unreadable(_)));
    assert!(matches!(refusal(Path::new("/dev/null")), Refusal::Unreadable(_)));
}

#[test]
#[cfg(target_os = "linux")]
fn a_library_of_another_machine_is_refused_by_name() {
    const AARCH64: u8 = 183;
    const X86_64: u8 = 62;
    let (_folder, path) = spoilt(|bytes| bytes[18] = if bytes[18] == X86_64 { AARCH64 } else { X86_64 });
    let Refusal::OtherMachine { found, expected } = refusal(&path) else { panic!("another refusal") };
    assert!(
        found != expected && found.contains(if expected.contains("X86_64") { "Aarch64" } else { "X86_64" })
    );
}

#[test]
fn a_library_without_the_symbol_is_refused() {
    let symbol = abi::ENTRY_SYMBOL.as_bytes();
    let (_folder, path) = spoilt(|bytes| {
        let places: Vec<usize> =
            bytes.windows(symbol.len()).enumerate().filter(|(_, w)| *w == symbol).map(|(i, _)| i).collect();
        assert!(!places.is_empty());
        places.iter().for_each(|place| bytes[*place] = b'x');
    });
    assert_eq!(refusal(&path), Refusal::NoEntry);
}

#[test]
fn another_major_version_is_refused_with_both_versions() {
    let (_folder, path) = spoilt(|bytes| {
        let version = entry_at(bytes) + 12;
        bytes[version..version + 4].copy_from_slice(&(7_u32 << 16).to_ne_bytes());
    });
    let refusal = refusal(&path);
    assert!(matches!(refusal, Refusal::OtherVersion { .. }));
    assert!(refusal.to_string().contains("reef_sim.h 7.0; this host speaks 0."), "{refusal}");
}

#[test]
fn another_header_is_refused_with_both_hashes() {
    let (_folder, path) = spoilt(|bytes| {
        let hash = entry_at(bytes) + 16;
        bytes[hash] ^= 1;
    });
    assert_eq!(
        refusal(&path),
        Refusal::OtherHeader {
            found: u64::from_ne_bytes((abi::HEADER_HASH ^ 1).to_ne_bytes()),
            host: abi::HEADER_HASH
        }
    );
}

#[test]
fn a_wrong_magic_is_refused() {
    let (_folder, path) = spoilt(|bytes| {
        let magic = entry_at(bytes);
        bytes[magic] ^= 0xff;
    });
    assert!(matches!(refusal(&path), Refusal::BadEntry(_)));
}

#[test]
fn the_same_file_loads_twice_as_two_generations() {
    let path = artifacts().plugin("reef_example_rust");
    let (first, second) = (crate::load(path, 1), crate::load(path, 1));
    assert_eq!(first.info(), second.info());
    drop(first);
    drop(second);
    drop(crate::load(path, 1));
}

#[test]
fn of_two_libraries_with_one_id_the_first_by_name_wins_and_the_second_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let library = artifacts().plugin("reef_example_rust");
    for name in ["libb", "liba"] {
        fs::copy(library, folder.path().join(format!("{name}{}", std::env::consts::DLL_SUFFIX))).unwrap();
    }
    fs::write(folder.path().join("notes.txt"), "not a library by its name").unwrap();
    let mut registry = Registry::new();
    registry.load_folder(folder.path(), 1, true);
    assert_eq!(registry.plugins().len(), 1);
    let path = registry.get("example.kelp-rust").unwrap().info().path.clone().unwrap();
    assert!(path.to_string_lossy().contains("liba"));
    let [refused] = registry.refused() else { panic!("{:?}", registry.refused()) };
    assert!(
        matches!(&refused.reason, Refusal::Duplicate { id, first } if id == "example.kelp-rust" && first.contains("liba"))
    );
    assert!(refused.path.to_string_lossy().contains("libb"));
}
