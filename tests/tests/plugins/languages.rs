//! One kelp in C, in C++ and in Rust: the same parameters, the same bytes, states that each other reads.

use std::{
    collections::BTreeMap,
    fs,
    path::Path,
    process::{Command, Output},
};

use reef_plugin::{PluginError, StepStatus, envelope::Envelope};
use reef_tests::{
    artifacts::{artifacts, workspace},
    languages::{Built, C, CPP},
    sea::{Sea, config},
};

use crate::load;

/// The kelps in C and C++; None where a compiler is missing.
fn kelps(id: Option<&str>) -> Option<[Built; 2]> {
    Some([C.kelp(id)?, CPP.kelp(id)?])
}

/// The scene of the examples without its modules, and these in their place.
fn scene(modules: &str) -> String {
    let text = fs::read_to_string(workspace().join("sim-plugins/examples/kelp.toml")).unwrap();
    let (sea, _) = text.split_once("[modules.").expect("the scene has modules");
    format!("{sea}{modules}")
}

/// `reef sim` with the plugins of these folders.
fn sim(scene: &Path, folders: &[&Path], arguments: &[&str]) -> Output {
    let mut command = Command::new(artifacts().reef());
    command.arg("sim").arg(scene).args(arguments).arg("--assets").arg(workspace().join("assets"));
    for folder in folders {
        command.arg("--plugin-dir").arg(folder);
    }
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    output
}

#[test]
fn the_three_kelps_have_the_same_parameters() {
    let Some(built) = kelps(None) else { return };
    let rust = load(artifacts().plugin("reef_example_rust"), 1);
    assert_eq!(rust.info().params.len(), 6);
    for (language, built) in [C, CPP].iter().zip(&built) {
        let plugin = load(&built.library(), 1);
        let info = plugin.info();
        assert_eq!(info.id, format!("example.kelp-{}", language.folder));
        let described = |params| format!("{params:#?}");
        assert_eq!(described(&info.params), described(&rust.info().params));
        assert_eq!((info.state_version, info.state_min_version), (1, 1));
    }
}

#[test]
fn side_by_side_in_one_scene_c_cpp_and_rust_record_the_same_bytes() {
    let Some([c, cpp]) = kelps(None) else { return };
    let rust = artifacts().folder_of(&["reef_example_rust"]);
    let modules: Vec<String> = ["c", "cpp", "rust"]
        .map(|language| {
            format!(
                "[modules.{language}]\nuse = \"example.kelp-{language}\"\n\
                 params = {{ count = 20, x = 0.5, z = -1.0, stiffness = 0.7 }}\n"
            )
        })
        .into();
    let file = c.root().join("same.toml");
    fs::write(&file, scene(&modules.concat())).unwrap();
    let record = c.root().join("same.csv");
    let arguments =
        ["--steps", "240", "--every", "12", "--stream", "fibre", "--record", record.to_str().unwrap()];
    sim(&file, &[c.folder(), cpp.folder(), rust.path()], &arguments);

    let text = fs::read_to_string(&record).unwrap();
    let mut rows: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    for line in text.lines().skip(1) {
        let mut cells: Vec<&str> = line.split(',').collect();
        rows.entry(cells.remove(2)).or_default().push(cells.join(","));
    }
    let names: Vec<&&str> = rows.keys().collect();
    assert_eq!(names, [&"example.kelp-c", &"example.kelp-cpp", &"example.kelp-rust"]);
    let rust = &rows["example.kelp-rust"];
    // Steps 0, 12 … 240; 20 stalks of 17 nodes and 15 blades of 6.
    assert_eq!(rust.len(), 21 * 20 * (17 + 15 * 6));
    for other in ["example.kelp-c", "example.kelp-cpp"] {
        let difference = rows[other].iter().zip(rust).find(|(a, b)| a != b);
        assert_eq!(difference, None, "{other} (step,time,stream,object,node,x,y,z,radius)");
        assert_eq!(rows[other].len(), rust.len());
    }
    let tip =
        |step: &str| rust.iter().find(|row| row.starts_with(step) && row.contains(",fibre,0,16,")).unwrap();
    let x = |row: &String| row.split(',').nth(5).unwrap().parse::<f64>().unwrap();
    assert!((x(tip("240,")) - x(tip("0,"))).abs() > 0.02, "it moves: {} {}", tip("0,"), tip("240,"));
}

#[test]
fn under_one_id_all_three_have_one_hash_over_streams_and_states_and_read_each_others_states() {
    let Some([c, cpp]) = kelps(Some("example.kelp-rust")) else { return };
    let rust = artifacts().folder_of(&["reef_example_rust"]);
    let file = c.root().join("one.toml");
    let module = "[modules.kelp]\nuse = \"example.kelp-rust\"\nparams = { count = 30, delay = 0.3 }\n";
    fs::write(&file, scene(module)).unwrap();
    let hashes = |folder: &Path, arguments: &[&str]| -> Vec<String> {
        let output = sim(&file, &[folder], &[&["--hash", "--json"], arguments].concat());
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        json["hashes"].as_array().unwrap().iter().map(|hash| hash.as_str().unwrap().to_owned()).collect()
    };
    let straight = hashes(rust.path(), &["--steps", "120", "--workers", "1"]);
    assert_eq!(straight.len(), 120);
    assert_ne!(straight[0], straight[119]);
    assert_eq!(straight, hashes(c.folder(), &["--steps", "120", "--workers", "2"]), "C");
    assert_eq!(straight, hashes(cpp.folder(), &["--steps", "120", "--workers", "3"]), "C++");

    // 40 steps in each language, handed on as saved states.
    let state = |name: &str| c.root().join(name).to_str().unwrap().to_owned();
    let (first, second) = (state("first"), state("second"));
    let mut handed = hashes(c.folder(), &["--steps", "40", "--save-state", &first]);
    handed.extend(hashes(rust.path(), &["--steps", "40", "--load-state", &first, "--save-state", &second]));
    handed.extend(hashes(cpp.folder(), &["--steps", "40", "--load-state", &second]));
    assert_eq!(straight, handed);
}

#[test]
fn a_state_that_is_refused_leaves_the_kelp_as_it_was() {
    let Some(built) = kelps(None) else { return };
    for (language, built) in [C, CPP].iter().zip(&built) {
        let mut instance = load(&built.library(), 1).create(&config("{}")).unwrap();
        assert_eq!(instance.step(&Sea::default().input(1), &[]).status, StepStatus::Ok);
        let before = instance.save().unwrap();
        let id = format!("example.kelp-{}", language.folder);
        let mut refuse = |state_version: u32, payload: &[u8]| {
            let forged = Envelope { plugin: &id, state_version, payload }.seal();
            let error = instance.load(&forged).unwrap_err();
            assert_eq!(instance.save().unwrap(), before, "{}: {error}", language.name);
            error
        };
        let whole = Envelope::open(&before).unwrap().payload.to_vec();
        // Cut at every eighth byte: in the head, in the fields' heads, in their values.
        for length in
            (0..whole.len()).step_by(if whole.len() > 4096 { 40 } else { 8 }).chain([whole.len() - 1])
        {
            let error = refuse(1, &whole[..length]);
            assert!(matches!(&error, PluginError::State { message, .. } if !message.is_empty()), "{error}");
        }
        let longer = [&whole[..], b"more"].concat();
        assert!(refuse(1, &longer).to_string().contains("bytes follow the state's end"));
        let mut other = whole.clone();
        other[16..24].copy_from_slice(&0_u64.to_le_bytes());
        assert!(refuse(1, &other).to_string().contains("lacks"), "another tag in place of the first field's");
        let mut huge = whole.clone();
        huge[32..40].copy_from_slice(&u64::MAX.to_le_bytes());
        refuse(1, &huge);
        assert!(refuse(2, &whole).to_string().contains("reads 1 to 1"));
        instance.load(&before).unwrap();
        instance.reset().unwrap();
        assert_eq!(instance.param(1).unwrap(), 12.0);
    }
}
