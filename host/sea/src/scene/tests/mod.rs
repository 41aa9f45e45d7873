//! Good scenes: what they keep, and the units that they count in; bad ones, in [`faults`].

use std::fs;

use reef_plugin::ParamKind;

use super::*;

mod faults;

/// A catalogue with one plugin, like the real ones.
struct Fake;

impl Catalogue for Fake {
    fn plugin(&self, id: &str) -> Result<Option<PluginInfo>, String> {
        if id == "reef.broken" {
            return Err("it is for another machine".to_owned());
        }
        if id != "reef.weed" {
            return Ok(None);
        }
        let schema = json!({
            "type": "object",
            "properties": {
                "plants": { "type": "array", "maxItems": 100, "items": { "$ref": "#/$defs/Plant" } },
                "shape": { "oneOf": [
                    { "type": "object", "properties": { "kind": { "const": "round" }, "radius": { "type": "number" } }, "required": ["kind", "radius"], "additionalProperties": false },
                    { "type": "object", "properties": { "kind": { "const": "flat" } }, "required": ["kind"], "additionalProperties": false },
                ] },
            },
            "additionalProperties": false,
            "x-species": { "$ref": "#/$defs/Species" },
            "$defs": {
                "Plant": {
                    "type": "object",
                    "properties": {
                        "species": { "type": "string" },
                        "nodes": { "type": "integer", "minimum": 2, "maximum": 64 },
                        "stiffness": { "type": "number", "exclusiveMinimum": 0.0, "x-unit": "N/m" },
                        "height": { "type": "number", "minimum": 0.0, "maximum": 2.0, "default": 0.5, "x-unit": "m" },
                        "thickness": { "type": "number", "minimum": 0.0, "maximum": 0.3, "x-unit": "m" },
                    },
                    "required": ["species"],
                    "additionalProperties": false,
                },
                "Species": {
                    "type": "object",
                    "properties": {
                        "length": { "type": "number", "minimum": 0.0 },
                        "height": { "type": "number", "default": 0.5, "x-unit": "m" },
                        "width": { "type": "number", "default": 0.5, "x-unit": "m" },
                        "look": { "type": "object" },
                    },
                    "required": ["length"],
                    "additionalProperties": false,
                },
            },
        });
        let param = |id, key: &str, kind| ParamInfo {
            id,
            key: key.to_owned(),
            kind,
            maximum: 2.0,
            default: 1.0,
            ..ParamInfo::default()
        };
        let choices = vec!["low".to_owned(), "high".to_owned()];
        let reach = param(4, "reach", ParamKind::Float);
        let params = vec![
            param(1, "sway", ParamKind::Float),
            param(2, "on", ParamKind::Switch),
            ParamInfo { choices, ..param(3, "level", ParamKind::Choice) },
            ParamInfo { unit: "m".to_owned(), minimum: 0.01, ..reach },
        ];
        Ok(Some(PluginInfo { config_schema: Some(schema), params, ..PluginInfo::default() }))
    }

    fn ids(&self) -> Vec<String> {
        vec!["reef.weed".to_owned()]
    }
}

struct Place(tempfile::TempDir);

impl Place {
    fn new(species: &[(&str, &str)]) -> Self {
        let place = tempfile::tempdir().expect("a temporary folder");
        fs::create_dir(place.path().join("species")).expect("a folder");
        for (name, text) in species {
            fs::write(place.path().join("species").join(format!("{name}.toml")), text).expect("a file");
        }
        Self(place)
    }

    fn load(&self, text: impl AsRef<[u8]>) -> Result<Scene, SceneError> {
        let path = self.0.path().join("scene.toml");
        fs::write(&path, text).expect("a file");
        load(&path, self.0.path(), &Fake)
    }

    /// The error without the folder's name: "scene.toml:3:5: key: problem".
    fn error(&self, text: impl AsRef<[u8]>) -> (String, Option<String>) {
        let error = self.load(text).expect_err("the scene must be refused");
        assert_eq!(error.count(), 1, "one fault, one error: {error}");
        let told = error.to_string().replace(&format!("{}/", self.0.path().display()), "");
        (told, error.help_text().map(str::to_owned))
    }
}

const KELP: (&str, &str) = ("kelp", "length = 2.0\nlook = { hue = 1, shine = 2 }\n");

#[test]
fn a_good_scene_keeps_what_it_says_and_fills_the_rest() {
    let place = Place::new(&[KELP, ("tall", "base = \"kelp\"\nlength = 4\nlook = { hue = 7 }\n")]);
    let scene = place
        .load(
            r#"
[scene]
seed = 7
[[flow]]
kind = "whirlwind"
strength = { keys = [{ time = 0, value = 1 }, { time = 2, value = -1 }] }
[modules.second]
use = "reef.weed"
plants = [{ species = "tall", nodes = 8 }]
params = { sway = 0.5, level = "high", on = true }
[modules.first]
use = "reef.weed"
"#,
        )
        .expect("a good scene");
    assert_eq!(scene.name, "scene");
    assert_eq!(scene.file.scene.seed, 7);
    assert_eq!(scene.file.scene.dt, 1.0 / 60.0);
    let names: Vec<_> = scene.modules.iter().map(|module| module.name.as_str()).collect();
    assert_eq!(names, ["second", "first"], "modules keep the file's order");
    assert_eq!(scene.modules[0].params, [(1, 0.5), (3, 1.0), (2, 1.0)]);
    let create: Json = serde_json::from_str(&scene.modules[0].create_json(&scene, 9)).expect("JSON");
    assert_eq!(create["scene"]["seed"], 9);
    assert_eq!(create["config"], json!({ "plants": [{ "species": "tall", "nodes": 8 }] }));
    assert_eq!(create["species"]["tall"], json!({ "length": 4, "look": { "hue": 7, "shine": 2 } }));
    assert_eq!(scene.files.len(), 3);
}

#[test]
fn lengths_are_multiplied_by_the_scale_and_the_rest_follows() {
    let place = Place::new(&[]);
    let text = r#"
[scene]
scale = 0.01
[camera]
position = [1, 2, 3]
[[flow]]
kind = "source"
position = [10, 0, 0]
strength = 10000
peak = 10
core = 5
[[flow]]
kind = "directional"
direction = [1, 0, 0]
speed = 2
gradient = 0.5
"#;
    let file = place.load(text).expect("a good scene").file;
    assert_eq!(file.camera.position, keyed::Keyed::Fixed([0.01, 0.02, 0.03]));
    let [flow_tables::FlowTable::Source(source), flow_tables::FlowTable::Directional(current)] =
        file.flow.as_slice()
    else {
        panic!("the two primitives in order");
    };
    let near = |a: f64, b: f64| (a - b).abs() <= 1e-12 * b.abs();
    assert!(near(source.strength.track().unwrap().at(0.0), 0.01));
    assert!(near(source.peak, 0.1) && near(source.core, 0.05));
    assert!(near(current.speed.track().unwrap().at(0.0), 0.02) && near(current.gradient, 50.0));
}

#[test]
fn ranges_are_looked_at_in_metres_and_told_in_the_scenes_own_units() {
    let place = Place::new(&[KELP]);
    let scene = |text: &str| format!("[scene]\nscale = 0.01\n[water]\ndepth = 50000\n{text}");
    // 300 units of a centimetre a second: 3 m/s.
    let file = place.load(scene("[waves]\nwind = 300\n")).expect("3 m/s").file;
    assert_eq!(file.waves.expect("there").wind, 3.0);
    for (text, wanted) in [
        (
            "[waves]\nwind = 6001\n",
            "scene.toml:6:8: waves.wind: is 6001, but must be a number from 0 to 6000 [m/s, of `scale` = 0.01]",
        ),
        (
            "[camera]\nnear = 100001\n",
            "camera.near: is 100001, but must be a number above 0 and at most 100000 [m, of `scale` = 0.01]",
        ),
        (
            "[water.optics]\nbeam = [0.1, 1.1, 0.1]\ndownwelling = [0, 0, 0]\nscattered = [0, 0, 0]\n",
            "water.optics.beam[1]: is 1.1, but must be a number from 0 to 1 [1/m, of `scale` = 0.01]",
        ),
        (
            "[modules.a]\nuse = \"reef.weed\"\nplants = [{ species = \"kelp\", height = 300 }]\n",
            "modules.a.plants[0].height: is 300, but must be a number from 0 to 200 [m, of `scale` = 0.01]",
        ),
        (
            "[modules.a]\nuse = \"reef.weed\"\nparams = { reach = 201 }\n",
            "modules.a.params.reach: is 201, but must be a number from 1 to 200 [m, of `scale` = 0.01]",
        ),
    ] {
        let (told, _) = place.error(scene(text));
        assert!(told.contains(wanted), "{told}");
    }
    // On a bound and through it: rounding must not refuse what the message allows.
    for wind in ["6000", "6000.0"] {
        assert!(
            !place
                .load(scene(&format!("[waves]\nwind = {wind}\n")))
                .is_err_and(|e| e.to_string().contains("from 0"))
        );
    }
    let tenth = "[scene]\nscale = 0.1\n[modules.a]\nuse = \"reef.weed\"\nplants = [{ species = \"kelp\", thickness = 3 }]\n";
    let scene = place.load(tenth).expect("0.3 m is allowed");
    assert_eq!(scene.modules[0].config["plants"][0]["thickness"], 0.3);
    let (told, help) = place.error("[scene]\nscale = 1e6\n[[flow]]\nkind = \"source\"\nstrength = 1\n");
    assert!(told.contains("flow[0].strength: is 1, which is beyond every sensible size"), "{told}");
    assert!(help.expect("a way out").contains("1e15"));
}

#[test]
fn any_terrain_that_the_schema_allows_is_told_or_has_finite_heights() {
    let place = Place::new(&[]);
    // Each key at its least, in its middle, at its greatest, and somewhere else, alone and in pairs.
    let keys: &[(&str, &[&str])] = &[
        ("size", &["[1e-9, 1e-9]", "[40, 30]", "[1e5, 1e5]", "[1e15, 1]"]),
        ("center", &["[-1e5, 1e5]", "[0, 7]", "[1e15, 0]"]),
        ("cell", &["1e-300", "1e-9", "5", "1e5", "1e14"]),
        ("relief", &["0", "1e-300", "3", "1e5", "1e15"]),
        ("relief_length", &["1e-300", "1e-9", "0.000001", "6", "1e5", "1e15"]),
        ("octaves", &["1", "4", "10"]),
        ("gain", &["0", "0.45", "1"]),
        ("slope", &["[-10, 10]", "[0, 0]"]),
        ("rocks", &["{ count = 9, size = [1e-9, 1e5] }", "{ count = 3, clearing = 1e5, flatness = 3 }"]),
        ("rock", &["[{ position = [1e5, -1e5], half_axes = [1e5, 1e-9, 1] }]"]),
    ];
    let (mut sound, mut told) = (0, 0);
    for (at, (first, values)) in keys.iter().enumerate() {
        for (second, others) in &keys[at..] {
            for (value, other) in
                values.iter().flat_map(|value| others.iter().map(move |other| (value, other)))
            {
                let pair = if first == second { String::new() } else { format!("{second} = {other}\n") };
                let text = format!("[terrain]\n{first} = {value}\n{pair}");
                match place.load(&text) {
                    Ok(scene) => {
                        let table = scene.file.terrain.as_ref().expect("there");
                        let many =
                            table.size.iter().map(|size| (size / table.cell).max(1.0)).product::<f64>();
                        if many < 20_000.0 {
                            let bed = crate::step::terrain::build(table, scene.file.water.depth, 1);
                            let rocks = bed.rocks.iter().flat_map(|rock| rock.position);
                            assert!(bed.heights.iter().all(|height| height.is_finite()), "{text}");
                            assert!(rocks.into_iter().all(f64::is_finite), "{text}");
                            sound += 1;
                        }
                    }
                    Err(error) => {
                        assert!(error.to_string().contains("scene.toml:"), "{text}: {error}");
                        told += 1;
                    }
                }
            }
        }
    }
    assert!(sound > 60 && told > 200, "{sound} sound, {told} told");
}

#[test]
fn lengths_beyond_any_sea_are_told_with_the_limit() {
    let place = Place::new(&[KELP]);
    for (text, wanted) in [
        (
            "[camera]\nposition = [0, 1e6, 0]\n",
            "camera.position[1]: is 1000000, but must be within 100000 [m] of",
        ),
        (
            "[camera]\nlook_at = { keys = [{ time = 0, value = [1e9, 0, 0] }] }\n",
            "camera.look_at.keys[0].value[0]: is 1000000000, but must be within 100000 [m] of",
        ),
        (
            "[scene]\nscale = 0.01\n[[obstacle]]\nfrom = [1e8, 0, 0]\nto = [0, 0, 0]\nradius = 1\n",
            "obstacle[0].from[0]: is 100000000, but must be within 10000000 [m of `scale` = 0.01] of",
        ),
        (
            "[[flow]]\nkind = 'source'\nstrength = 1\nreach = 1e-300\n",
            "must be 0, or at least 0.000000001 [m], as every size",
        ),
        ("[terrain]\ncell = 1e-300\n", "must be at least 0.000000001 [m], as every size"),
        ("[terrain]\nrelief_length = 0.000001\noctaves = 10\n", "terrain.relief_length: gives 2.0e10 dunes"),
    ] {
        let (told, _) = place.error(text);
        assert!(told.contains(wanted), "{told}");
    }
    // What is nearly nothing is a fine place.
    assert!(place.load("[camera]\nposition = [6e-17, 1, -1e-300]\n").is_ok());
}

#[test]
fn what_a_plugin_sees_is_in_metres_whatever_the_scene_counts_in() {
    let species = ("moss", "length = 2.0\nheight = 0.25\n");
    let place = Place::new(&[species]);
    let scene = place
        .load(
            r#"
[scene]
scale = 0.01
[modules.a]
use = "reef.weed"
plants = [{ species = "own", height = 150, stiffness = 7.5 }, { species = "moss" }]
params = { reach = 150 }
[species.own]
base = "moss"
width = 12
"#,
        )
        .expect("a good scene");
    let create: Json = serde_json::from_str(&scene.modules[0].create_json(&scene, 1)).expect("JSON");
    assert_eq!(create["scene"]["scale"], 0.01);
    // A default of half a unit of the scene's beside what it says.
    let plants = json!([
        { "species": "own", "height": 1.5, "stiffness": 7.5 },
        { "species": "moss", "height": 0.005 },
    ]);
    assert_eq!(create["config"]["plants"], plants);
    assert_eq!(create["species"]["own"], json!({ "length": 2.0, "height": 0.25, "width": 0.12 }));
    assert_eq!(create["species"]["moss"], json!({ "length": 2.0, "height": 0.25 }));
    assert_eq!(scene.modules[0].params, [(4, 1.5)]);
    // In metres the plugin's own defaults stand.
    let scene =
        place.load("[modules.a]\nuse = \"reef.weed\"\nplants = [{ species = \"moss\" }]\n").expect("good");
    assert_eq!(scene.modules[0].config["plants"], json!([{ "species": "moss" }]));
    assert_eq!(scene.modules[0].params, []);
    // A length that the plugin itself refuses.
    let scene =
        place.load("[scene]\nscale = 0.01\n[modules.a]\nuse = \"reef.weed\"\nplants = []\n").expect("good");
    let error = scene.modules[0].create_error("plants: none is at least 1 m high");
    assert_eq!(error.help_text(), Some("the plugin counts in metres; a unit of this scene is 0.01 m"));
}

#[test]
fn a_scene_of_its_own_scale_has_the_waves_of_its_depth_in_metres() {
    let place = Place::new(&[]);
    // 500 units of a centimetre: 5 m. A wind of 500 units is 5 m/s.
    let file =
        place.load("[scene]\nscale = 0.01\n[water]\ndepth = 500\n[waves]\nwind = 50\n").expect("sound").file;
    assert!((file.waves.expect("there").wind - 0.5).abs() < 1e-12);
    assert!(place.load("[scene]\nscale = 1\n[water]\ndepth = 5\n[waves]\nwind = 11.8\n").is_ok());
    // Twice the length, four times the height, twice the depth.
    let (told, help) = place.error("[scene]\nscale = 2\n[water]\ndepth = 5\n[waves]\nwind = 11.8\n");
    assert!(told.contains("waves.wind: raises waves of 11.88 m"), "{told}");
    let help = help.expect("a way out");
    let most: f64 = help.split([' ', ',']).find_map(|word| word.parse().ok()).expect("a number");
    assert!(place.load(format!("[scene]\nscale = 2\n[waves]\nwind = {most}\n")).is_ok(), "{help}");
}
