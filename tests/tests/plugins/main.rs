//! Plugins as a host meets them: good ones, broken files, faults of every kind, and always this build's
//! libraries. What needs guards runs where there are guards.

mod bad_libraries;
#[cfg(target_os = "linux")]
mod dormant;
#[cfg(all(target_os = "linux", any(target_arch = "x86_64", target_arch = "aarch64")))]
mod faults;
mod fresh;
mod guide;
#[cfg(all(target_os = "linux", any(target_arch = "x86_64", target_arch = "aarch64")))]
mod hostile;
mod languages;
mod list;
mod meshes;
mod older;
#[cfg(all(target_os = "linux", any(target_arch = "x86_64", target_arch = "aarch64")))]
mod own_faults;
mod raw;
mod repeatable;
#[cfg(all(target_os = "linux", any(target_arch = "x86_64", target_arch = "aarch64")))]
mod rescue;
#[cfg(all(target_os = "linux", any(target_arch = "x86_64", target_arch = "aarch64")))]
mod runaways;
mod scaffold;
mod services;
#[cfg(all(target_os = "linux", any(target_arch = "x86_64", target_arch = "aarch64")))]
mod strikes;
mod textures;
mod units;
mod unload;

use std::path::Path;

use reef_plugin::{Instance, Library, Plugin, Refusal};

/// The one plugin of a library, on this many workers.
fn load(path: &Path, workers: usize) -> Plugin {
    let (_, mut plugins) =
        Library::load(path, workers).unwrap_or_else(|refusal| panic!("{}: {refusal}", path.display()));
    assert_eq!(plugins.len(), 1);
    plugins.remove(0)
}

/// Why a file is refused.
fn refusal(path: &Path) -> Refusal {
    match Library::load(path, 1) {
        Ok(_) => panic!("{} was loaded", path.display()),
        Err(refusal) => refusal,
    }
}

/// All that an instance emitted and would save, as bytes.
fn everything(instance: &mut Instance) -> Vec<u8> {
    let outputs = instance.outputs().clone();
    let mut bytes = Vec::new();
    for (_, count, elements) in outputs.all_bytes() {
        bytes.extend_from_slice(&(count as u64).to_le_bytes());
        bytes.extend_from_slice(elements);
    }
    bytes.extend(instance.save().expect("the instance saves"));
    bytes
}
