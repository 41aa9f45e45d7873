//! Every number that a scene can say names its unit, or is known to have none: a length whose unit is
//! forgotten would not follow a scene's `scale`. (That units do follow it is tested where scenes are read.)

use std::collections::BTreeSet;

use reef_plugin::{ParamInfo, ParamKind};
use reef_sea::scene::{check::resolve, format, species_schema, unit::Unit};
use reef_tests::{artifacts::artifacts, own::OWN};
use serde_json::Value as Json;

use crate::load;

/// The scene's own numbers without a unit: counts, shares, factors, directions, seeds, light.
const PURE: &[&str] = &[
    "flow.attach.object",
    "flow.axis",
    "flow.direction",
    "flow.fade",
    "flow.modulation",
    "flow.strength",
    "flow.travel",
    "light.ambient",
    "light.color",
    "light.shafts",
    // Any parameter: each says its own unit.
    "modules.params",
    "scene.scale",
    "scene.seed",
    "terrain.gain",
    "terrain.octaves",
    "terrain.rock.buried",
    "terrain.rocks.buried",
    "terrain.rocks.count",
    "terrain.rocks.flatness",
    "terrain.seed",
    "terrain.slope",
    "water.optics.scattered",
    "waves.trains",
];

/// The numbers of a schema, by where they stand: tables joined with dots.
#[derive(Default)]
struct Numbers {
    pure: BTreeSet<String>,
    /// With their units.
    measured: BTreeSet<(String, String)>,
}

impl Numbers {
    fn note(&mut self, path: &str, unit: Option<&str>) {
        match unit.filter(|unit| !unit.is_empty()) {
            Some(unit) => self.measured.insert((path.to_owned(), unit.to_owned())),
            None => self.pure.insert(path.to_owned()),
        };
    }

    /// Everything that a value of this schema at `path` may have in it, of the unit `around` where it names
    /// none itself.
    fn read<'a>(&mut self, root: &'a Json, schema: &'a Json, path: &str, around: Option<&'a str>) {
        let unit = schema["x-unit"].as_str().or(around);
        if schema.get("const").or(schema.get("enum")).is_some() {
            return;
        }
        if let Some(target) = schema["$ref"].as_str() {
            self.read(root, resolve(root, target).expect("references lead somewhere"), path, unit);
        }
        let parts =
            ["anyOf", "oneOf", "allOf", "prefixItems"].iter().filter_map(|word| schema[*word].as_array());
        for part in parts.flatten().chain(schema.get("items")).chain(schema.get("additionalProperties")) {
            self.read(root, part, path, unit);
        }
        for (key, rule) in schema["properties"].as_object().into_iter().flatten() {
            // What a keyframe is worth has the meaning of what the keys are for.
            let inner = match (path, key.as_str()) {
                (_, "keys" | "value") => path.to_owned(),
                ("", key) => key.to_owned(),
                (path, key) => format!("{path}.{key}"),
            };
            self.read(root, rule, &inner, unit);
        }
        let is = |name: &str| match &schema["type"] {
            Json::Array(names) => names.iter().any(|other| other == name),
            one => one == name,
        };
        if is("number") || is("integer") {
            self.note(path, unit);
        }
    }

    /// Holds what has no unit against what is listed.
    fn hold(&self, whose: &str, listed: &[&str]) {
        let listed: BTreeSet<String> = listed.iter().map(|path| (*path).to_owned()).collect();
        let forgotten: Vec<&String> = self.pure.difference(&listed).collect();
        assert!(
            forgotten.is_empty(),
            "{whose}: say in which unit these are, or list them as pure: {forgotten:#?}"
        );
        let stale: Vec<&String> = listed.difference(&self.pure).collect();
        assert!(
            stale.is_empty(),
            "{whose}: these are listed as pure, and have a unit or are not there: {stale:#?}"
        );
        for (path, unit) in &self.measured {
            assert_eq!(Unit::read(unit).unknown, None, "{whose}: {path} is in {unit:?}");
        }
    }
}

#[test]
fn every_number_of_a_scene_has_a_unit_or_is_known_to_have_none() {
    let schema = format::schema();
    let mut numbers = Numbers::default();
    numbers.read(&schema, &schema, "", None);
    assert!(numbers.measured.len() > 50, "{:?}", numbers.measured);
    numbers.hold("the scene", PURE);
}

#[test]
fn every_number_of_a_module_has_a_unit_or_is_known_to_have_none() {
    for own in OWN {
        let plugin = load(artifacts().plugin(own.library), 1);
        assert_eq!(plugin.info().id, own.id);
        let mut numbers = Numbers::default();
        if let Some(root) = &plugin.info().config_schema {
            numbers.read(root, root, "", None);
            if let Some(species) = species_schema(root) {
                numbers.read(root, species, "species", None);
            }
        }
        let is_number = |param: &&ParamInfo| matches!(param.kind, ParamKind::Float | ParamKind::Int);
        for param in plugin.info().params.iter().filter(is_number) {
            numbers.note(&format!("params.{}", param.key), Some(&param.unit));
        }
        assert!(!numbers.measured.is_empty(), "{}", own.id);
        numbers.hold(own.id, own.pure);
    }
}
