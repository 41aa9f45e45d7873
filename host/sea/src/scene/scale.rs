//! Metres from a scene's own units of length: every number whose unit (`x-unit` of the schema that describes
//! it) goes with the length is multiplied, those that stand in the file and those that it leaves to their
//! defaults.

use serde_json::{Map, Number, Value as Json};

use super::{
    bounds::Bounds,
    check::resolve,
    unit::{Unit, to_metres},
};

/// References and choices followed on the way to one value.
const DEEPEST: usize = 32;

/// Whose defaults are in the scene's units.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Defaults {
    /// The table's own: what is not there is put in.
    Scaled,
    /// What is not there has its default in metres.
    Metres,
}

/// Takes a value that `schema` describes to metres, from units of `scale` metres. References lead into
/// `root`.
pub fn in_metres(root: &Json, schema: &Json, value: &mut Json, scale: f64, defaults: Defaults) {
    if scale != 1.0 {
        Walk { root, scale, defaults }.value(schema, value, 0);
    }
}

struct Walk<'a> {
    root: &'a Json,
    scale: f64,
    defaults: Defaults,
}

impl<'a> Walk<'a> {
    /// Scales a value; returns whether it has numbers that go with the length. `power`: that of the unit of
    /// what it is in.
    fn value(&self, schema: &'a Json, value: &mut Json, power: i32) -> bool {
        let mut facets = Vec::new();
        self.facets(schema, value, &mut facets, 0);
        let power = power_of(&facets).unwrap_or(power);
        match value {
            Json::Number(number) => {
                let bounds = facets.iter().filter_map(|facet| Bounds::of(facet));
                if power != 0
                    && let Some(metres) = number.as_f64().map(|own| to_metres(own, power, self.scale))
                    // Rounding must not push a number beyond a bound that it stands on.
                    && let Some(metres) = Number::from_f64(bounds.fold(metres, |metres, bounds| bounds.nearest(metres)))
                {
                    *number = metres;
                }
                power != 0
            }
            Json::Array(elements) => {
                let mut scaled = false;
                for (at, element) in elements.iter_mut().enumerate() {
                    let rule = facets.iter().find_map(|facet| {
                        let first = facet.get("prefixItems").and_then(|rules| rules.get(at));
                        first.or_else(|| facet.get("items"))
                    });
                    scaled |= rule.is_some_and(|rule| self.value(rule, element, power));
                }
                scaled
            }
            Json::Object(table) => self.table(&facets, table, power),
            _ => false,
        }
    }

    fn table(&self, facets: &[&'a Json], table: &mut Map<String, Json>, power: i32) -> bool {
        let mut scaled = false;
        for (key, value) in table.iter_mut() {
            let rule = facets.iter().find_map(|facet| facet.get("properties")?.get(key));
            let others = || facets.iter().find_map(|facet| facet.get("additionalProperties"));
            scaled |= rule.or_else(others).is_some_and(|rule| self.value(rule, value, power));
        }
        if self.defaults == Defaults::Metres {
            return scaled;
        }
        let known = facets.iter().filter_map(|facet| facet.get("properties")?.as_object()).flatten();
        for (key, rule) in known {
            if table.contains_key(key) {
                continue;
            }
            if let Some(mut value) = rule.get("default").filter(|value| !value.is_null()).cloned()
                && self.value(rule, &mut value, power)
            {
                table.insert(key.clone(), value);
                scaled = true;
            }
        }
        scaled
    }

    /// All schemas that describe a value: the schema itself, what it refers to, and the choices that fit.
    fn facets(&self, schema: &'a Json, value: &Json, into: &mut Vec<&'a Json>, depth: usize) {
        if depth > DEEPEST {
            return;
        }
        into.push(schema);
        let target = schema.get("$ref").and_then(Json::as_str).and_then(|target| resolve(self.root, target));
        let parts = schema.get("allOf").and_then(Json::as_array).into_iter().flatten();
        for part in target.into_iter().chain(parts) {
            self.facets(part, value, into, depth + 1);
        }
        for choices in ["anyOf", "oneOf"].iter().filter_map(|word| schema.get(*word)?.as_array()) {
            if let Some(choice) = choices.iter().find(|choice| self.fits(choice, value, depth + 1)) {
                self.facets(choice, value, into, depth + 1);
            }
        }
    }

    /// Whether a choice is the one that a sound value has taken: of its kind, with the same fixed values, and
    /// so on within.
    fn fits(&self, choice: &Json, value: &Json, depth: usize) -> bool {
        if depth > DEEPEST {
            return false;
        }
        let list = |word: &str| choice.get(word).and_then(Json::as_array);
        let kind = match choice.get("type") {
            Some(Json::String(name)) => is_kind(name, value),
            Some(Json::Array(names)) => {
                names.iter().filter_map(Json::as_str).any(|name| is_kind(name, value))
            }
            _ => true,
        };
        let fixed = choice.get("const").is_none_or(|wanted| wanted == value)
            && list("enum").is_none_or(|allowed| allowed.contains(value));
        let mut keys = choice.get("properties").and_then(Json::as_object).into_iter().flatten();
        let tags =
            keys.all(|(key, rule)| rule.get("const").is_none_or(|wanted| value.get(key) == Some(wanted)));
        let target = choice.get("$ref").and_then(Json::as_str).and_then(|target| resolve(self.root, target));
        let fit = |other: &Json| self.fits(other, value, depth + 1);
        kind && fixed
            && tags
            && target.is_none_or(fit)
            && list("allOf").is_none_or(|parts| parts.iter().all(fit))
            && ["anyOf", "oneOf"].iter().all(|word| list(word).is_none_or(|choices| choices.iter().any(fit)))
    }
}

/// The power of the first unit that is named.
fn power_of(facets: &[&Json]) -> Option<i32> {
    facets.iter().find_map(|facet| Some(Unit::read(facet.get("x-unit")?.as_str()?).power))
}

fn is_kind(name: &str, value: &Json) -> bool {
    match name {
        "number" | "integer" => value.is_number(),
        "string" => value.is_string(),
        "boolean" => value.is_boolean(),
        "array" => value.is_array(),
        "object" => value.is_object(),
        "null" => value.is_null(),
        _ => true,
    }
}
