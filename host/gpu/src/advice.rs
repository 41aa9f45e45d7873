//! The way out where Vulkan finds no driver or layer: what the environment hides from the loader comes before
//! what could be installed.

use std::{ffi::OsString, path::Path};

use super::{error::GpuError, packages};

/// Lists of files or folders that the loader reads in place of the system's drivers.
const DRIVERS: [&str; 2] = ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"];
/// Patterns of drivers that the loader takes or leaves.
const FILTERS: [&str; 2] = ["VK_LOADER_DRIVERS_SELECT", "VK_LOADER_DRIVERS_DISABLE"];
/// Folders in which the loader looks for layers in place of the system's.
const LAYERS: [&str; 2] = ["VK_LAYER_PATH", "VK_LOADER_LAYERS_DISABLE"];

/// Largest description of a driver that is looked at [bytes].
const LARGEST: u64 = 1 << 20;

type Variable<'a> = &'a dyn Fn(&str) -> Option<OsString>;

fn variable(name: &str) -> Option<OsString> {
    std::env::var_os(name)
}

/// The loader knows no driver.
pub(crate) fn no_driver() -> GpuError {
    GpuError::NoDriver { help: hidden_drivers().unwrap_or_else(|| packages::advice(&["run"])) }
}

/// The loader knows no validation layer.
pub(crate) fn no_layer() -> GpuError {
    GpuError::NoLayer { help: hidden_layers().unwrap_or_else(|| packages::advice(&["validate"])) }
}

/// What of the environment can hide the drivers that are installed, a line each; None: nothing of it is set.
pub fn hidden_drivers() -> Option<String> {
    hidden(&variable, &[DRIVERS.as_slice(), &FILTERS].concat())
}

/// What of the environment can hide the layers that are installed, a line each; None: nothing of it is set.
pub fn hidden_layers() -> Option<String> {
    hidden(&variable, &LAYERS)
}

/// Does the environment name a driver's description that is none? The loader then gives all kinds of results.
pub(crate) fn names_no_driver() -> bool {
    DRIVERS.iter().filter_map(|name| variable(name)).any(|value| {
        std::env::split_paths(&value).any(|path| !path.as_os_str().is_empty() && fault_of(&path).is_some())
    })
}

/// What of the environment can be the reason; None: nothing of it is set.
fn hidden(variable: Variable<'_>, names: &[&str]) -> Option<String> {
    let mut lines = Vec::new();
    for name in names {
        let Some(value) = variable(name).filter(|value| !value.is_empty()) else { continue };
        lines.push(format!("{name} is set ({}): correct or unset it", value.to_string_lossy()));
        if DRIVERS.contains(name) {
            for path in std::env::split_paths(&value).filter(|path| !path.as_os_str().is_empty()) {
                lines.extend(fault_of(&path).map(|fault| format!("  {}: {fault}", path.display())));
            }
        }
    }
    (!lines.is_empty()).then(|| lines.join("\n"))
}

/// What is wrong with the description of a driver.
fn fault_of(path: &Path) -> Option<String> {
    if path.is_dir() {
        return None;
    }
    let text = match reef_files::bounded::read_text(path, LARGEST) {
        Ok(text) => text,
        Err(error) => return Some(error.to_string()),
    };
    let json: serde_json::Value = match serde_json::from_str(&text) {
        Ok(json) => json,
        Err(error) => return Some(format!("it is not JSON: {error}")),
    };
    let library = json.pointer("/ICD/library_path").and_then(serde_json::Value::as_str);
    let Some(library) = library else { return Some("it names no library (ICD.library_path)".to_owned()) };
    // A bare name is looked for by the system's linker, another one beside the description.
    let missing = library.contains('/') && !path.parent().unwrap_or(Path::new(".")).join(library).exists();
    missing.then(|| format!("its library {library} is not there"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_environment_hides_is_named_with_its_fault() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = |name: &str, text: &str| {
            let path = folder.path().join(name);
            std::fs::write(&path, text).expect("a file");
            path
        };
        let sound = file("sound.json", r#"{"ICD": {"library_path": "libvulkan_x.so"}}"#);
        let paths = [
            file("cut.json", r#"{"ICD": {"libr"#),
            file("empty.json", "{}"),
            file("gone.json", r#"{"ICD": {"library_path": "./gone.so"}}"#),
            folder.path().join("missing.json"),
            sound.clone(),
        ];
        let list = std::env::join_paths(&paths).expect("a list");
        let set = |name: &str| (name == "VK_DRIVER_FILES").then(|| list.clone());
        let told = hidden(&set, &DRIVERS).expect("a reason");
        assert!(told.starts_with("VK_DRIVER_FILES is set ("), "{told}");
        for part in [
            "cut.json: it is not JSON",
            "empty.json: it names no library",
            "gone.json: its library ./gone.so is not there",
            "missing.json: No such file",
        ] {
            assert!(told.contains(part), "{part}: {told}");
        }
        assert!(!told.contains("sound.json: "), "{told}");
        assert_eq!(fault_of(&sound), None);
        assert_eq!(hidden(&set, &LAYERS), None);
        assert_eq!(hidden(&|_| Some(OsString::new()), &DRIVERS), None, "an empty variable says nothing");
    }
}
