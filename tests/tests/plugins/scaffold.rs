//! `reef plugin new`: what it makes builds, is found, moves, keeps its state, and can be seen.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

use reef_plugin::StepStatus;
use reef_render::pictures::read_png;
use reef_tests::{
    artifacts::{artifacts, build, workspace},
    languages::C,
    sea::{Sea, config, set_param},
    skip,
};

use crate::{everything, load};

/// `reef` in a folder, with the workspace's assets.
fn reef(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(artifacts().reef());
    command.current_dir(folder).args(arguments).arg("--assets").arg(workspace().join("assets"));
    command.output().unwrap()
}

fn told(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

/// Everything that a fresh scaffold must do. `library`: what its own build made.
fn does_what_it_should(folder: &Path, id: &str, library: &Path) {
    let plugins = library.parent().unwrap().to_str().unwrap();
    let listed = reef(folder, &["plugin", "list", "--plugin-dir", plugins]);
    assert!(
        listed.status.success() && told(&listed).contains(&format!("{id}  My weed 0.1.0")),
        "{}",
        told(&listed)
    );
    // The commands that were printed name the library; without guards there is no checker.
    if cfg!(all(target_os = "linux", any(target_arch = "x86_64", target_arch = "aarch64"))) {
        let checked = reef(folder, &["plugin", "check", library.to_str().unwrap()]);
        assert!(checked.status.success(), "{}", told(&checked));
    }
    let simulated = reef(folder, &["sim", "scene.toml", "--steps", "60", "--plugin-dir", plugins]);
    assert!(simulated.status.success(), "{}", told(&simulated));

    let plugin = load(library, 2);
    assert_eq!(plugin.info().id, id);
    let run = |workers: usize, save: bool| {
        let plugin = load(library, workers);
        let mut instance = plugin.create(&config("{}")).unwrap();
        for step in 0..60 {
            if save && step == 30 {
                let state = instance.save().unwrap();
                instance = plugin.create(&config("{}")).unwrap();
                instance.load(&state).unwrap();
            }
            let events = if step == 10 { vec![set_param(1, 2.0), set_param(2, 0.1)] } else { vec![] };
            let report = instance.step(&Sea::default().input(step), &events);
            assert_eq!((report.status, report.message), (StepStatus::Ok, None));
            if step == 0 {
                assert_eq!(
                    instance.outputs().fibre_nodes[7].position[0],
                    instance.outputs().fibre_nodes[0].position[0]
                );
            }
        }
        instance
    };
    let mut straight = run(1, false);
    let nodes = &straight.outputs().fibre_nodes;
    assert_eq!(nodes.len(), 80 * 8);
    // 0.2 m/s · 2 s, after 50 steps of which 0.1 s is the time constant: all but e⁻⁸ of it.
    let lean = nodes[7].position[0] - nodes[0].position[0];
    assert!((lean - 0.4).abs() < 1e-3, "{lean}");
    let bytes = everything(&mut straight);
    assert!(bytes == everything(&mut run(3, false)), "the number of workers shows");
    assert!(bytes == everything(&mut run(2, true)), "saving and loading shows");

    // What differs from the same sea without the module is the weed.
    let scene = fs::read_to_string(folder.join("scene.toml")).unwrap();
    let (sea, _) = scene.split_once("[modules.").expect("the scene has a module");
    fs::write(folder.join("empty.toml"), sea).unwrap();
    let render = |scene: &str| {
        let name = format!("{scene}.png");
        let scene = format!("{scene}.toml");
        let from = ["--from", "2", "--size", "320x180", "--plugin-dir", plugins, "--out", &name];
        let rendered = reef(folder, &[&["render", &scene], &from[..]].concat());
        if rendered.status.code() == Some(3) {
            skip(&told(&rendered));
            return None;
        }
        assert!(rendered.status.success(), "{}", told(&rendered));
        Some(read_png(&folder.join(name)).unwrap())
    };
    let (Some(with), Some(without)) = (render("scene"), render("empty")) else { return };
    // Above the horizon alone: on the sand the shadow of the weed would count, too.
    let above = 320 * 72 * 4;
    let pixels = with.rgba[..above].chunks_exact(4).zip(without.rgba[..above].chunks_exact(4));
    let changed = pixels.filter(|(a, b)| a.iter().zip(*b).any(|(a, b)| a.abs_diff(*b) > 40)).count();
    let share = changed as f64 / f64::from(320 * 72);
    assert!(share > 0.02, "the weed covers {share:.4} of the water");
}

/// A scaffold in a fresh folder.
fn scaffold(language: &str) -> (tempfile::TempDir, PathBuf) {
    let parent = tempfile::tempdir().unwrap();
    let made = reef(parent.path(), &["plugin", "new", "my-weed", "--lang", language, "--json"]);
    assert!(made.status.success(), "{}", told(&made));
    let json: serde_json::Value = serde_json::from_slice(&made.stdout).unwrap();
    assert_eq!(json["id"], "my.my-weed");
    let check = json["commands"][2].as_str().unwrap();
    assert!(
        check.starts_with("reef plugin check ") && check.ends_with(std::env::consts::DLL_SUFFIX),
        "{check}"
    );
    let folder = parent.path().join("my-weed");
    for file in json["files"].as_array().unwrap() {
        assert!(folder.join(file.as_str().unwrap()).is_file(), "{file}");
    }
    (parent, folder)
}

#[test]
fn a_scaffold_in_rust_builds_moves_and_shows() {
    let (_parent, folder) = scaffold("rust");
    // One folder for all runs: what the SDK needs is built once.
    let built = build(&folder, &["my-weed"], Some(&workspace().join("target/scaffold")));
    does_what_it_should(&folder, "my.my-weed", built.plugin("my_weed"));

    // What the guide does next: a key of the configuration, and a slip of the pen.
    let plugins = built.plugin("my_weed").parent().unwrap().to_str().unwrap();
    let scene = fs::read_to_string(folder.join("scene.toml")).unwrap();
    let check = |key: &str| {
        let changed =
            scene.replace("use = \"my.my-weed\"\n", &format!("use = \"my.my-weed\"\n{key} = 400\n"));
        assert_ne!(changed, scene);
        fs::write(folder.join("changed.toml"), changed).unwrap();
        reef(&folder, &["scene", "check", "changed.toml", "--plugin-dir", plugins])
    };
    assert!(check("count").status.success());
    let slip = check("cuont");
    assert_eq!(slip.status.code(), Some(2));
    assert!(
        told(&slip).contains("modules.first.cuont") && told(&slip).contains("`count`"),
        "{}",
        told(&slip)
    );
}

#[test]
fn a_scaffold_in_c_builds_moves_and_shows() {
    let (_parent, folder) = scaffold("c");
    let Some(compiler) = C.compiler() else { return };
    let make = |arguments: &[&str]| {
        let mut command = Command::new("make");
        command.current_dir(&folder).arg(format!("CC={compiler}")).args(arguments);
        command.output().unwrap()
    };
    let made = make(&["CFLAGS=-Wall -Wextra -Wshadow -Werror"]);
    assert!(made.status.success(), "{}", told(&made));
    let library = format!("{}my-weed{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    does_what_it_should(&folder, "my.my-weed", &folder.join(library));
}

#[test]
fn a_name_or_place_that_will_not_do_is_refused_with_2_and_leaves_nothing() {
    let parent = tempfile::tempdir().unwrap();
    fs::create_dir(parent.path().join("there")).unwrap();
    fs::write(parent.path().join("file"), "kept").unwrap();
    for (arguments, reason) in [
        (&["My Weed"][..], "a plugin cannot be called `My Weed`"),
        (&["serde"], "this word is taken"),
        (&["there"], "there is there already"),
        (&["file", "--lang", "c"], "file is there already"),
        (&["no/folder", "--lang", "c"], "there is no folder no"),
        (&["weed", "--sdk", "there"], "there is no crate reef-sdk in this folder"),
    ] {
        let refused = reef(parent.path(), &[&["plugin", "new"], arguments].concat());
        assert_eq!(refused.status.code(), Some(2), "{}", told(&refused));
        assert!(told(&refused).contains(reason), "{reason}: {}", told(&refused));
    }
    let mut names: Vec<_> =
        fs::read_dir(parent.path()).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    assert_eq!(names, ["file", "there"]);
    assert_eq!(fs::read(parent.path().join("file")).unwrap(), b"kept");
}

#[test]
fn outside_of_a_checkout_rust_asks_for_the_sdk_and_c_needs_none() {
    let installed = artifacts().side_by_side(&[]);
    let program = installed.path().join(artifacts().reef().file_name().unwrap());
    let new = |arguments: &[&str]| {
        let mut command = Command::new(&program);
        command.current_dir(installed.path()).args(["plugin", "new"]).args(arguments).output().unwrap()
    };
    let lost = new(&["weed"]);
    assert_eq!(lost.status.code(), Some(2));
    assert!(told(&lost).contains("--sdk DIR") && told(&lost).contains("--lang c"), "{}", told(&lost));
    assert!(!installed.path().join("weed").exists());
    let sdk = workspace().join("sim-plugins/sdk");
    let named = new(&["weed", "--sdk", sdk.to_str().unwrap()]);
    assert!(named.status.success(), "{}", told(&named));
    assert!(new(&["reeds", "--lang", "c"]).status.success());

    // The SDK of another contract would make plugins that this program refuses.
    let other = tempfile::tempdir().unwrap();
    for folder in ["sdk", "abi"] {
        fs::create_dir(other.path().join(folder)).unwrap();
    }
    fs::copy(sdk.join("Cargo.toml"), other.path().join("sdk/Cargo.toml")).unwrap();
    fs::write(other.path().join("abi/reef_sim.h"), "/* of another age */\n").unwrap();
    let other = new(&["kelp", "--sdk", other.path().join("sdk").to_str().unwrap()]);
    assert_eq!(other.status.code(), Some(2));
    assert!(told(&other).contains("another reef_sim.h than this program"), "{}", told(&other));
}
