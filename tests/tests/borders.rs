//! Which crate may know which: the host's crates end where ARCHITECTURE.md says that they do.

use std::{
    collections::{BTreeMap, BTreeSet},
    env, fs,
    path::Path,
    process::Command,
};

use reef_tests::artifacts::workspace;
use serde_json::Value;

/// What a crate of the host, or anything that it is built from, must not depend on: packages, and why.
const BORDERS: [(&str, &[&str], &str); 9] = [
    ("reef-report", OURS, "what the program says knows none of what it speaks of"),
    ("reef-files", OURS, "files know nothing of what is in them"),
    ("reef-gpu", &["reef-abi", "reef-streams", "reef-plugin", "reef-sea"], "Vulkan knows nothing of the sea"),
    (
        "reef-streams",
        &["reef-plugin", "reef-sea", "ash"],
        "streams know neither who emits nor who draws them",
    ),
    (
        "reef-render",
        &["reef-plugin", "reef-sea", "libloading"],
        "the renderer draws frames and knows no plugin",
    ),
    ("reef-plugin", &["reef-sea", "ash"], "the host's side of the contract knows neither scenes nor Vulkan"),
    ("reef-sea", VULKAN, "the sea runs without a device"),
    ("reef-command", VULKAN, "a command that shows nothing needs no device"),
    ("reef-conformance", VULKAN, "plugins are checked without a device"),
];
const OURS: &[&str] = &["reef-abi", "reef-streams", "reef-gpu", "reef-plugin", "reef-sea", "reef-render"];
const VULKAN: &[&str] = &["ash", "ash-window", "gpu-allocator", "reef-gpu", "reef-render"];

/// Those that may name the models: the benches, the package of the tests that cross crates, and the fuzzer.
const KNOW_MODELS: [&str; 3] = ["reef-bench", "reef-fuzz", "reef-tests"];

/// A package of the workspace.
#[derive(Clone, Debug, Default)]
struct Package {
    /// Its folder, from the workspace's.
    folder: String,
    /// Packages that it is built from.
    needs: BTreeSet<String>,
    /// Packages that only its tests need.
    tests_need: BTreeSet<String>,
}

type Packages = BTreeMap<String, Package>;

/// All packages of the workspace, as cargo reads them.
fn packages() -> Packages {
    let output = Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
        .current_dir(workspace())
        .args(["metadata", "--no-deps", "--offline", "--format-version", "1"])
        .output()
        .expect("cargo starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let text = |value: &Value| value.as_str().expect("a text").to_owned();
    let root = fs::canonicalize(workspace()).expect("the workspace");
    let read = |package: &Value| {
        let manifest = text(&package["manifest_path"]);
        let folder = Path::new(&manifest).parent().expect("a folder");
        let folder = fs::canonicalize(folder).expect("a folder");
        let mut read = Package {
            folder: folder.strip_prefix(&root).expect("in the workspace").to_string_lossy().into_owned(),
            ..Package::default()
        };
        for dependency in package["dependencies"].as_array().expect("a list") {
            let list = match dependency["kind"].as_str() {
                Some("dev") => &mut read.tests_need,
                _ => &mut read.needs,
            };
            list.insert(text(&dependency["name"]));
        }
        (text(&package["name"]), read)
    };
    metadata["packages"].as_array().expect("a list").iter().map(read).collect()
}

/// What a package is built from, near or far; of what is not the workspace's, only the names.
fn closure<'a>(packages: &'a Packages, name: &'a str) -> BTreeSet<&'a str> {
    let mut found = BTreeSet::new();
    let mut open = vec![name];
    while let Some(next) = open.pop() {
        for need in packages.get(next).into_iter().flat_map(|package| &package.needs) {
            if found.insert(need.as_str()) {
                open.push(need);
            }
        }
    }
    found
}

/// Where a border is crossed, one line a case.
fn crossings(packages: &Packages) -> Vec<String> {
    let mut all = Vec::new();
    for (name, banned, why) in BORDERS {
        if !packages.contains_key(name) {
            all.push(format!("{name}: there is no such package"));
        }
        for known in closure(packages, name).intersection(&banned.iter().copied().collect()) {
            all.push(format!("{name} is built from {known}: {why}"));
        }
    }
    // Its tests may make a sea to draw; they need no library for that.
    if packages["reef-render"].tests_need.contains("reef-plugin") {
        all.push("the tests of reef-render name reef-plugin".to_owned());
    }
    let models: BTreeMap<&str, &str> = packages
        .iter()
        .filter_map(|(name, package)| {
            Some((
                name.as_str(),
                package.folder.strip_suffix("/model").filter(|of| of.starts_with("sim-plugins/"))?,
            ))
        })
        .collect();
    for (name, package) in packages {
        for known in package.needs.iter().chain(&package.tests_need) {
            if let Some(module) = models.get(known.as_str())
                && package.folder != *module
                && !KNOW_MODELS.contains(&name.as_str())
            {
                all.push(format!("{name} names the model {known}: only {} may", KNOW_MODELS.join(" and ")));
            }
        }
    }
    all
}

#[test]
fn no_crate_knows_more_than_its_subject_needs() {
    let packages = packages();
    let hosts: BTreeSet<&str> = packages
        .iter()
        .filter_map(|(name, package)| package.folder.starts_with("host/").then_some(name.as_str()))
        .collect();
    // These two put all together.
    let held: BTreeSet<&str> = BORDERS.iter().map(|(name, ..)| *name).chain(["reef", "reef-bench"]).collect();
    assert_eq!(hosts, held, "every crate of the host has its borders here");
    assert_eq!(crossings(&packages), [""; 0]);
}

#[test]
fn each_border_that_is_crossed_is_told() {
    let packages = packages();
    for (name, banned, _) in BORDERS {
        for banned in banned {
            let mut crossed = packages.clone();
            crossed.get_mut(name).expect("a package").needs.insert((*banned).to_owned());
            let told = crossings(&crossed);
            let wanted = format!("{name} is built from {banned}: ");
            assert!(told.iter().any(|line| line.starts_with(&wanted)), "{wanted} {told:?}");
        }
    }
    for (name, model) in [("reef", "reef-anemone-model"), ("reef-sea", "reef-particles-model")] {
        let mut crossed = packages.clone();
        crossed.get_mut(name).expect("a package").tests_need.insert(model.to_owned());
        let told = crossings(&crossed);
        assert!(
            told.iter().any(|line| line.starts_with(&format!("{name} names the model {model}"))),
            "{told:?}"
        );
    }
    // Far away counts, too.
    let mut crossed = packages.clone();
    crossed.get_mut("reef-files").expect("a package").needs.insert("ash".to_owned());
    assert!(crossings(&crossed).iter().any(|line| line.starts_with("reef-sea is built from ash: ")));
}
