//! Species in assets, and the pages that are made of their schemas.

use std::{fmt::Write as _, path::PathBuf};

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;

/// The folder of species.
pub fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../assets/species")
}

/// A species file.
///
/// # Panics
/// When it cannot be read.
pub fn table(name: &str) -> Value {
    let path = folder().join(format!("{name}.toml"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    toml::from_str(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// All species whose tables are such, in the order of their names.
///
/// # Panics
/// When the folder cannot be read.
pub fn names(is_such: impl Fn(&Value) -> bool) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder())
        .expect("assets/species")
        .filter_map(|entry| {
            let path = entry.expect("readable").path();
            (path.extension()? == "toml").then(|| path.file_stem()?.to_str().map(str::to_owned))?
        })
        .filter(|name| is_such(&table(name)))
        .collect();
    names.sort();
    names
}

/// One parameter of a species, as its schema describes it.
pub struct Parameter {
    /// Its path, with dots; `[]` stands for each table of a list.
    pub key: String,
    /// Its unit; empty without one.
    pub unit: String,
    /// What it may be.
    pub range: String,
    /// What it is where a table says nothing.
    pub default: String,
    /// What it does.
    pub effect: String,
}

/// All parameters of a species.
///
/// # Panics
/// When the defaults are no plain data.
pub fn parameters<S: JsonSchema + Serialize + Default>() -> Vec<Parameter> {
    let schema = reef_sdk::species_schema::<S>().to_value();
    let mut found = Vec::new();
    collect("", &schema, &serde_json::to_value(S::default()).expect("plain data"), &mut found);
    found
}

fn collect(path: &str, schema: &Value, default: &Value, found: &mut Vec<Parameter>) {
    for (key, inner) in schema["properties"].as_object().into_iter().flatten() {
        let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
        let default = if default[key].is_null() { &inner["default"] } else { &default[key] };
        if inner["properties"].is_object() {
            collect(&path, inner, default, found);
            continue;
        }
        let numbers = if inner["items"].is_object() { &inner["items"] } else { inner };
        let bound = |name: &str| numbers.get(name).map(text);
        let choices: Vec<String> =
            inner["oneOf"].as_array().into_iter().flatten().map(|c| text(&c["const"])).collect();
        let range = match (bound("minimum"), bound("exclusiveMinimum"), bound("maximum")) {
            (Some(least), _, Some(most)) => format!("{least} … {most}"),
            (_, Some(least), Some(most)) => format!("above {least} … {most}"),
            _ if !choices.is_empty() => choices.join(", "),
            _ if inner.get("pattern").is_some() => "#RRGGBB".to_owned(),
            _ => String::new(),
        };
        let said = |name: &str| inner.get(name).map(text).unwrap_or_default();
        let (unit, effect) = (said("x-unit"), said("description").replace('\n', " "));
        found.push(Parameter { key: path.clone(), unit, range, default: text(default), effect });
        if inner["items"]["properties"].is_object() {
            collect(&format!("{path}[]"), &inner["items"], &Value::Null, found);
        }
    }
}

/// A value as it stands in a table.
pub fn text(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Null => "–".to_owned(),
        Value::Array(items) if items.iter().any(Value::is_object) => format!("{} tables", items.len()),
        Value::Array(items) => items.iter().map(text).collect::<Vec<_>>().join(" "),
        other => {
            let text = other.to_string();
            text.strip_suffix(".0").map_or(text.clone(), str::to_owned)
        }
    }
}

/// What a species has at a parameter's path.
pub fn value_at(species: &Value, key: &str) -> String {
    text(key.split('.').fold(species, |value, key| &value[key]))
}

/// A row a parameter: unit, range, default, effect. `does` is the last column's title.
pub fn parameter_rows(parameters: &[Parameter], does: &str) -> String {
    let mut out = format!("| parameter | unit | range | default | {does} |\n|---|---|---|---|---|\n");
    for p in parameters {
        // Writing to a String cannot fail.
        let _ = writeln!(out, "| `{}` | {} | {} | {} | {} |", p.key, p.unit, p.range, p.default, p.effect);
    }
    out
}

/// A column a species, a row a parameter but the title. `all`: names and tables with what defaults fill in.
pub fn species_columns(parameters: &[Parameter], all: &[(String, Value)]) -> String {
    let names: Vec<&str> = all.iter().map(|(name, _)| name.as_str()).collect();
    let mut out = format!("| parameter | {} |\n|---|{}\n", names.join(" | "), "---|".repeat(names.len()));
    for p in parameters.iter().filter(|p| p.key != "title" && !p.key.contains("[]")) {
        let row: Vec<String> = all.iter().map(|(_, species)| value_at(species, &p.key)).collect();
        // As above.
        let _ = writeln!(out, "| `{}` | {} |", p.key, row.join(" | "));
    }
    out
}

/// Holds a page of assets/species to what it should be; writes it where REEF_WRITE_TABLE is set.
///
/// # Panics
/// When it is out of date: `again` is the command that writes it.
pub fn hold(page: &str, wanted: &str, again: &str) {
    let path = folder().join(page);
    if std::env::var_os("REEF_WRITE_TABLE").is_some() {
        std::fs::write(&path, wanted).expect("assets/species can be written");
    }
    let found = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(found == wanted, "{} is out of date: REEF_WRITE_TABLE=1 {again}", path.display());
}
