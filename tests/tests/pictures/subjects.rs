//! Golden pictures hold what their scenes show: each thing that is taken out of a scene changes its pictures.

use std::fs;

use reef_tests::artifacts::workspace;

use crate::{lacking, reef, small_assets, told};

#[test]
fn no_thing_of_any_scene_can_be_taken_out_unnoticed() {
    let output = reef(&workspace().join("assets"), &["validate", "--subjects"], None);
    if lacking(&output) {
        return;
    }
    assert!(output.status.success(), "{}", told(&output));
    // Every scene was looked at.
    let scenes = fs::read_dir(workspace().join("assets/scenes")).unwrap().flatten();
    for path in scenes.map(|entry| entry.path()).filter(|path| path.extension().is_some_and(|e| e == "toml"))
    {
        let name = path.file_stem().unwrap().to_str().unwrap();
        assert!(told(&output).contains(name), "{name}:\n{}", told(&output));
    }
}

#[test]
fn a_thing_that_no_picture_shows_is_named() {
    let assets = small_assets();
    let path = assets.path().join("scenes/small.toml");
    let scene = fs::read_to_string(&path).unwrap();
    let unseen = "\n[modules.snow]\nuse = \"reef.particles\"\nparams = { opacity = 0.0 }\n\
                  boxes = [{ low = [-100, 0, -100], high = [100, 100, 100], count = 500 }]\n\
                  \n[[modules.fibres.fibres]]\nposition = [0.0, 0.0, 9000.0]\n";
    fs::write(&path, scene + unseen).unwrap();
    let output = reef(assets.path(), &["validate", "--subjects"], None);
    if lacking(&output) {
        return;
    }
    assert_eq!(output.status.code(), Some(1), "{}", told(&output));
    for (name, seen) in [
        ("modules.snow at step 180", false),
        ("modules.fibres at step 180", true),
        ("fibres[0]", true),
        ("fibres[3]", true),
        ("fibres[4]", false),
        ("flow[0]", true),
    ] {
        let named = told(&output).contains(&format!("{name} can be taken out"));
        assert_eq!(named, !seen, "{name}: {}", told(&output));
    }
}
