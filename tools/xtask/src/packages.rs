//! What Reef needs beside Rust: looked for first, installed where that is allowed, named exactly where it is
//! not.

use std::{
    env,
    path::Path,
    process::{Command, Stdio},
};

use serde_json::Value;

use crate::{Failure, Outcome};

/// The table that `reef doctor` reads, too.
const TABLE: &str = include_str!("../../packages.json");

/// Package managers in the order in which their commands are printed.
const MANAGERS: [(&str, &[&str]); 4] = [
    ("apt", &["apt-get", "install", "-y"]),
    ("dnf", &["dnf", "install", "-y"]),
    ("pacman", &["pacman", "-S", "--needed", "--noconfirm"]),
    ("brew", &["brew", "install"]),
];

/// Makes sure that everything in these groups of the table is there.
pub fn require(groups: &[&str]) -> Outcome {
    let table: Value = serde_json::from_str(TABLE)
        .map_err(|error| Failure::check(format!("tools/packages.json: {error}")))?;
    let missing = still_missing(&table, groups);
    if missing.is_empty() {
        return Ok(());
    }
    for (group, what) in &missing {
        println!("Missing: {what} ({})", table[*group]["why"].as_str().unwrap_or(group));
    }
    let names: Vec<&str> = missing.iter().map(|(group, _)| *group).collect();
    if !install(&table, &names) {
        return Err(Failure::machine(advice(&table, &names)));
    }
    match still_missing(&table, &names).as_slice() {
        [] => Ok(()),
        left => {
            let what: Vec<&str> = left.iter().map(|(_, what)| what.as_str()).collect();
            Err(Failure::machine(format!("still missing after the installation: {}", what.join(", "))))
        }
    }
}

/// The groups that lack something, with what they lack.
fn still_missing<'a>(table: &Value, groups: &[&'a str]) -> Vec<(&'a str, String)> {
    let known = loader_cache();
    let mut missing = Vec::new();
    for group in groups {
        let entry = &table[*group];
        let mut lacks: Vec<String> = Vec::new();
        if cfg!(target_os = "linux") {
            lacks.extend(
                strings(&entry["libraries"]).filter(|name| !has_library(&known, name)).map(String::from),
            );
        }
        lacks.extend(strings(&entry["programs"]).filter(|name| !has_program(name)).map(String::from));
        lacks.extend(
            strings(&entry["python"]).filter(|name| !has_module(name)).map(|name| format!("Python's {name}")),
        );
        for places in entry["files"].as_array().into_iter().flatten() {
            // Environment variables of the Vulkan loader may point elsewhere: then trust them.
            let overridden =
                env::var_os("VK_DRIVER_FILES").is_some() || env::var_os("VK_ICD_FILENAMES").is_some();
            if !overridden && !strings(places).any(exists) {
                lacks.extend(strings(places).next().map(String::from));
            }
        }
        if !lacks.is_empty() {
            missing.push((*group, lacks.join(", ")));
        }
    }
    missing
}

fn strings(value: &Value) -> impl Iterator<Item = &str> {
    value.as_array().into_iter().flatten().filter_map(Value::as_str)
}

/// A file that exists, or a folder that holds something.
fn exists(path: &str) -> bool {
    let path = Path::new(path);
    path.is_file() || path.read_dir().is_ok_and(|mut entries| entries.next().is_some())
}

/// What the dynamic linker knows, as `ldconfig -p` prints it; empty where there is no ldconfig.
fn loader_cache() -> String {
    let answer = |program: &str| Command::new(program).arg("-p").stderr(Stdio::null()).output().ok();
    ["ldconfig", "/sbin/ldconfig"]
        .iter()
        .find_map(|program| answer(program))
        .map(|output| String::from_utf8_lossy(&output.stdout).into_owned())
        .unwrap_or_default()
}

fn has_library(cache: &str, name: &str) -> bool {
    let cached = cache.lines().any(|line| line.split_whitespace().next() == Some(name));
    let on_path = || {
        let paths = env::var_os("LD_LIBRARY_PATH").unwrap_or_default();
        env::split_paths(&paths).any(|folder| folder.join(name).is_file())
    };
    cached || on_path()
}

fn has_program(name: &str) -> bool {
    let paths = env::var_os("PATH").unwrap_or_default();
    env::split_paths(&paths).any(|folder| folder.join(name).is_file())
}

/// Whether a Python that is here, the first of the path or the system's own, has a module.
fn has_module(name: &str) -> bool {
    ["python3", "/usr/bin/python3"].iter().any(|python| {
        let output = Command::new(python).args(["-c", &format!("import {name}")]).output();
        output.is_ok_and(|output| output.status.success())
    })
}

/// Installs the groups' packages with apt where this user may; false where nothing could be tried or it
/// failed.
fn install(table: &Value, groups: &[&str]) -> bool {
    if !has_program("apt-get") {
        return false;
    }
    let Some(prefix) = privilege() else { return false };
    let apt = |arguments: &[&str]| {
        let mut words = prefix.iter().copied().chain(["apt-get"]).chain(arguments.iter().copied());
        let Some(program) = words.next() else { return false };
        let output = Command::new(program)
            .args(words)
            .env("DEBIAN_FRONTEND", "noninteractive")
            .stdin(Stdio::null())
            .stderr(Stdio::inherit())
            .output();
        match output {
            Ok(output) if output.status.success() => true,
            Ok(output) => {
                // What it said on the way, which nobody wants to read where all is well.
                eprintln!(
                    "{}apt-get {} ended with {}",
                    String::from_utf8_lossy(&output.stdout),
                    arguments.join(" "),
                    output.status
                );
                false
            }
            Err(error) => {
                eprintln!("{program}: {error}");
                false
            }
        }
    };
    let packages: Vec<&str> = groups.iter().flat_map(|group| strings(&table[*group]["apt"])).collect();
    println!("Installing {} …", packages.join(" "));
    let install: Vec<&str> =
        ["install", "-y", "-qq", "--no-install-recommends"].into_iter().chain(packages).collect();
    // The list of packages may be new enough; refresh it only when it is not.
    apt(&install) || (apt(&["update", "-qq"]) && apt(&install))
}

/// How to become root without a question: nothing to add, `sudo -n`, or not at all.
fn privilege() -> Option<&'static [&'static str]> {
    let succeeds = |program: &str, arguments: &[&str]| {
        Command::new(program).args(arguments).stdout(Stdio::piped()).stderr(Stdio::null()).output().ok()
    };
    let root = succeeds("id", &["-u"]).is_some_and(|output| output.stdout.trim_ascii() == b"0");
    if root {
        return Some(&[]);
    }
    succeeds("sudo", &["-n", "true"]).filter(|output| output.status.success()).map(|_| &["sudo", "-n"][..])
}

/// The exact command for each package manager.
fn advice(table: &Value, groups: &[&str]) -> String {
    let mut text =
        String::from("cannot install packages as this user. Run the line of your system, then try again:\n");
    for (manager, command) in MANAGERS {
        let packages: Vec<&str> = groups.iter().flat_map(|group| strings(&table[*group][manager])).collect();
        if !packages.is_empty() {
            let sudo = if manager == "brew" { "" } else { "sudo " };
            text.push_str(&format!("  {sudo}{} {}\n", command.join(" "), packages.join(" ")));
        }
    }
    text
}
