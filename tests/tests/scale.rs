//! Every number of every table follows the scale as its unit says. (That every number has a unit, or is known
//! to have none, is tested where all modules are at hand.)

use reef_anemone_model::Anemones;
use reef_particles_model::Particles;
use reef_plugin::{PluginInfo, Registry};
use reef_sea::scene::{
    bounds::Bounds,
    check::{Terms, check, resolve},
    document::{Entry, Node, Path, Value},
    format, params,
    scale::{Defaults, in_metres},
    species_schema,
    terrain_tables::TerrainTable,
    unit::from_metres,
};
use serde_json::{Map, Value as Json, json};

/// Units and the power by which they go with the length, each written down by hand.
const UNITS: [(&str, i32); 13] = [
    ("m", 1),
    ("m/s", 1),
    ("m³/s", 3),
    ("1/m", -1),
    ("1/m³", -3),
    ("s", 0),
    ("deg", 0),
    ("px", 0),
    ("kg/m³", 0),
    ("kg/s", 0),
    ("Pa·s", 0),
    ("N", 0),
    ("N/m", 0),
];
/// A number of a sample: its key with all that it is in, its unit, and what it is in the scene's units.
struct Leaf {
    path: String,
    power: i32,
    value: f64,
}

/// Makes tables with every key of a schema.
struct Sampler<'a> {
    root: &'a Json,
    scale: f64,
    /// Which choice is taken where there are several.
    choice: usize,
    leaves: Vec<Leaf>,
}

impl<'a> Sampler<'a> {
    fn facets(&self, schema: &'a Json, into: &mut Vec<&'a Json>) {
        into.push(schema);
        if let Some(target) = schema.get("$ref").and_then(Json::as_str) {
            self.facets(resolve(self.root, target).expect("references lead somewhere"), into);
        }
        for word in ["anyOf", "oneOf"] {
            let real = |choice: &&Json| choice.get("type").and_then(Json::as_str) != Some("null");
            let choices: Vec<&Json> =
                schema.get(word).and_then(Json::as_array).into_iter().flatten().filter(real).collect();
            if !choices.is_empty() {
                self.facets(choices[self.choice % choices.len()], into);
            }
        }
    }

    /// A value of a schema under a key, in a table at `path`, of the unit `around` if it names none itself.
    fn value(&mut self, schema: &'a Json, path: &str, around: Option<&'a str>) -> Json {
        let mut facets = Vec::new();
        self.facets(schema, &mut facets);
        let find = |word: &str| facets.iter().find_map(|facet| facet.get(word));
        let unit = find("x-unit").and_then(Json::as_str).or(around);
        if let Some(fixed) = find("const").or_else(|| find("enum")?.get(0)) {
            return fixed.clone();
        }
        let kind = match find("type") {
            Some(Json::String(name)) => name.as_str(),
            Some(Json::Array(names)) => names[0].as_str().expect("a name"),
            _ => "object",
        };
        match kind {
            "boolean" => json!(true),
            "string" if find("pattern").is_some() => json!("#102030"),
            "string" => json!("text"),
            "array" => {
                let count = find("minItems").and_then(Json::as_u64).unwrap_or(1).max(1);
                let items = find("items").or_else(|| find("prefixItems")?.get(0)).expect("items");
                (0..count).map(|_| self.value(items, path, unit)).collect()
            }
            "object" => {
                let mut table = Map::new();
                for properties in facets.iter().filter_map(|facet| facet.get("properties")?.as_object()) {
                    for (key, rule) in properties {
                        let value = self.value(rule, &format!("{path}.{key}"), unit);
                        table.insert(key.clone(), value);
                    }
                }
                table.into()
            }
            _ => self.number(&facets, path, unit, kind == "integer"),
        }
    }

    fn number(&mut self, facets: &[&'a Json], path: &str, unit: Option<&str>, whole: bool) -> Json {
        let power = unit.map_or(0, |unit| {
            let known = UNITS.iter().find(|(known, _)| *known == unit);
            known.unwrap_or_else(|| panic!("{path}: {unit:?} is no unit known")).1
        });
        let bounds = facets.iter().find_map(|facet| Bounds::of(facet)).unwrap_or_default();
        let low = bounds.minimum.or(bounds.above).unwrap_or(0.0);
        let high = bounds.maximum.or(bounds.below).unwrap_or(low.abs() * 2.0 + 3.0);
        let metres = low + 0.37 * (high - low);
        if whole {
            return json!(metres.round() as i64);
        }
        let value = metres / self.scale.powi(power);
        self.leaves.push(Leaf { path: path.to_owned(), power, value });
        json!(value)
    }
}

/// All numbers of a value that are no whole ones, in the order of its keys.
fn numbers(value: &Json, found: &mut Vec<f64>) {
    match value {
        Json::Number(number) if number.is_f64() => found.extend(number.as_f64()),
        Json::Array(elements) => elements.iter().for_each(|element| numbers(element, found)),
        Json::Object(table) => table.values().for_each(|value| numbers(value, found)),
        _ => {}
    }
}

/// The same value as a tree without places.
fn tree(value: &Json) -> Node {
    let value = match value {
        Json::Bool(value) => Value::Bool(*value),
        Json::Number(number) => match number.as_i64() {
            Some(whole) => Value::Integer(whole),
            None => Value::Float(number.as_f64().expect("a number")),
        },
        Json::String(text) => Value::String(text.clone()),
        Json::Array(elements) => Value::Array(elements.iter().map(tree).collect()),
        Json::Object(table) => Value::Table(
            table
                .iter()
                .map(|(key, value)| Entry { key: key.clone(), key_span: 0..0, node: tree(value) })
                .collect(),
        ),
        Json::Null => panic!("no null in TOML"),
    };
    Node { span: 0..0, value }
}

fn registry() -> Registry {
    let mut registry = Registry::new();
    for entry in [reef_sdk::entry::<Anemones>(), reef_sdk::entry::<Particles>()] {
        registry.add_linked(entry, 1).expect("a sound plugin");
    }
    registry
}

/// All tables that people write: name, what references lead into, schema.
fn tables() -> Vec<(String, Json, Json)> {
    let host = format::schema();
    let mut all = vec![("scene".to_owned(), host.clone(), host)];
    for info in registry().infos() {
        let root = info.config_schema.clone().expect("a schema");
        let species = species_schema(&root).cloned();
        all.push((info.id.clone(), root.clone(), root.clone()));
        all.extend(species.map(|species| (format!("{} species", info.id), root, species)));
    }
    all
}

#[test]
fn every_key_with_a_length_in_its_unit_follows_the_scale() {
    let mut seen = 0;
    for (name, root, schema) in tables() {
        for (choice, scale) in (0..5_usize).flat_map(|choice| [(choice, 0.01), (choice, 3.0)]) {
            let mut sampler = Sampler { root: &root, scale, choice, leaves: Vec::new() };
            let mut sample = sampler.value(&schema, &name, None);
            let leaves = sampler.leaves;
            let terms = Terms { scale, ..Terms::default() };
            let faults = check(&root, &schema, &tree(&sample), &Path::default(), terms);
            assert!(
                faults.is_empty(),
                "{name}: a number in the middle of its range is refused: {:?}",
                faults[0]
            );
            in_metres(&root, &schema, &mut sample, scale, Defaults::Scaled);
            let mut metres = Vec::new();
            numbers(&sample, &mut metres);
            assert_eq!(metres.len(), leaves.len(), "{name}: nothing is missing, and nothing is filled in");
            for (leaf, metres) in leaves.iter().zip(metres) {
                let wanted = leaf.value * scale.powi(leaf.power);
                assert!(
                    (metres - wanted).abs() <= 1e-12 * wanted.abs(),
                    "{}: {metres}, not {wanted}",
                    leaf.path
                );
                seen += usize::from(leaf.power != 0);
            }
        }
    }
    assert!(seen > 500, "{seen}");
}

#[test]
fn every_parameter_with_a_length_in_its_unit_follows_the_scale() {
    let mut lengths = Vec::new();
    for info in registry().infos() {
        for param in &info.params {
            let named = UNITS.iter().find(|(unit, _)| *unit == param.unit);
            assert!(
                param.unit.is_empty() || named.is_some(),
                "{}: {:?} is no unit known",
                param.key,
                param.unit
            );
            let Some((_, power)) = named.filter(|(_, power)| *power != 0) else { continue };
            lengths.push(param.key.clone());
            let mut one = PluginInfo::clone(info);
            one.params.retain(|other| other.key == param.key);
            for scale in [0.01_f64, 0.25, 3.0] {
                let middle = 0.5 * (param.minimum + param.maximum);
                let own = |metres: f64| metres / scale.powi(*power);
                for metres in [param.minimum, middle, param.maximum] {
                    let set = set_to(&one, own(metres), scale).expect("within the range");
                    assert!(
                        (set - metres).abs() <= 1e-12 * metres.abs(),
                        "{}: {set}, not {metres}",
                        param.key
                    );
                    assert!((param.minimum..=param.maximum).contains(&set), "{}", param.key);
                }
                let told = set_to(&one, own(param.maximum) * 1.01, scale).expect_err("beyond the range");
                let [low, high] =
                    [param.minimum, param.maximum].map(|bound| from_metres(bound, *power, scale));
                let allowed = format!("from {low} to {high} [{}, of `scale` = {scale}]", param.unit);
                assert!(told.contains(&allowed), "{told} / {allowed}");
                // Its default, too, as far as the range goes.
                let default =
                    params(&tree(&json!({})), &Path::default(), &one, scale).expect("no key, no fault");
                let wanted = (param.default * scale.powi(*power)).clamp(param.minimum, param.maximum);
                assert!(
                    (default[0].1 - wanted).abs() <= 1e-12 * wanted,
                    "{}: {default:?}, not {wanted}",
                    param.key
                );
            }
            assert_eq!(params(&tree(&json!({})), &Path::default(), &one, 1.0), Ok(Vec::new()));
        }
    }
    assert_eq!(lengths, ["master_distance", "fog_distance", "visibility"]);
}

/// What a plugin's only parameter becomes; `Err`: what is wrong.
fn set_to(info: &PluginInfo, value: f64, scale: f64) -> Result<f64, String> {
    let table = tree(&json!({ "params": { &info.params[0].key: value } }));
    let values = params(&table, &Path::default(), info, scale).map_err(|fault| fault.problem)?;
    assert_eq!(values.len(), 1);
    Ok(values[0].1)
}

#[test]
fn what_is_not_there_has_its_default_in_the_scenes_units() {
    let schema = format::schema();
    let mut file = json!({ "scene": { "scale": 0.01 }, "terrain": {} });
    in_metres(&schema, &schema, &mut file, 0.01, Defaults::Scaled);
    let file: format::SceneFile = serde_json::from_value(file).expect("a scene");
    let (default, near) = (format::SceneFile::default(), |a: f64, b: f64| (a - b).abs() <= 1e-12 * b.abs());
    assert_eq!((file.scene.scale, file.scene.dt), (0.01, default.scene.dt));
    assert!(near(file.water.depth, 0.05) && near(file.camera.near, 0.0002));
    let terrain = file.terrain.expect("there");
    assert!(near(terrain.ripples.spacing, 0.0014) && near(terrain.rocks.size[1], 0.007));
    assert_eq!(terrain.gain, TerrainTable::default().gain);
    // Species keep what their tables do not say.
    let (_, root, species) = tables().remove(2);
    let mut table = json!({ "foot": { "height": 7.0 } });
    in_metres(&root, &species, &mut table, 0.01, Defaults::Metres);
    assert_eq!(table, json!({ "foot": { "height": 0.07 } }));
}
