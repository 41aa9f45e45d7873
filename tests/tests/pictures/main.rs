//! `reef render` and `reef validate`, as a person and a program meet them: planted faults are found, goldens
//! are held, places that cannot be written are refused.

mod meshes;
mod subjects;
mod walk;

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

use reef_render::pictures::read_png;
use reef_tests::{
    artifacts::{artifacts, workspace},
    own, skip,
};

/// Runs `reef` with its modules beside it.
fn reef(assets: &Path, arguments: &[&str], fault: Option<&str>) -> Output {
    reef_with(&own::libraries(), assets, arguments, fault)
}

/// Runs `reef` with these plugins beside it.
fn reef_with(plugins: &[&str], assets: &Path, arguments: &[&str], fault: Option<&str>) -> Output {
    let installed = artifacts().side_by_side(plugins);
    let program = installed.path().join(artifacts().reef().file_name().unwrap());
    let mut command = Command::new(program);
    command.args(arguments).arg("--assets").arg(assets).env_remove("REEF_PLANT_FAULT");
    if let Some(fault) = fault {
        command.env("REEF_PLANT_FAULT", fault);
    }
    command.output().unwrap()
}

fn told(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

/// The machine lacks a driver or a layer: the test is skipped, or fails where everything is required.
fn lacking(output: &Output) -> bool {
    let lacks = output.status.code() == Some(3);
    if lacks {
        skip(&told(output));
    }
    lacks
}

/// Assets with one small scene of anemones, and no golden picture yet.
fn small_assets() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let assets = workspace().join("assets");
    fs::create_dir_all(folder.path().join("scenes")).unwrap();
    fs::create_dir_all(folder.path().join("species")).unwrap();
    for entry in fs::read_dir(assets.join("species")).unwrap().flatten() {
        fs::copy(entry.path(), folder.path().join("species").join(entry.file_name())).unwrap();
    }
    let scene = fs::read_to_string(assets.join("scenes/anemone-fig10-exponent.toml")).unwrap();
    fs::write(folder.path().join("scenes/small.toml"), scene).unwrap();
    folder
}

fn golden(assets: &Path) -> PathBuf {
    assets.join("golden/small.png")
}

#[test]
fn a_scene_is_blessed_then_matches_and_a_changed_or_missing_golden_fails() {
    let assets = small_assets();
    let missing = reef(assets.path(), &["validate"], None);
    if lacking(&missing) {
        return;
    }
    assert_eq!(missing.status.code(), Some(1), "{}", told(&missing));
    assert!(told(&missing).contains("no golden picture"));
    assert!(!golden(assets.path()).exists(), "a check writes nothing");

    let blessed = reef(assets.path(), &["validate", "--bless"], None);
    assert!(blessed.status.success(), "{}", told(&blessed));
    assert!(golden(assets.path()).with_extension("json").exists());
    let report = assets.path().join("report");
    let same = reef(assets.path(), &["validate", "--report", report.to_str().unwrap()], None);
    assert!(same.status.success(), "{}", told(&same));
    assert!(report.join("index.html").exists() && report.join("small-difference.png").exists());

    // The golden of another size stands for any other picture: what differs pixel by pixel is tested beside
    // the code.
    fs::copy(report.join("small-difference.png"), golden(assets.path())).unwrap();
    let other = reef(assets.path(), &["validate"], None);
    assert_eq!(other.status.code(), Some(1), "{}", told(&other));
    assert!(told(&other).contains("pixels differ"), "{}", told(&other));
}

#[test]
fn each_moment_of_a_film_has_a_golden_picture_and_old_ones_are_noticed() {
    let assets = small_assets();
    let path = assets.path().join("scenes/small.toml");
    let scene = fs::read_to_string(&path).unwrap();
    fs::write(&path, scene.replace("duration = 6.0", "duration = 6.0\nmoments = [0.5, 0.1]")).unwrap();
    let blessed = reef(assets.path(), &["validate", "--bless"], None);
    if lacking(&blessed) {
        return;
    }
    assert!(blessed.status.success(), "{}", told(&blessed));
    let folder = assets.path().join("golden");
    let [early, late] =
        ["small-6", "small-30"].map(|name| fs::read(folder.join(name).with_extension("png")).unwrap());
    assert!(early != late, "the fibres bend between them");
    assert!(!golden(assets.path()).exists(), "the middle is no moment");

    fs::write(golden(assets.path()), &early).unwrap();
    let stray = reef(assets.path(), &["validate"], None);
    assert_eq!(stray.status.code(), Some(1), "{}", told(&stray));
    assert!(told(&stray).contains("this is no moment of the scene"), "{}", told(&stray));
    assert!(reef(assets.path(), &["validate", "--bless"], None).status.success());
    assert!(!golden(assets.path()).exists(), "blessing removes it");

    fs::write(folder.join("small-30.png"), &early).unwrap();
    let wrong = reef(assets.path(), &["validate"], None);
    assert_eq!(wrong.status.code(), Some(1), "the second moment is compared, too: {}", told(&wrong));
}

#[test]
fn validation_fails_for_each_planted_fault() {
    let assets = small_assets();
    let clean = reef(assets.path(), &["validate", "--bless"], None);
    if lacking(&clean) {
        return;
    }
    assert!(clean.status.success(), "{}", told(&clean));
    for fault in ["barrier", "layout", "leak"] {
        let output = reef(assets.path(), &["validate"], Some(fault));
        assert_eq!(output.status.code(), Some(1), "{fault} was not noticed:\n{}", told(&output));
        assert!(told(&output).contains("error"), "{fault}: a message says so:\n{}", told(&output));
    }
}

#[test]
fn the_same_frame_rendered_twice_is_the_same_file_and_a_folder_holds_all_frames() {
    let assets = small_assets();
    let out = |name: &str| assets.path().join(name).to_str().unwrap().to_owned();
    let render = |out: &str| {
        reef(
            assets.path(),
            &["render", "small", "--frames", "3", "--from", "0.5", "--size", "160x90", "--out", out],
            None,
        )
    };
    let first = render(&out("a.png"));
    if lacking(&first) {
        return;
    }
    assert!(first.status.success(), "{}", told(&first));
    assert!(render(&out("b.png")).status.success());
    assert!(render(&out("all")).status.success());
    let [a, b] = ["a.png", "b.png"].map(|name| fs::read(assets.path().join(name)).unwrap());
    assert!(a == b, "the same frame gives the same bytes");
    let all = assets.path().join("all");
    assert_eq!(fs::read_dir(&all).unwrap().count(), 3);
    // Packed another way.
    let [last, one] =
        [all.join("frame-000003.png"), assets.path().join("a.png")].map(|path| read_png(&path).unwrap());
    assert!(last == one, "the last of all is the one");
}

#[test]
fn places_that_cannot_be_written_and_bad_numbers_end_with_2_and_leave_nothing() {
    let assets = small_assets();
    let missing = assets.path().join("no/such/a.png");
    for arguments in [
        vec!["render", "small", "--out", missing.to_str().unwrap()],
        vec!["render", "small", "--out", "picture.tiff"],
        vec!["render", "small", "--out", "a.png", "--frames", "0"],
        vec!["render", "small", "--out", "a.png", "--size", "0x4"],
        vec!["render", "small", "--out", "a.png", "--from", "NaN"],
        vec!["render", "nothing-of-this-name", "--out", "a.png"],
    ] {
        let output = reef(assets.path(), &arguments, None);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", told(&output));
    }
    assert!(!assets.path().join("no").exists() && !Path::new("a.png").exists());
}
