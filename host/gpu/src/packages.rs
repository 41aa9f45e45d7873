//! What has to be installed for what, and the command that does it. The table is `tools/packages.json`, which
//! the set-up command reads, too.

use std::{collections::BTreeMap, ffi::OsStr, fs::Metadata, path::PathBuf};

/// Packages of one purpose, by package manager.
#[derive(Clone, Debug, serde::Deserialize)]
pub struct Purpose {
    /// What they are for.
    pub why: String,
    /// Debian, Ubuntu.
    pub apt: Vec<String>,
    /// Fedora.
    pub dnf: Vec<String>,
    /// Arch.
    pub pacman: Vec<String>,
    /// macOS.
    pub brew: Vec<String>,
}

/// Package managers with the command that installs.
const MANAGERS: [(&str, &str); 4] = [
    ("apt-get", "sudo apt-get install -y"),
    ("dnf", "sudo dnf install -y"),
    ("pacman", "sudo pacman -S --needed"),
    ("brew", "brew install"),
];

/// The whole table.
pub fn table() -> BTreeMap<String, Purpose> {
    // A test parses the committed table, so that this is never empty in a build that passed.
    serde_json::from_str(include_str!("../../../tools/packages.json")).unwrap_or_default()
}

/// One command for each package manager that is here; for all of them where none is.
pub fn commands(purposes: &[&str]) -> Vec<String> {
    commands_for(purposes, &|manager| program(manager).is_ok())
}

fn commands_for(purposes: &[&str], is_here: &dyn Fn(&str) -> bool) -> Vec<String> {
    let table = table();
    let all = |known: bool| -> Vec<String> {
        MANAGERS
            .iter()
            .filter(|(manager, _)| !known || is_here(manager))
            .filter_map(|(manager, command)| {
                let mut names: Vec<&str> = Vec::new();
                for purpose in purposes.iter().filter_map(|purpose| table.get(*purpose)) {
                    let list = match *manager {
                        "apt-get" => &purpose.apt,
                        "dnf" => &purpose.dnf,
                        "pacman" => &purpose.pacman,
                        _ => &purpose.brew,
                    };
                    for name in list {
                        if !names.contains(&name.as_str()) {
                            names.push(name);
                        }
                    }
                }
                (!names.is_empty()).then(|| format!("{command} {}", names.join(" ")))
            })
            .collect()
    };
    let here = all(true);
    if here.is_empty() { all(false) } else { here }
}

/// A sentence that tells a person what to type.
pub fn advice(purposes: &[&str]) -> String {
    format!("install it with:\n  {}", commands(purposes).join("\nor\n  "))
}

/// Where a program lies that PATH reaches. `Err`: there is none; or a file of that name, which may not be
/// run.
pub fn program(name: &str) -> Result<PathBuf, Option<PathBuf>> {
    program_in(name, &std::env::var_os("PATH").unwrap_or_default())
}

fn program_in(name: &str, paths: &OsStr) -> Result<PathBuf, Option<PathBuf>> {
    let mut barred = None;
    for path in std::env::split_paths(paths).map(|folder| folder.join(name)) {
        let Ok(data) = path.metadata() else { continue };
        match data.is_file() && may_run(&data) {
            true => return Ok(path),
            false if data.is_file() && barred.is_none() => barred = Some(path),
            false => {}
        }
    }
    Err(barred)
}

#[cfg(unix)]
fn may_run(data: &Metadata) -> bool {
    std::os::unix::fs::PermissionsExt::mode(&data.permissions()) & 0o111 != 0
}

#[cfg(not(unix))]
fn may_run(_: &Metadata) -> bool {
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_of_packages_parses_and_names_something_for_each_purpose() {
        let table: BTreeMap<String, Purpose> =
            serde_json::from_str(include_str!("../../../tools/packages.json")).expect("tools/packages.json");
        for (purpose, packages) in &table {
            assert!(!packages.why.is_empty() && !packages.apt.is_empty(), "{purpose}");
        }
        for used in ["run", "validate", "window", "window-tests", "video", "shaders"] {
            assert!(table.contains_key(used), "{used} is used by the code");
        }
    }

    #[test]
    fn a_machine_gets_the_command_of_its_own_package_manager() {
        let apt = commands_for(&["run"], &|m| m == "apt-get");
        assert_eq!(apt, ["sudo apt-get install -y libvulkan1 mesa-vulkan-drivers"]);
    }

    #[test]
    fn an_unknown_machine_gets_the_commands_of_all_package_managers() {
        assert_eq!(commands_for(&["run"], &|_| false).len(), MANAGERS.len());
    }

    #[cfg(unix)]
    #[test]
    fn a_file_that_may_not_be_run_is_told_apart_from_none() {
        use std::{fs, os::unix::fs::PermissionsExt};
        let [first, second] = [(); 2].map(|()| tempfile::tempdir().expect("a folder"));
        let paths = std::env::join_paths([first.path(), second.path()]).expect("paths");
        assert_eq!(program_in("tool", &paths), Err(None));
        let [one, two] = [&first, &second].map(|folder| folder.path().join("tool"));
        fs::write(&one, "").expect("written");
        assert_eq!(program_in("tool", &paths), Err(Some(one)));
        fs::write(&two, "").expect("written");
        fs::set_permissions(&two, fs::Permissions::from_mode(0o755)).expect("changed");
        assert_eq!(program_in("tool", &paths), Ok(two));
    }
}
