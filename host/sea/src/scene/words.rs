//! What a schema allows, in the words of an error and of the reference; spellings that are near.

use serde_json::Value as Json;

use super::{
    bounds::Bounds,
    check::{COLOR, DEEPEST_REFERENCE, deref, tag_of},
    unit::{Unit, suffix},
};

/// What a schema allows, in words: "a number from 0 to 1 [m]".
pub fn describe(root: &Json, schema: &Json) -> String {
    Words { root, scale: 1.0 }.schema(schema, None, 0)
}

/// Tells what schemas allow.
pub(super) struct Words<'a> {
    pub(super) root: &'a Json,
    /// Metres per unit of length of who reads it.
    pub(super) scale: f64,
}

impl Words<'_> {
    /// `around`: the unit of what it is in.
    pub(super) fn schema(&self, schema: &Json, around: Option<&str>, depth: usize) -> String {
        if depth > DEEPEST_REFERENCE {
            return "a value".to_owned();
        }
        let own = schema.get("x-unit").and_then(Json::as_str);
        let power = Unit::read(own.or(around).unwrap_or_default()).power;
        let words = |schema: &Json| {
            let bounds = Bounds::of(schema)?.from_metres(power, self.scale);
            Some(format!(" {}", bounds.words()))
        };
        let bounds = words(schema).unwrap_or_default();
        let unit = own.or(around.filter(|_| power != 0 && self.scale != 1.0)).filter(|unit| !unit.is_empty());
        let unit = suffix(unit.unwrap_or_default(), self.scale);
        let target = deref(self.root, schema);
        if let Some(Json::Array(values)) = target.get("enum") {
            return one_of(&values.iter().filter(|value| !value.is_null()).collect::<Vec<_>>());
        }
        if let Some(value) = target.get("const") {
            return value.to_string();
        }
        for word in ["anyOf", "oneOf"] {
            if let Some(Json::Array(choices)) = target.get(word) {
                let choices: Vec<&Json> = choices
                    .iter()
                    .filter(|choice| choice.get("type").and_then(Json::as_str) != Some("null"))
                    .collect();
                if let Some((tag, values)) =
                    tag_of(self.root, &choices.iter().map(|c| (*c).clone()).collect::<Vec<_>>())
                {
                    return format!("a table with `{tag}` = {}", quoted(&values));
                }
                let named: Option<Vec<&Json>> =
                    choices.iter().map(|choice| deref(self.root, choice).get("const")).collect();
                if let Some(named) = named {
                    return one_of(&named);
                }
                let mut words: Vec<String> =
                    choices.iter().map(|choice| self.schema(choice, None, depth + 1)).collect();
                words.dedup();
                return format!("{}{bounds}{unit}", words.join(", or "));
            }
        }
        let names: Vec<&str> = match target.get("type") {
            Some(Json::String(name)) => vec![name],
            Some(Json::Array(names)) => {
                names.iter().filter_map(Json::as_str).filter(|name| *name != "null").collect()
            }
            _ => Vec::new(),
        };
        let own_bounds = match &bounds {
            text if text.is_empty() => words(target).unwrap_or_default(),
            text => text.clone(),
        };
        let words: Vec<String> = names
            .iter()
            .map(|name| match *name {
                "boolean" => "true or false".to_owned(),
                "integer" => format!("a whole number{own_bounds}{unit}"),
                "number" => format!("a number{own_bounds}{unit}"),
                "string" if target.get("pattern").and_then(Json::as_str) == Some(COLOR) => {
                    "a colour like \"#F4F4F0\"".to_owned()
                }
                "string" => "text".to_owned(),
                "array" => self.list(target, depth) + &unit,
                "object" => "a table".to_owned(),
                other => other.to_owned(),
            })
            .collect();
        if words.is_empty() { "a value".to_owned() } else { words.join(", or ") }
    }

    fn list(&self, schema: &Json, depth: usize) -> String {
        let least = schema.get("minItems").and_then(Json::as_u64);
        let most = schema.get("maxItems").and_then(Json::as_u64);
        let inner = schema.get("items").map(|items| deref(self.root, items));
        let numbers = inner.and_then(|inner| inner.get("type")).and_then(Json::as_str) == Some("number");
        match (least, most) {
            (Some(least), Some(most)) if least == most && numbers => format!("a list of {least} numbers"),
            (Some(least), Some(most)) if least == most => format!("a list of {least}"),
            _ => match inner {
                Some(inner) if depth < 4 && inner.get("type").and_then(Json::as_str) != Some("object") => {
                    format!("a list, each {}", self.schema(inner, None, depth + 1))
                }
                Some(_) => "a list of tables".to_owned(),
                None => "a list".to_owned(),
            },
        }
    }
}

/// A number as people write it: with an exponent where it would have many zeros.
pub(super) fn figure(value: f64) -> String {
    let plain = value == 0.0 || (1e-9..1e16).contains(&value.abs());
    if plain { value.to_string() } else { format!("{value:e}") }
}

pub(super) fn one_of(values: &[&Json]) -> String {
    let words: Vec<String> = values.iter().map(|value| value.to_string()).collect();
    match words.as_slice() {
        [one] => one.clone(),
        _ => format!("one of {}", words.join(", ")),
    }
}

pub(super) fn quoted(values: &[String]) -> String {
    let words: Vec<String> = values.iter().map(|value| format!("{value:?}")).collect();
    match words.as_slice() {
        [one] => one.clone(),
        _ => format!("one of {}", words.join(", ")),
    }
}

/// The nearest spelling, if any is near enough to be meant.
pub fn nearest<'a>(said: &str, names: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    names
        .map(|name| {
            (strsim::normalized_damerau_levenshtein(&said.to_lowercase(), &name.to_lowercase()), name)
        })
        .filter(|(likeness, _)| *likeness >= 0.5)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, name)| name)
}

/// The help that names the nearest spelling.
pub fn did_you_mean(name: &str) -> String {
    format!("did you mean `{name}`?")
}
