//! assets/species/README.md, the table of parameters that the paper wished for (§6), is made from the code
//! and held to it here. After a change: REEF_WRITE_TABLE=1 cargo test -p reef-anemone-model --test model
//! species_table

use std::fmt::Write as _;

use reef_anemone_model::species::Species;
use serde_json::Value;

use crate::scene;

/// One parameter of a species, as its schema describes it.
struct Parameter {
    key: String,
    unit: String,
    range: String,
    default: String,
    effect: String,
}

fn schema() -> Value {
    let settings = schemars::generate::SchemaSettings::draft2020_12().with(|s| s.inline_subschemas = true);
    settings.into_generator().into_root_schema_for::<Species>().to_value()
}

fn text(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Null => "–".to_owned(),
        other => {
            let text = other.to_string();
            text.strip_suffix(".0").map_or(text.clone(), str::to_owned)
        }
    }
}

fn collect(path: &str, schema: &Value, default: &Value, found: &mut Vec<Parameter>) {
    for (key, inner) in schema["properties"].as_object().into_iter().flatten() {
        let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
        let default = &default[key];
        if inner["properties"].is_object() {
            collect(&path, inner, default, found);
            continue;
        }
        let bound = |name: &str| inner.get(name).map(text);
        let choices: Vec<String> =
            inner["oneOf"].as_array().into_iter().flatten().map(|c| text(&c["const"])).collect();
        let range = match (bound("minimum"), bound("maximum")) {
            (Some(least), Some(most)) => format!("{least} … {most}"),
            _ if !choices.is_empty() => choices.join(", "),
            _ if inner.get("pattern").is_some() => "#RRGGBB".to_owned(),
            _ => String::new(),
        };
        found.push(Parameter {
            key: path,
            unit: bound("x-unit").unwrap_or_default(),
            range,
            default: text(default),
            effect: bound("description").unwrap_or_default().replace('\n', " "),
        });
    }
}

fn parameters() -> Vec<Parameter> {
    let default = serde_json::to_value(Species::default()).expect("plain data");
    let mut found = Vec::new();
    collect("", &schema(), &default, &mut found);
    found
}

fn lookup<'a>(value: &'a Value, path: &str) -> &'a Value {
    path.split('.').fold(value, |value, key| &value[key])
}

fn readme() -> String {
    let mut out = String::from(
        "# Species\n\n\
         Each file here is one species of anemone, seagrass, seaweed or fish; a scene names it without the ending. Seaweeds, which\n\
         have a `stem`, are described in SEAWEEDS.md, fish, which have a `body`, in FISH.md, all others here. A table needs only\n\
         what differs from the defaults below.\n\
         `base = \"OTHER\"` takes all else from another species. Lengths are metres at a size of 1, whatever a scene counts in;\n\
         individuals differ by `variation`.\n\n\
         Both tables are made from the code (`sim-plugins/anemone/model/src/species.rs`) and from the files, and a test keeps\n\
         them so.\n\n\
         ## Parameters\n\n\
         | parameter | unit | range | default | what it does to the look |\n|---|---|---|---|---|\n",
    );
    let parameters = parameters();
    for p in &parameters {
        writeln!(out, "| `{}` | {} | {} | {} | {} |", p.key, p.unit, p.range, p.default, p.effect)
            .expect("a string");
    }
    let shown: Vec<&Parameter> = parameters.iter().filter(|p| p.key != "title").collect();
    out.push_str("\n## Species\n\nOne row a species, all values with what `base` and the defaults fill in.\n\n| species |");
    for p in &shown {
        write!(out, " {} |", p.key).expect("a string");
    }
    out.push_str("\n|---|");
    out.push_str(&"---|".repeat(shown.len()));
    for name in scene::species_names() {
        let species = serde_json::to_value(scene::species(&name)).expect("plain data");
        write!(out, "\n| {name} |").expect("a string");
        for p in &shown {
            write!(out, " {} |", text(lookup(&species, &p.key))).expect("a string");
        }
    }
    out.push('\n');
    out
}

#[test]
fn the_table_of_parameters_is_up_to_date() {
    let path = scene::assets().join("species/README.md");
    let wanted = readme();
    if std::env::var_os("REEF_WRITE_TABLE").is_some() {
        std::fs::write(&path, &wanted).expect("assets/species can be written");
    }
    let found = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(found == wanted, "{} is out of date; see the top of this test's file", path.display());
}

#[test]
fn every_parameter_says_what_it_does_and_every_number_has_a_range() {
    let parameters = parameters();
    assert!(parameters.len() > 40, "{}", parameters.len());
    for p in &parameters {
        assert!(p.effect.len() > 10, "{} has no description", p.key);
        let number = p.default.parse::<f64>().is_ok();
        assert!(!number || p.range.contains('…'), "{} has no range", p.key);
    }
}

#[test]
fn every_species_file_keeps_to_the_ranges_of_its_parameters() {
    let parameters = parameters();
    for name in scene::species_names() {
        let species = serde_json::to_value(scene::species(&name)).expect("plain data");
        for p in &parameters {
            let bounds: Vec<f64> = p.range.split(" … ").filter_map(|b| b.parse().ok()).collect();
            if let (&[least, most], Some(value)) = (bounds.as_slice(), lookup(&species, &p.key).as_f64()) {
                assert!((least..=most).contains(&value), "{name}: {} = {value}", p.key);
            }
        }
    }
}
