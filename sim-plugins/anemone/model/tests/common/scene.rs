//! Scenes and species from assets, read as the host reads them (without its checks).
#![allow(dead_code, reason = "each test crate uses its part")]

use std::path::PathBuf;

use glam::DVec3;
use reef_anemone_model::{
    Anemones,
    bed::{Bed, Settings, Surroundings},
    config::Config,
    species::Species,
};
use reef_flow::Level;
use reef_sdk::{SceneInfo, abi::Flow};
use serde_json::{Map, Value};

/// The folder `assets`.
pub fn assets() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../assets")
}

/// A TOML file as JSON.
pub fn toml(path: &str) -> Map<String, Value> {
    let text = std::fs::read_to_string(assets().join(path)).unwrap_or_else(|e| panic!("{path}: {e}"));
    toml::from_str(&text).unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// Keys of `over` on top of those of `under`, tables merged.
fn merge(under: &mut Map<String, Value>, over: Map<String, Value>) {
    for (key, value) in over {
        match (under.get_mut(&key), value) {
            (Some(Value::Object(under)), Value::Object(over)) => merge(under, over),
            (_, value) => drop(under.insert(key, value)),
        }
    }
}

/// A species with what it builds on: of the scene, or a file.
pub fn species_table(name: &str, scene: &Map<String, Value>) -> Map<String, Value> {
    let own = scene.get("species").and_then(|all| all.get(name)).and_then(Value::as_object).cloned();
    let mut own = own.unwrap_or_else(|| toml(&format!("species/{name}.toml")));
    match own.remove("base") {
        Some(Value::String(base)) => {
            let mut table = species_table(&base, scene);
            merge(&mut table, own);
            table
        }
        _ => own,
    }
}

/// A species file.
pub fn species(name: &str) -> Species {
    serde_json::from_value(Value::Object(species_table(name, &Map::new())))
        .unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// All species of anemones and seagrasses in assets. What stands on a `stem` is a seaweed, what has a `body`
/// a fish, what has a `bell` a jellyfish.
pub fn species_names() -> Vec<String> {
    let mut names = reef_model_tests::species::names(|_| true);
    names.retain(|name| {
        let table = species_table(name, &Map::new());
        !["stem", "body", "bell"].iter().any(|key| table.contains_key(*key))
    });
    names
}

fn names_in(value: &Value, found: &mut Vec<String>) {
    match value {
        Value::Object(map) => {
            for (key, value) in map {
                if key == "species" {
                    match value {
                        Value::String(name) => found.push(name.clone()),
                        Value::Array(names) => {
                            found.extend(names.iter().filter_map(Value::as_str).map(str::to_owned));
                        }
                        _ => {}
                    }
                }
                names_in(value, found);
            }
        }
        Value::Array(values) => values.iter().for_each(|value| names_in(value, found)),
        _ => {}
    }
}

/// The first module of a scene file, as the plugin gets it.
pub fn module(path: &str) -> (SceneInfo, Config) {
    let file = toml(path);
    let mut config = file["modules"].as_object().expect("modules").values().next().expect("one").clone();
    let table = config.as_object_mut().expect("a table");
    table.remove("use");
    table.remove("params");
    let mut names = Vec::new();
    names_in(&config, &mut names);
    let species = names.into_iter().map(|name| {
        let table = Value::Object(species_table(&name, &file));
        (name, table)
    });
    let scene = &file["scene"];
    let info = SceneInfo {
        name: path.to_owned(),
        seed: scene["seed"].as_u64().unwrap_or(1),
        scale: scene["scale"].as_f64().unwrap_or(1.0),
        dt: 1.0 / 60.0,
        species: species.collect(),
    };
    let mut config = serde_json::from_value(config).unwrap_or_else(|e| panic!("{path}: {e}"));
    in_metres(&mut config, info.scale);
    (info, config)
}

/// All lengths of a configuration in metres, as the host hands it over.
fn in_metres(config: &mut Config, scale: f64) {
    let Config { anemones, scatter, fibres, tufts } = config;
    let mut all: Vec<&mut f64> = Vec::new();
    anemones.iter_mut().for_each(|a| all.extend(&mut a.position));
    for s in scatter {
        all.extend(s.center.iter_mut().chain(&mut s.size).chain([&mut s.spacing]));
    }
    for f in fibres {
        all.extend(f.position.iter_mut().chain(&mut f.radius).chain([&mut f.spacing, &mut f.length]));
    }
    for t in tufts {
        all.extend(t.position.iter_mut().chain(&mut t.radius).chain([&mut t.length, &mut t.spread]));
    }
    all.into_iter().for_each(|length| *length *= scale);
}

/// The plants of a scene file.
pub fn bed(path: &str) -> Bed {
    let (scene, config) = module(path);
    grow(&scene, &config)
}

/// The plants of a configuration.
pub fn grow(scene: &SceneInfo, config: &Config) -> Bed {
    Anemones::plant(scene, config).unwrap_or_else(|e| panic!("{e}")).0
}

/// Steps a bed and returns its nodes.
pub fn run(bed: &mut Bed, flow: &[Flow], dt: f64, steps: usize) -> Vec<[f32; 4]> {
    run_at(bed, flow, dt, steps, Level::best())
}

/// As [`run`], with an instruction set.
pub fn run_at(bed: &mut Bed, flow: &[Flow], dt: f64, steps: usize, level: Level) -> Vec<[f32; 4]> {
    let mut nodes = vec![[0.0; 4]; bed.node_count()];
    for _ in 0..steps {
        let around = Surroundings { flow, dt, level, ..Surroundings::default() };
        bed.step(&around, &Settings::default(), &mut nodes);
    }
    nodes
}

/// World positions of the tips of all fibres, feet included.
pub fn tips(bed: &Bed) -> Vec<DVec3> {
    let mut tips: Vec<DVec3> = Vec::new();
    for node in bed.trace() {
        let (object, position) = (node.object as usize, DVec3::from(node.position));
        if tips.len() <= object { tips.push(position) } else { tips[object] = position }
    }
    tips
}
