//! Scenes through the program itself: the reference is up to date, all scenes are sound, bad input ends with
//! code 2 and one clear error, and nothing is left half written.

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::{Command, Output, Stdio},
    sync::OnceLock,
};

use reef_tests::{
    artifacts::{artifacts, workspace},
    own,
};
use tempfile::TempDir;

/// The program beside all plugins of the workspace.
fn installed() -> &'static TempDir {
    static INSTALLED: OnceLock<TempDir> = OnceLock::new();
    INSTALLED.get_or_init(|| artifacts().side_by_side(&own::libraries()))
}

fn reef(arguments: &[&str]) -> Output {
    let program = installed().path().join(format!("reef{}", env::consts::EXE_SUFFIX));
    Command::new(program)
        .args(["--assets".as_ref(), workspace().join("assets").as_os_str()])
        .args(arguments)
        .env_remove("REEF_LOG")
        .output()
        .expect("the program runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Runs the program, which must end with code 2; returns what it said.
fn refused(arguments: &[&str]) -> String {
    let output = reef(arguments);
    let told = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "reef {arguments:?} said: {told}");
    assert!(!told.contains("panicked"), "{told}");
    told
}

fn scenes() -> Vec<PathBuf> {
    let folder = workspace().join("assets/scenes");
    let entries = fs::read_dir(folder).expect("the folder of scenes");
    let mut scenes: Vec<PathBuf> = entries.map(|entry| entry.expect("an entry").path()).collect();
    scenes.retain(|path| path.extension().is_some_and(|extension| extension == "toml"));
    scenes.sort();
    scenes
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("the folder can be read");
    entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect()
}

#[test]
fn the_reference_of_scenes_is_what_the_code_says() {
    let output = reef(&["scene", "reference"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let made = text(&output.stdout);
    let path = workspace().join("assets/scenes/README.md");
    if env::var_os("REEF_BLESS").is_some_and(|value| value == "1") {
        fs::write(&path, &made).expect("the reference can be written");
    }
    let stored = fs::read_to_string(&path).unwrap_or_default();
    let differs = made.lines().zip(stored.lines()).position(|(made, stored)| made != stored);
    assert!(
        made == stored,
        "assets/scenes/README.md is old (line {differs:?}): REEF_BLESS=1 cargo test -p reef-tests reference"
    );
}

#[test]
fn every_module_has_a_scene_and_a_row_in_the_readme() {
    let read = |path: &Path| fs::read_to_string(path).expect("a text");
    let (scenes, readme) = (scenes(), read(&workspace().join("README.md")));
    for id in own::modules().map(|module| module.id) {
        let uses = |path: &PathBuf| read(path).contains(&format!("use = \"{id}\""));
        assert!(scenes.iter().any(uses), "no scene uses {id}");
        let name = id.trim_start_matches("reef.");
        assert!(readme.contains(&format!("\n| `{name}` | ")), "README.md has no row for `{name}`");
    }
}

#[test]
fn every_scene_of_the_assets_is_sound_and_steps() {
    let scenes = scenes();
    assert!(scenes.iter().any(|path| path.ends_with("reef.toml")));
    for path in scenes {
        let path = path.to_str().expect("UTF-8");
        let output = reef(&["scene", "check", path]);
        assert!(output.status.success(), "{path}: {}", text(&output.stderr));
        let output = reef(&["sim", path, "--steps", "3", "--json"]);
        assert!(output.status.success(), "{path}: {}", text(&output.stderr));
        let answer: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        assert_eq!(answer["messages"], serde_json::json!([]), "{path}");
    }
}

#[test]
fn the_schema_of_scenes_knows_every_plugin() {
    let output = reef(&["scene", "schema"]);
    let schema: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let modules =
        schema.pointer("/properties/modules/additionalProperties/anyOf").and_then(|list| list.as_array());
    let mut ids: Vec<_> = modules
        .expect("a choice of plugins")
        .iter()
        .filter_map(|m| m["properties"]["use"]["const"].as_str())
        .collect();
    ids.sort_unstable();
    let mut own: Vec<_> = own::modules().map(|module| module.id).collect();
    own.sort_unstable();
    assert_eq!(ids, own);
    // Every reference leads somewhere.
    fn visit(root: &serde_json::Value, value: &serde_json::Value) {
        match value {
            serde_json::Value::Object(table) => {
                if let Some(target) = table.get("$ref").and_then(|target| target.as_str()) {
                    let pointer = target.strip_prefix('#').expect("a local reference");
                    assert!(root.pointer(pointer).is_some(), "{target} leads nowhere");
                }
                table.values().for_each(|inner| visit(root, inner));
            }
            serde_json::Value::Array(list) => list.iter().for_each(|inner| visit(root, inner)),
            _ => {}
        }
    }
    visit(&schema, &schema);
}

#[test]
fn bad_scenes_end_with_code_two_and_the_place_of_the_fault() {
    let folder = tempfile::tempdir().expect("a folder");
    let put = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        fs::write(&path, bytes).expect("a file");
        path.to_str().expect("UTF-8").to_owned()
    };
    let unknown = put("unknown.toml", b"[scene]\nsed = 1\n");
    let told = refused(&["sim", &unknown, "--steps", "1"]);
    assert!(
        told.contains(&format!(
            "{unknown}:2:1: scene.sed: is not known; allowed here: name, description, seed, dt"
        )),
        "{told}"
    );
    assert!(told.contains("did you mean `seed`?"), "{told}");
    for (name, bytes, wanted) in [
        ("empty.toml", b"".as_slice(), "the scene file is empty"),
        ("latin.toml", b"[scene]\nname = \"\xe9\"\n", "is not UTF-8 text"),
        ("binary.toml", b"\x00\x01\x02", "this is not TOML"),
        ("nan.toml", b"[camera]\nfov = nan\n", ":2:7: camera.fov: nan is not a finite number"),
        ("infinite.toml", b"[water]\ndepth = inf\n", ":2:9: water.depth: inf is not a finite number"),
        ("type.toml", b"[scene]\ndt = true\n", ":2:6: scene.dt: is a switch (true or false), but must be a number"),
        ("count.toml", b"[terrain.rocks]\ncount = 1000000000\n", "from 0 to 10000"),
        ("plugin.toml", b"[modules.a]\nuse = 'reef.anemona'\n", "reef.anemone"),
        (
            "depth.toml",
            b"[water]\ndepth = 0\n[modules.a]\nuse = 'reef.particles'\n",
            ":2:9: water.depth: is 0, but must be a number above 0",
        ),
        ("wind.toml", b"[waves]\nwind = -3\n", ":2:8: waves.wind: is -3, but must be a number from 0 to 60"),
        (
            "box.toml",
            b"[modules.a]\nuse = 'reef.particles'\nboxes = [{ low = [0, -1, 0], high = [1, -2, 1] }]\n",
            "must lie beyond `low` along y: -2 is not above -1",
        ),
        (
            "crowd.toml",
            b"[modules.a]\nuse = 'reef.particles'\nboxes = [{ low = [0, -1, 0], high = [1, 0, 1], concentration = 1e8 }]\n",
            "the limit is 4000000 in all boxes of a module together",
        ),
        (
            "species.toml",
            b"[modules.a]\nuse = 'reef.anemone'\nanemones = [{ species = 'nobody' }]\n",
            "there is no species \"nobody\"",
        ),
        (
            "cycle.toml",
            b"[modules.a]\nuse = 'reef.anemone'\nanemones = [{ species = 'x' }]\n[species.x]\nbase = 'y'\n[species.y]\nbase = 'x'\n",
            "this species builds on itself: x → y → x",
        ),
    ]
    .map(|(name, bytes, wanted): (&str, &[u8], &str)| (name, bytes, wanted.to_owned()))
    {
        let path = put(name, bytes);
        let told = refused(&["sim", &path, "--steps", "1"]);
        assert!(told.contains(&wanted), "{name}: {told}");
    }
    let large = folder.path().join("large.toml");
    fs::File::create(&large).and_then(|file| file.set_len(100 << 20)).expect("a sparse file");
    let told = refused(&["sim", large.to_str().expect("UTF-8"), "--steps", "1"]);
    assert!(told.contains("has 100.0 MiB; the limit is 4 MiB"), "{told}");
    assert!(refused(&["sim", "no-such-scene", "--steps", "1"]).contains("there is no such scene file"));
    assert!(refused(&["scene", "check", &unknown]).contains("scene.sed"));
}

#[test]
fn bad_flags_and_files_beside_the_scene_end_with_code_two() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let junk = file("junk");
    fs::write(&junk, b"junk").expect("a file");
    let sim = |more: &[&str]| {
        let mut arguments = vec!["sim", "reef", "--steps", "2"];
        arguments.extend_from_slice(more);
        refused(&arguments)
    };
    assert!(sim(&["--load-state", &junk]).contains("this is no saved sea"));
    assert!(sim(&["--load-state", &file("missing")]).contains("missing"));
    assert!(sim(&["--replay", &junk]).contains("this is no journal's first line"));
    assert!(sim(&["--plugin-dir", &file("missing")]).contains("there is no such folder"));
    assert!(sim(&["--workers", "0"]).contains("a whole number from 1 to"));
    assert!(sim(&["--record", &file("r.csv"), "--every", "0"]).contains("--every"));
    assert!(sim(&["--record", &file("r.csv"), "--stream", "fibres"]).contains("fibre"));
    assert!(
        sim(&["--record", &file("r.csv"), "--plugin", "nobody"]).contains("this scene has no such plugin")
    );
    for flag in ["--record", "--save-state", "--journal"] {
        let told = sim(&[flag, &file("no/such/folder/out")]);
        assert!(told.contains("cannot be written: there is no folder"), "{flag}: {told}");
    }
    assert!(refused(&["sim", "reef"]).contains("--steps"));
    assert!(refused(&["reef", "sim", "reef", "--steps", "1"]).contains("the scene of a command follows it"));
    assert_eq!(names(folder.path()), ["junk"], "nothing half written is left");
}

#[test]
fn saves_recordings_and_journals_of_the_program_fit_together() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let (state, csv, journal) = (file("state"), file("out.csv"), file("journal"));
    let last = |arguments: &[&str]| {
        let output = reef(arguments);
        assert!(output.status.success(), "{}", text(&output.stderr));
        let told = text(&output.stdout);
        told.lines().last().expect("a hash").to_owned()
    };
    let whole = last(&["sim", "reef", "--steps", "20", "--hash", "--workers", "1", "--journal", &journal]);
    assert!(whole.starts_with("hash ") && whole.len() == 5 + 64, "{whole}");
    last(&["sim", "reef", "--steps", "8", "--save-state", &state, "--workers", "2"]);
    assert_eq!(last(&["sim", "reef", "--steps", "12", "--hash", "--load-state", &state]), whole);
    assert_eq!(
        last(&["sim", "reef", "--steps", "20", "--hash", "--replay", &journal, "--workers", "2"]),
        whole
    );
    last(&["sim", "reef", "--steps", "6", "--record", &csv, "--every", "3"]);
    let csv = fs::read_to_string(csv).expect("the recording");
    let mut lines = csv.lines();
    assert_eq!(lines.next(), Some("step,time,plugin,stream,object,node,x,y,z,radius"));
    let mut steps: Vec<&str> = lines.map(|line| line.split(',').next().unwrap_or_default()).collect();
    steps.dedup();
    assert_eq!(steps, ["0", "3", "6"]);
}

/// Rows of a recording of the last of some steps: plugin, object and node, then place.
fn recorded(scene: &str, steps: u32) -> Vec<([String; 3], [f64; 3])> {
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let (path, csv, steps) = (file("sea.toml"), file("out.csv"), steps.to_string());
    fs::write(&path, scene).expect("a file");
    let output =
        reef(&["sim", &path, "--steps", &steps, "--every", &steps, "--record", &csv, "--stream", "fibre"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let csv = fs::read_to_string(csv).expect("the recording");
    let rows = csv.lines().skip(1).map(|line| line.split(',').collect::<Vec<_>>());
    rows.filter(|row| row[0] == steps)
        .map(|row| {
            let place = [6, 7, 8].map(|at| row[at].parse().expect("a number"));
            ([row[2], row[4], row[5]].map(str::to_owned), place)
        })
        .collect()
}

#[test]
fn what_is_attached_to_an_anemone_moves_all_but_that_anemone() {
    let sea = r#"
[[modules.a.anemones]]
species = "actinia-fragacea"
position = [0.1, -4.0, 0.0]
[[modules.a.anemones]]
species = "actinia-fragacea"
position = [-0.1, -4.0, 0.0]
[[modules.b.fibres]]
position = [0.0, -4.0, 0.1]
[modules.a]
use = "reef.anemone"
[modules.b]
use = "reef.anemone"
"#;
    let flow = "[[flow]]\nkind = \"source\"\nposition = [-0.1, 0.05, 0.0]\nstrength = 0.003\npeak = 0.8\n";
    let attached = |object: u32| format!("attach = {{ module = \"a\", object = {object} }}\n");
    let still = recorded(sea, 60);
    let tentacles = still.iter().filter(|(row, _)| row[0] == "reef.anemone/a" && row[2] == "0").count() / 2;
    for object in [1, 2] {
        let moved = recorded(&format!("{flow}{}{sea}", attached(object)), 60);
        assert_eq!(moved.len(), still.len());
        let mut far = [0.0_f64; 3];
        for ((row, now), (same, rest)) in moved.iter().zip(&still) {
            assert_eq!(row, same);
            let apart = (0..3).map(|axis| (now[axis] - rest[axis]).abs()).fold(0.0, f64::max);
            let number: usize = row[1].parse().expect("a number");
            let who = if row[0] == "reef.anemone/b" { 2 } else { number / tentacles };
            far[who] = far[who].max(apart);
        }
        let own = object as usize - 1;
        assert_eq!(far[own], 0.0, "the anemone does not feel what moves with it");
        assert!(far[1 - own] > 1e-3 && far[2] > 1e-3, "its neighbour and the fibre do: {far:?}");
    }
}

#[test]
fn recorded_fibres_keep_their_lengths_and_end_where_they_break_off() {
    let sea = r#"
[[flow]]
kind = "directional"
direction = [1, 0, 0.3]
speed = 0.2
[modules.a]
use = "reef.anemone"
[[modules.a.fibres]]
break_force = 0.005
[[modules.a.fibres]]
position = [50.0, -4.0, 30.0]
count = [12, 3]
spacing = 0.5
"#;
    let rows = recorded(sea, 60);
    let numbers: std::collections::BTreeSet<usize> =
        rows.iter().map(|(row, _)| row[1].parse().expect("a number")).collect();
    assert_eq!(numbers, (1..=36).collect(), "the first one broke off, and the others keep their numbers");
    assert_eq!(rows.len(), 360);
    for nodes in rows.chunks(10) {
        for pair in nodes.windows(2) {
            let length = (0..3).map(|axis| (pair[1].1[axis] - pair[0].1[axis]).powi(2)).sum::<f64>().sqrt();
            assert!((length / 0.006 - 1.0).abs() < 1e-7, "{length} m");
        }
    }
}

#[test]
fn a_module_at_fault_ends_the_hashes_and_keeps_what_was_recorded() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let (scene, csv, state, journal) = (file("sea.toml"), file("out.csv"), file("state"), file("journal"));
    let sea = "[modules.a]\nuse = 'fixture.faulty'\nfault = 'panic_in_step'\nin_step = 5\n\
               [modules.b]\nuse = 'reef.anemone'\nfibres = [{}]\n";
    fs::write(&scene, sea).expect("a file");
    let plugins = artifacts().folder_of(&["reef_fixture_faulty"]);
    let plugins = plugins.path().to_str().expect("UTF-8");
    let arguments =
        ["sim", &scene, "--steps", "9", "--plugin-dir", plugins, "--record", &csv, "--journal", &journal];
    for more in [["--hash"].as_slice(), &["--save-state", &state]] {
        let output = reef(&[arguments.as_slice(), more].concat());
        let told = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{told}");
        assert!(told.contains("step 5: no hash and no state from here on"), "{told}");
        let csv = fs::read_to_string(&csv).expect("the recording");
        let last = csv.lines().last().and_then(|line| line.split(',').next());
        assert_eq!(last, Some("5"), "the step of the fault is there, too");
        let journal = fs::read_to_string(&journal).expect("the journal");
        assert_eq!(journal.lines().last(), Some("{\"end\":5}"));
        assert!(!PathBuf::from(&state).exists());
    }
    // Nobody asks for hashes: the sea goes on, as it does in the window.
    let output = reef(&arguments);
    assert_eq!(output.status.code(), Some(1), "{}", text(&output.stderr));
    let csv = fs::read_to_string(&csv).expect("the recording");
    assert_eq!(csv.lines().last().and_then(|line| line.split(',').next()), Some("9"));
}

#[test]
fn a_sea_is_the_same_with_any_number_of_workers_and_over_a_save() {
    let folder = tempfile::tempdir().expect("a folder");
    let state = folder.path().join("state").to_str().expect("UTF-8").to_owned();
    let last = |arguments: &[&str]| {
        let output = reef(arguments);
        assert!(output.status.success(), "{}", text(&output.stderr));
        text(&output.stdout).lines().last().expect("a hash").to_owned()
    };
    for scene in
        ["particles-table1", "particles-wake", "seaweed-fig8", "seaweed-shelter", "fish-and-anemones"]
    {
        let whole = last(&["sim", scene, "--steps", "90", "--hash", "--workers", "1"]);
        assert_eq!(last(&["sim", scene, "--steps", "90", "--hash", "--workers", "2"]), whole, "{scene}");
        last(&["sim", scene, "--steps", "50", "--save-state", &state]);
        assert_eq!(
            last(&["sim", scene, "--steps", "40", "--hash", "--load-state", &state]),
            whole,
            "{scene}"
        );
    }
}

#[cfg(unix)]
#[test]
fn paths_that_are_no_utf8_are_answered_and_logs_have_no_colours() {
    use std::{ffi::OsString, os::unix::ffi::OsStringExt};
    let folder = tempfile::tempdir().expect("a folder");
    let odd = |name: &[u8]| folder.path().join(OsString::from_vec(name.to_vec()));
    let plugins = odd(b"plug\xffins");
    fs::create_dir(&plugins).expect("a folder");
    fs::write(plugins.join(OsString::from_vec(b"lib\xfe.so".to_vec())), "no library").expect("a file");
    fs::copy(artifacts().plugin("reef_particles"), plugins.join("libreef_particles.so")).expect("a copy");
    let scene = odd(b"s\xffea.toml");
    fs::write(&scene, "[camera]\nviewport = [16, 16]\n").expect("a file");
    let bad = odd(b"b\xffad.toml");
    fs::write(&bad, "[scene]\nsed = 1\n").expect("a file");
    let library = plugins.join("libreef_particles.so");
    let program = installed().path().join(format!("reef{}", env::consts::EXE_SUFFIX));
    let run = |arguments: &[&std::ffi::OsStr], code: i32| {
        let mut command = Command::new(&program);
        command.args(["--assets".as_ref(), workspace().join("assets").as_os_str()]).args(arguments);
        let output = command.env_remove("REEF_LOG").env_remove("NO_COLOR").output().expect("it runs");
        let told = text(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {told}");
        assert!(!told.contains('\x1b'), "a log file has no colours: {told:?}");
        if arguments.contains(&"--json".as_ref()) {
            serde_json::from_slice::<serde_json::Value>(&output.stdout).expect("JSON");
        }
        told
    };
    let word = |text: &'static str| std::ffi::OsStr::new(text);
    let [json, dir] = [word("--json"), word("--plugin-dir")];
    run(&[word("scene"), word("check"), scene.as_os_str(), bad.as_os_str(), json], 2);
    let told = run(&[word("scene"), word("check"), scene.as_os_str(), dir, plugins.as_os_str(), json], 0);
    assert!(told.contains("WARN") && told.contains("not"), "the file that is no library is told: {told}");
    run(&[word("plugin"), word("list"), dir, plugins.as_os_str(), json], 2);
    run(&[word("plugin"), word("check"), library.as_os_str(), word("--only"), word("entry"), json], 0);
    run(&[word("sim"), scene.as_os_str(), word("--steps"), word("1"), json], 0);
    let weed = plugins.join("weed");
    run(&[word("plugin"), word("new"), weed.as_os_str(), word("--lang"), word("c"), json], 0);
    if cfg!(target_os = "linux") && env::var_os("REEF_REQUIRE").is_some() {
        let picture = odd(b"pic\xffture.png");
        run(&[word("render"), scene.as_os_str(), word("--out"), picture.as_os_str(), json], 0);
        assert!(picture.exists());
    }
}

#[test]
fn a_reader_that_went_away_is_no_error_but_a_full_disk_is() {
    let program = installed().path().join(format!("reef{}", env::consts::EXE_SUFFIX));
    let run = |arguments: &[&str], stdout: Stdio, stderr: Stdio| {
        let mut command = Command::new(&program);
        command.args(["--assets".as_ref(), workspace().join("assets").as_os_str()]).args(arguments);
        command.env_remove("REEF_LOG").stdout(stdout).stderr(stderr).output().expect("the program runs")
    };
    let gone = || Stdio::from(std::io::pipe().expect("a pipe").1);
    for arguments in [
        ["scene", "schema"].as_slice(),
        &["scene", "reference"],
        &["plugin", "list"],
        &["plugin", "list", "--json"],
        &["sim", "reef", "--steps", "3", "--hash"],
        &["--help"],
    ] {
        let output = run(arguments, gone(), Stdio::piped());
        assert!(output.status.success(), "{arguments:?}: {}: {}", output.status, text(&output.stderr));
        assert_eq!(text(&output.stderr), "", "{arguments:?}");
    }
    // Nobody hears the error, and a warning before it; the exit code still says it.
    let bad = tempfile::tempdir().expect("a folder");
    fs::write(
        bad.path().join(format!("{}x{}", env::consts::DLL_PREFIX, env::consts::DLL_SUFFIX)),
        "no library",
    )
    .expect("a file");
    let plugins = bad.path().to_str().expect("UTF-8");
    let output =
        run(&["sim", "no-such-scene", "--steps", "1", "--plugin-dir", plugins], Stdio::piped(), gone());
    assert_eq!(output.status.code(), Some(2));
    if cfg!(target_os = "linux") {
        let full = fs::File::options().write(true).open("/dev/full").expect("/dev/full");
        let output = run(&["scene", "schema"], full.into(), Stdio::piped());
        assert_eq!(output.status.code(), Some(3));
        assert!(
            text(&output.stderr).contains("standard output cannot be written"),
            "{}",
            text(&output.stderr)
        );
    }
}
