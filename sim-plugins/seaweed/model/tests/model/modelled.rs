//! Plants from files of a modelling program: what Blender's exporter wrote, and what is broken.

use std::{path::PathBuf, process::Command};

use glam::{DVec2, DVec3, Vec3};
use reef_flow::random::Random;
use reef_seaweed_model::{
    bed::{Bed, Kind},
    modelled::{Model, Unmodelled},
    skeleton::Skeleton,
    species::{JointTable, Species, Tissue},
};
use serde_json::{Value, json};

use crate::{common::*, species_table::species};

/// The file that Blender's exporter wrote.
fn blender() -> Vec<u8> {
    files("sea-palm.glb").expect("it is committed")
}

/// A file's JSON and its buffer.
fn parts(bytes: &[u8]) -> (Value, Vec<u8>) {
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four")) as usize;
    let json = 20..20 + word(12);
    (serde_json::from_slice(&bytes[json.clone()]).expect("JSON"), bytes[json.end + 8..].to_vec())
}

/// A file of them.
fn file(json: &str, bin: &[u8]) -> Vec<u8> {
    let padded = |bytes: &[u8], with: u8| {
        let mut bytes = bytes.to_vec();
        bytes.resize(bytes.len().next_multiple_of(4), with);
        bytes
    };
    let (json, bin) = (padded(json.as_bytes(), b' '), padded(bin, 0));
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend((28 + json.len() as u32 + bin.len() as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &bin)] {
        bytes.extend((chunk.len() as u32).to_le_bytes());
        bytes.extend(kind);
        bytes.extend(chunk.as_slice());
    }
    bytes
}

/// A species that takes everything as it comes.
fn any() -> Species {
    Species { skeleton: "plant.glb".into(), ..Species::default() }
}

fn refusal(bytes: &[u8], species: &Species) -> String {
    match Model::read(bytes, species).map(|_| ()) {
        Err(Unmodelled::File(fault)) => fault.to_string(),
        Err(Unmodelled::Table(key, problem)) => format!("{key}: {problem}"),
        Ok(()) => "nothing is wrong".to_owned(),
    }
}

/// Of the file that Blender wrote, changed.
fn changed(change: impl FnOnce(&mut Value, &mut Vec<u8>)) -> String {
    let (mut json, mut bin) = parts(&blender());
    change(&mut json, &mut bin);
    refusal(&file(&json.to_string(), &bin), &any())
}

/// The plant, and its skeleton.
fn sea_palm(species: &Species) -> (Model, Skeleton) {
    let (model, segments) = Model::read(&blender(), species).expect("a plant");
    (model, skeleton(&segments))
}

#[test]
fn joints_stand_at_rest_where_blender_shows_them() {
    let (model, skeleton) = sea_palm(&species("sea-palm"));
    assert_eq!(model.bones.len(), 4 + 8 * 3);
    assert_eq!(model.bones.len(), model.moving.len());
    let rest = skeleton.rest();
    for (bone, segment) in model.bones.iter().zip(&model.moving) {
        let (origin, turn) = rest[*segment];
        let first = origin - turn * DVec3::Y * (0.1 * bone.length);
        assert!(first.distance(bone.origin) < 1e-6, "{}: {first} for {}", bone.name, bone.origin);
        assert!((turn * DVec3::Y).distance(bone.up) < 1e-6, "{} points elsewhere", bone.name);
    }
    // 62 cm of stipe in metres and upright, though the armature is at half its size, moved and turned.
    let named = |name: &str| model.bones.iter().find(|bone| bone.name == name).expect("it is there");
    let top = named("stipe.3");
    let end = top.origin + top.up * top.length;
    assert!(end.distance(DVec3::new(0.0162 * 0.5_f64.cos(), 0.62, -0.0162 * 0.5_f64.sin())) < 1e-3, "{end}");
    assert_eq!((named("blade.5.2").depth, named("stipe.0").origin), (6, DVec3::ZERO));
    // Blades end where their mesh does.
    assert!((named("blade.0.2").length - named("blade.0.1").length).abs() < 0.01);
}

#[test]
fn the_mesh_at_rest_is_what_blender_shows() {
    let (model, _) = sea_palm(&any());
    let (json, _) = parts(&blender());
    // Blender writes the extent of a mesh that it moved to the world, and where the root joint stands there.
    let bounds = |key: &str| -> Vec<f64> {
        json["accessors"][0][key].as_array().expect("bounds").iter().filter_map(Value::as_f64).collect()
    };
    let extent: DVec3 = DVec3::from_slice(&bounds("max")) - DVec3::from_slice(&bounds("min"));
    let places = model.skin.corners.iter().map(|corner| corner.place);
    let (low, high) = places.fold((DVec3::MAX, DVec3::MIN), |(low, high), p| (low.min(p), high.max(p)));
    assert!((high - low).distance(extent) < 1e-5, "{} for {extent}", high - low);
    assert!(low.y > -0.2 && low.y < 0.01 && high.y > 0.7, "{low} {high}");
    for corner in &model.skin.corners {
        assert!((corner.weights.iter().sum::<f64>() - 1.0).abs() < 1e-6);
        assert!((corner.normal.length() - 1.0).abs() < 1e-6, "{corner:?}");
    }
}

#[test]
fn a_modelled_plant_leans_with_the_current_in_any_azimuth() {
    let species = species("sea-palm");
    let mut leans = Vec::new();
    for i in 0..8 {
        let (_, skeleton) = sea_palm(&species);
        let mut bed = Bed::new(vec![Kind::new(skeleton, 0.4, 0.0)], vec![plant(PLACE)]);
        let middle = |bed: &mut Bed| {
            let nodes = nodes(bed, 0);
            nodes.iter().copied().sum::<DVec3>() / nodes.len() as f64
        };
        let before = middle(&mut bed);
        let (sin, cos) = (f64::from(i) * core::f64::consts::FRAC_PI_4).sin_cos();
        let way = DVec3::new(cos, 0.0, sin);
        run(&mut bed, &[current(way * 0.2)], DT, 600);
        let moved = middle(&mut bed) - before;
        let flat = DVec3::new(moved.x, 0.0, moved.z);
        assert!(flat.normalize().dot(way) > 0.96, "{moved} for {way}");
        leans.push(flat.length());
    }
    let (least, most) = leans.iter().fold((f64::MAX, 0.0_f64), |(l, m), x| (l.min(*x), m.max(*x)));
    assert!(least > 0.01 && least / most > 0.6, "{leans:?}");
}

#[test]
fn tables_of_joints_say_what_they_are_made_of() {
    let heavy = Tissue { mass: 7.0, added_mass: 0.0, ..Tissue::default() };
    let table = |name: &str, depth: [u32; 2]| JointTable {
        name: name.into(),
        depth,
        tissue: heavy.clone(),
        bladder: 0.0,
    };
    let mass = |joints: Vec<JointTable>| sea_palm(&Species { joints, ..any() }).1.mass();
    let (plain, blades) = (mass(Vec::new()), mass(vec![table("blade.*", [0, 255])]));
    let (ends, first) = (mass(vec![table("*", [6, 6])]), mass(vec![table("stipe.0", [0, 9])]));
    // 6.9 kg/m more over eight blades of about half a metre, over the last third of them, and over 15.5 cm.
    assert!(blades - plain > 3.0 * (ends - plain) * 0.9 && ends > plain + 5.0, "{plain} {blades} {ends}");
    assert!((first - plain - 5.9 * 0.155).abs() < 0.02, "{first} {plain}");
    let bladder = JointTable { bladder: 0.5, ..JointTable::default() };
    let lift = |joints: Vec<JointTable>| -> f64 {
        sea_palm(&Species { joints, ..any() }).1.segments().iter().map(|segment| segment.lift).sum()
    };
    assert!((lift(vec![bladder]) - lift(Vec::new()) - 0.5 * 28.0).abs() < 1e-9);
    let text = refusal(&blender(), &Species { joints: vec![table("leef*", [0, 9])], ..any() });
    assert!(
        text.starts_with("joints[0]: is of no joint of the file, whose names are stipe.0, stipe.1"),
        "{text}"
    );
}

#[test]
fn joints_without_a_mesh_get_one_along_their_bones() {
    let (mut json, _) = parts(&blender());
    let nodes = json["nodes"].as_array_mut().expect("nodes");
    let skinned = nodes.iter_mut().find(|node| node["mesh"].is_number()).expect("a mesh");
    *skinned = json!({"name": "a lamp"});
    for key in ["meshes", "skins", "accessors", "bufferViews", "buffers"] {
        json.as_object_mut().expect("an object").remove(key);
    }
    // Without a skin all nodes below the armature are joints: take the empty one away from there.
    let lamp = json["nodes"].as_array().expect("nodes").iter().position(|node| node["name"] == "a lamp");
    for node in json["nodes"].as_array_mut().expect("nodes") {
        if let Some(children) = node["children"].as_array_mut() {
            children.retain(|child| child.as_u64() != lamp.map(|lamp| lamp as u64));
        }
    }
    let (model, _) = Model::read(&file(&json.to_string(), &[]), &any()).expect("a plant");
    assert_eq!(model.bones.len(), 28);
    assert!(model.skin.indices.len() > 28 * 3 * 2);
    let off = |corner: &reef_seaweed_model::modelled::Corner| {
        let bone = &model.bones[corner.bones[0]];
        let way = corner.place - bone.origin;
        (way - bone.up * way.dot(bone.up)).length()
    };
    let widest = model.skin.corners.iter().map(off).fold(0.0, f64::max);
    assert!((widest - 0.025).abs() < 1e-6, "as wide as its tissue, {widest}");
    // Its ribbons show the whole picture: from edge to edge, and from the root to the tips.
    let uvs: Vec<DVec2> = model.skin.corners.iter().filter_map(|corner| corner.uv).collect();
    assert_eq!(uvs.len(), model.skin.corners.len());
    let (low, high) = uvs.iter().fold((DVec2::MAX, DVec2::MIN), |(l, h), uv| (l.min(*uv), h.max(*uv)));
    assert_eq!((low, high), (DVec2::ZERO, DVec2::ONE));
}

#[test]
fn broken_files_are_refused_with_the_place_in_their_json() {
    let whole = blender();
    let of = |bytes: &[u8]| refusal(bytes, &any());
    assert!(of(b"").starts_with("is no binary glTF"), "{}", of(b""));
    assert!(of(b"{\"asset\": {}}").starts_with("is no binary glTF"));
    assert!(of(&whole[..whole.len() - 4]).starts_with("is cut off"), "{}", of(&whole[..whole.len() - 4]));
    assert!(of(&[b"glTF\x01\0\0\0" as &[u8], &whole[8..]].concat()).contains("version 1"));
    assert!(of(&file("{", &[])).starts_with("its JSON is wrong: "), "{}", of(&file("{", &[])));
    let many = format!("{{\"asset\":{{\"version\":\"2.0\"}},\"nodes\":[{}{{}}]}}", "{},".repeat(10_000_000));
    assert_eq!(
        of(&file(&many, &[])),
        "has 30000039 bytes; at most 16777216 are allowed"
            .replace("30000039", &file(&many, &[]).len().to_string())
    );
    let some = format!("{{\"asset\":{{\"version\":\"2.0\"}},\"nodes\":[{}{{}}]}}", "{},".repeat(400_000));
    assert!(of(&file(&some, &[])).contains("bytes of JSON; at most 1048576 are allowed"));
    assert!(of(&file("{\"asset\":{\"version\":\"2.0\"}}", &[])).starts_with("has no joints"));
    let expected: [(&str, String); 18] = [
        (
            "extensionsRequired[0]: needs `KHR_draco",
            changed(|json, _| json["extensionsRequired"] = json!(["KHR_draco_mesh_compression"])),
        ),
        ("skins[0].joints[3]: ", changed(|json, _| json["skins"][0]["joints"][3] = json!(4000))),
        (
            "skins[0].joints[3]: is nodes[",
            changed(|json, _| json["skins"][0]["joints"][3] = json["skins"][0]["joints"][2].clone()),
        ),
        (
            "nodes[2].children[0]: is a child of nodes[1] already",
            changed(|json, _| json["nodes"][2]["children"] = json!([0])),
        ),
        (
            "nodes[24].children[0]: is a child of nodes[0] already",
            changed(|json, _| json["nodes"][0]["children"] = json!([2])),
        ),
        (
            "nodes[28]: stands on itself",
            changed(|json, _| {
                json["nodes"].as_array_mut().expect("nodes").retain(|node| node["mesh"].is_null());
                let count = json["nodes"].as_array().expect("nodes").len();
                assert_eq!(count, 29, "the armature is the last one");
                json.as_object_mut().expect("an object").remove("scenes");
                json.as_object_mut().expect("an object").remove("scene");
                json["nodes"][28]["children"] = json!([28]);
            }),
        ),
        (
            "nodes[0].rotation: must be a unit quaternion",
            changed(|json, _| json["nodes"][0]["rotation"] = json!([0.0, 0.0, 0.0, 0.0])),
        ),
        (
            "nodes[0].scale: leaves its Y axis no length",
            changed(|json, _| json["nodes"][0]["scale"] = json!([1.0, 0.0, 1.0])),
        ),
        (
            "nodes[0]: stands farther than",
            changed(|json, _| json["nodes"][0]["translation"] = json!([1e30, 0.0, 0.0])),
        ),
        (
            "accessors[0].count: is 9000000000",
            changed(|json, _| json["accessors"][0]["count"] = json!(9_000_000_000_u64)),
        ),
        ("accessors[0]: reaches beyond", changed(|json, _| json["accessors"][0]["count"] = json!(15_000))),
        (
            "accessors[0]: reaches beyond",
            changed(|json, _| json["accessors"][0]["byteOffset"] = json!(u64::MAX)),
        ),
        (
            "bufferViews[0]: reaches beyond",
            changed(|json, _| json["bufferViews"][0]["byteLength"] = json!(1_u64 << 40)),
        ),
        ("bufferViews[7]: reaches beyond", changed(|_, bin| bin.truncate(bin.len() - 16))),
        (
            "buffers[0].uri: lies in another file",
            changed(|json, _| json["buffers"][0]["uri"] = json!("../../etc/passwd")),
        ),
        (
            "meshes[0].primitives[0].mode: must be triangles",
            changed(|json, _| json["meshes"][0]["primitives"][0]["mode"] = json!(1)),
        ),
        (
            "meshes[0].primitives[0].attributes.WEIGHTS_0: is missing",
            changed(|json, _| {
                json["meshes"][0]["primitives"][0]["attributes"]
                    .as_object_mut()
                    .expect("attributes")
                    .remove("WEIGHTS_0");
            }),
        ),
        (
            "accessors[1].type: must be one of",
            changed(|json, _| json["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"] = json!(1)),
        ),
    ];
    for (beginning, told) in expected {
        assert!(told.starts_with(beginning), "{told}\nfor {beginning}");
    }
}

#[test]
fn weights_and_joints_that_make_no_sense_are_refused_by_their_vertex() {
    let place = |json: &Value, semantic: &str| {
        let accessor = json["meshes"][0]["primitives"][0]["attributes"][semantic].as_u64().expect("a number");
        let view = json["accessors"][accessor as usize]["bufferView"].as_u64().expect("a number");
        json["bufferViews"][view as usize]["byteOffset"].as_u64().unwrap_or(0) as usize
    };
    let told = changed(|json, bin| {
        let at = place(json, "WEIGHTS_0") + 16 * 5;
        bin[at..at + 4].copy_from_slice(&0.25_f32.to_le_bytes());
    });
    assert!(told.contains("attributes.WEIGHTS_0: of vertex 5 sum to"), "{told}");
    let told = changed(|json, bin| {
        let at = place(json, "WEIGHTS_0") + 16 * 5;
        bin[at..at + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    });
    assert!(told.contains("has NaN in element 5"), "{told}");
    let told = changed(|json, bin| {
        let at = place(json, "JOINTS_0") + 4 * 7;
        bin[at..at + 4].copy_from_slice(&[200; 4]);
    });
    assert!(told.contains("attributes.JOINTS_0: of vertex 7 has 200; the skin has 28 joints"), "{told}");
    let told = changed(|json, bin| {
        let at = json["meshes"][0]["primitives"][0]["indices"].as_u64().expect("a number") as usize;
        let view = json["accessors"][at]["bufferView"].as_u64().expect("a number") as usize;
        let at = json["bufferViews"][view]["byteOffset"].as_u64().expect("a number") as usize;
        bin[at..at + 2].copy_from_slice(&60_000_u16.to_le_bytes());
    });
    assert!(told.contains("indices: name vertex 60000 of"), "{told}");
}

#[test]
fn a_second_root_is_told_with_what_blender_makes_it_of() {
    let told = changed(|json, _| {
        let count = json["nodes"].as_array().expect("nodes").len();
        json["nodes"].as_array_mut().expect("nodes").push(json!({"name": "neutral_bone"}));
        json["skins"][0]["joints"].as_array_mut().expect("joints").push(json!(count));
    });
    assert!(
        told.starts_with("skins[0].joints[28]: `neutral_bone` stands on no other joint, as `stipe.0` does"),
        "{told}"
    );
}

/// How many files with other bytes are read: more with REEF_FUZZ=COUNT.
fn tries() -> u64 {
    std::env::var("REEF_FUZZ").ok().and_then(|count| count.parse().ok()).unwrap_or(3_000)
}

#[test]
fn whatever_the_bytes_are_a_plant_or_one_error_comes_of_them() {
    let whole = blender();
    let text = 20 + parts(&whole).0.to_string().len();
    let (mut read, mut refused) = (0, 0);
    for seed in 0..tries() {
        let mut random = Random::new(seed, 0xf022);
        let mut bytes = whole.clone();
        for _ in 0..1 + random.bits() % 6 {
            // Most of them in the JSON: there is most to get wrong.
            let end = if random.unit() < 0.8 { text.min(bytes.len()) } else { bytes.len() };
            let at = (random.unit() * end as f64) as usize;
            let digit = b"0123456789-e.,]}[{\"null"[(random.bits() % 22) as usize];
            match random.bits() % 4 {
                0 => bytes[at] = random.bits() as u8,
                1 => bytes[at] ^= 1 << (random.bits() % 8),
                2 => bytes[at] = digit,
                _ => bytes.truncate(if random.unit() < 0.1 { at } else { bytes.len() }),
            }
            if bytes.is_empty() {
                break;
            }
        }
        match Model::read(&bytes, &any()) {
            Ok((model, segments)) => {
                read += 1;
                if let Ok(skeleton) = Skeleton::new(&segments) {
                    assert!(skeleton.rest().iter().all(|(origin, _)| origin.is_finite()), "seed {seed}");
                }
                assert!(model.skin.corners.iter().all(|corner| corner.place.is_finite()), "seed {seed}");
            }
            Err(Unmodelled::File(fault)) => {
                refused += 1;
                assert!(!fault.problem.is_empty() && fault.to_string().len() < 600, "seed {seed}: {fault}");
            }
            Err(other) => panic!("seed {seed}: {other:?}"),
        }
    }
    println!("{read} read, {refused} refused");
    assert!(read > tries() / 50 && refused > tries() / 10, "{read} read, {refused} refused");
}

/// Blender's own exporter, where `python3` has it (`pip install bpy`): today's writes what is committed.
#[test]
fn what_blender_writes_today_is_the_same_plant() {
    let found = Command::new("python3").args(["-c", "import bpy"]).output();
    if !found.is_ok_and(|found| found.status.success()) {
        println!("skipped: python3 has no bpy");
        return;
    }
    let out = std::env::temp_dir().join(format!("reef-sea-palm-{}.glb", std::process::id()));
    let script = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../tools/blender/sea_palm.py");
    let run = Command::new("python3").arg(script).arg(&out).output().expect("it starts");
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let bytes = std::fs::read(&out).expect("it was written");
    let _ = std::fs::remove_file(&out);
    let (now, _) = Model::read(&bytes, &any()).expect("a plant");
    let (then, _) = sea_palm(&any());
    assert_eq!(now.skin.indices, then.skin.indices);
    assert_eq!([now.bones.len(), now.skin.corners.len()], [then.bones.len(), then.skin.corners.len()]);
    for (a, b) in now.bones.iter().zip(&then.bones) {
        assert!(a.name == b.name && a.origin.distance(b.origin) < 1e-5, "{a:?}\n{b:?}");
    }
    let place = |model: &Model| -> Vec<Vec3> {
        model.skin.corners.iter().map(|corner| corner.place.as_vec3()).collect()
    };
    assert!(place(&now).iter().zip(place(&then)).all(|(a, b)| a.distance(b) < 1e-4));
}
