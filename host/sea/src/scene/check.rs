//! Holds a TOML tree against a JSON Schema, so that every error carries line and column.
//!
//! The same code checks the host's own keys and each plugin's. What it understands of JSON Schema: `type`,
//! `properties`, `required`, `additionalProperties`, `minimum`, `maximum`, `exclusiveMinimum`,
//! `exclusiveMaximum`, `format` of integers, `enum`, `const`, `items`, `prefixItems`, `minItems`, `maxItems`,
//! `minLength`, `maxLength`, `pattern` of colours, `allOf`, `anyOf`, `oneOf`, `$ref` into `$defs`, and the
//! extension `x-unit`. Anything else passes.

use serde_json::Value as Json;

use super::{
    bounds::Bounds,
    document::{LARGEST_NUMBER, Node, Path, Span, Value},
    error::Fault,
    unit::{Unit, from_metres, to_metres},
    whole::parse_color,
    words::{Words, did_you_mean, figure, nearest, one_of, quoted},
};

/// Faults of one file that are told at once; more would hide the first.
const MOST_FAULTS: usize = 20;
/// References followed on the way to one value; a schema that needs more refers to itself.
pub(super) const DEEPEST_REFERENCE: usize = 32;

/// The farthest that anything may be, and the longest [m]: streams know places up to ten times as far.
const FARTHEST: f64 = 1e5;
/// The least length that is not nothing [m].
const SMALLEST: f64 = 1e-9;

/// The one pattern of text that schemas use: a colour as `#RRGGBB`.
pub const COLOR: &str = "^#[0-9A-Fa-f]{6}$";

/// What a schema does not say of the table that is held against it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Terms {
    /// Missing keys are fine at the top (a species that builds on another).
    pub missing_keys: bool,
    /// Metres per unit of the table's lengths. The schema's ranges are in metres.
    pub scale: f64,
}

impl Default for Terms {
    fn default() -> Self {
        Self { missing_keys: false, scale: 1.0 }
    }
}

/// All faults of `node`, found at `path` of its file, against `schema`, whose references lead into `root`.
pub fn check(root: &Json, schema: &Json, node: &Node, path: &Path, terms: Terms) -> Vec<Fault> {
    let mut checker =
        Checker { root, faults: Vec::new(), lenient_depth: None, scale: terms.scale, unit: None };
    if terms.missing_keys {
        checker.lenient_depth = Some(path.0.len());
    }
    checker.value(schema, node, node.span.clone(), path, 0);
    checker.faults.truncate(MOST_FAULTS);
    checker.faults
}

struct Checker<'a> {
    root: &'a Json,
    faults: Vec<Fault>,
    lenient_depth: Option<usize>,
    /// Metres per unit.
    scale: f64,
    /// Of what is looked at, or of what that is in.
    unit: Option<&'a str>,
}

impl<'a> Checker<'a> {
    /// `place` is where to point for faults of the value as a whole: its key for tables, itself for all else.
    fn value(&mut self, schema: &'a Json, node: &Node, place: Span, path: &Path, depth: usize) {
        let around = self.unit;
        self.unit = schema.get("x-unit").and_then(Json::as_str).or(around);
        self.value_in_unit(schema, node, place, path, depth);
        self.unit = around;
    }

    fn value_in_unit(&mut self, schema: &'a Json, node: &Node, place: Span, path: &Path, depth: usize) {
        if depth > DEEPEST_REFERENCE {
            return;
        }
        let Json::Object(rules) = schema else {
            if schema == &Json::Bool(false) {
                self.fault(place, path, "nothing may stand here".to_owned(), None);
            }
            return;
        };
        if let Some(target) = rules.get("$ref").and_then(Json::as_str)
            && let Some(target) = resolve(self.root, target)
        {
            self.value(target, node, place.clone(), path, depth + 1);
        }
        if let Some(Json::Array(parts)) = rules.get("allOf") {
            for part in parts {
                self.value(part, node, place.clone(), path, depth + 1);
            }
        }
        for word in ["anyOf", "oneOf"] {
            if let Some(Json::Array(choices)) = rules.get(word) {
                self.choice(choices, node, &place, path, depth);
            }
        }
        if !self.kind(schema, node, &place, path) {
            return;
        }
        self.listed(schema, node, &place, path);
        match &node.value {
            Value::Integer(value) => self.number(schema, *value as f64, &place, path),
            Value::Float(value) => self.number(schema, *value, &place, path),
            Value::String(text) => self.text(schema, text, &place, path),
            Value::Array(elements) => self.array(schema, elements, &place, path, depth),
            Value::Table(_) => self.table(schema, node, &place, path, depth),
            Value::Bool(_) => {}
        }
    }

    fn kind(&mut self, schema: &Json, node: &Node, place: &Span, path: &Path) -> bool {
        let Some(allowed) = schema.get("type") else { return true };
        let names: Vec<&str> = match allowed {
            Json::String(name) => vec![name],
            Json::Array(names) => names.iter().filter_map(Json::as_str).collect(),
            _ => return true,
        };
        let fits = names.iter().any(|name| match (*name, &node.value) {
            ("boolean", Value::Bool(_))
            | ("integer" | "number", Value::Integer(_))
            | ("number", Value::Float(_))
            | ("string", Value::String(_))
            | ("array", Value::Array(_))
            | ("object", Value::Table(_)) => true,
            // 2.0 where a whole number is asked for.
            ("integer", Value::Float(_)) => false,
            _ => false,
        });
        if !fits {
            let help = match &node.value {
                Value::Float(value) if names.contains(&"integer") && value.fract() == 0.0 => {
                    Some(format!("write {value:.0}, without a decimal point"))
                }
                Value::String(text) if names.contains(&"number") && text.trim().parse::<f64>().is_ok() => {
                    Some(format!("write {}, without quotes", text.trim()))
                }
                Value::Table(_) if names.contains(&"array") => {
                    let key = path.to_string();
                    Some(format!("a list of tables is written [[{key}]], with double brackets"))
                }
                _ => None,
            };
            let problem = format!("is {}, but must be {}", node.kind(), self.describe(schema));
            self.fault(place.clone(), path, problem, help);
        }
        fits
    }

    fn listed(&mut self, schema: &Json, node: &Node, place: &Span, path: &Path) {
        let allowed: Vec<&Json> = match (schema.get("enum"), schema.get("const")) {
            (Some(Json::Array(values)), _) => values.iter().filter(|value| !value.is_null()).collect(),
            (_, Some(value)) => vec![value],
            _ => return,
        };
        let json = node.to_json();
        if allowed.contains(&&json) {
            return;
        }
        let names: Vec<&str> = allowed.iter().filter_map(|value| value.as_str()).collect();
        let help = node.as_str().and_then(|text| nearest(text, names.iter().copied())).map(did_you_mean);
        self.fault(place.clone(), path, format!("is {json}, but must be {}", one_of(&allowed)), help);
    }

    /// Ranges are looked at in metres, and told in the table's own units.
    fn number(&mut self, schema: &Json, value: f64, place: &Span, path: &Path) {
        let power = Unit::read(self.unit.unwrap_or_default()).power;
        let metres = to_metres(value, power, self.scale);
        if let Some(bounds) = Bounds::of(schema)
            && !bounds.allow(value, power, self.scale)
        {
            let problem = format!("is {}, but must be {}", figure(value), self.describe(schema));
            self.fault(place.clone(), path, problem, None);
        } else if let Some(allowed) = self.beyond_any_length(schema, metres) {
            self.fault(place.clone(), path, format!("is {}, but must be {allowed}", figure(value)), None);
        } else if metres.abs() > LARGEST_NUMBER {
            let problem = format!("is {}, which is beyond every sensible size in metres", figure(value));
            let help = format!("`scale` makes {metres:e} of it; the limit is 1e15 either way");
            self.fault(place.clone(), path, problem, Some(help));
        }
    }

    /// What would be allowed where a length [m] is too great for a sea, or no zero and yet too small for a
    /// size.
    fn beyond_any_length(&self, schema: &Json, metres: f64) -> Option<String> {
        if self.unit != Some("m") {
            return None;
        }
        let own = |metres: f64| from_metres(metres, 1, self.scale);
        let unit = if self.scale == 1.0 { String::new() } else { format!(" of `scale` = {}", self.scale) };
        if metres.abs() > FARTHEST {
            return Some(format!("within {} [m{unit}] of the middle, as every length", own(FARTHEST)));
        }
        let bounds = Bounds::of(schema)?;
        let size = bounds.minimum.or(bounds.above).is_some_and(|least| least >= 0.0);
        let zero = if bounds.minimum == Some(0.0) { "0, or " } else { "" };
        (size && metres > 0.0 && metres < SMALLEST)
            .then(|| format!("{zero}at least {} [m{unit}], as every size", own(SMALLEST)))
    }

    /// What a schema allows here, in the table's own units.
    fn describe(&self, schema: &Json) -> String {
        Words { root: self.root, scale: self.scale }.schema(schema, self.unit, 0)
    }

    fn text(&mut self, schema: &Json, text: &str, place: &Span, path: &Path) {
        let length = text.chars().count() as u64;
        let least = schema.get("minLength").and_then(Json::as_u64).unwrap_or(0);
        let most = schema.get("maxLength").and_then(Json::as_u64).unwrap_or(u64::MAX);
        if length < least {
            let problem = if length == 0 {
                "must not be empty".to_owned()
            } else {
                format!("must have at least {least} characters")
            };
            self.fault(place.clone(), path, problem, None);
        } else if length > most {
            self.fault(place.clone(), path, format!("has {length} characters; the limit is {most}"), None);
        }
        let color = schema.get("pattern").and_then(Json::as_str) == Some(COLOR);
        if color && parse_color(text).is_none() {
            self.fault(
                place.clone(),
                path,
                format!("is {text:?}, but must be a colour like \"#F4F4F0\""),
                None,
            );
        }
    }

    fn array(&mut self, schema: &'a Json, elements: &[Node], place: &Span, path: &Path, depth: usize) {
        let count = elements.len() as u64;
        let least = schema.get("minItems").and_then(Json::as_u64).unwrap_or(0);
        let most = schema.get("maxItems").and_then(Json::as_u64).unwrap_or(u64::MAX);
        if count < least || count > most {
            let problem = if least == most {
                format!("has {count} elements, but must have {least}")
            } else if count < least {
                format!("has {count} elements, but must have at least {least}")
            } else {
                format!("has {count} elements; the limit is {most}")
            };
            self.fault(place.clone(), path, problem, None);
            if count > most {
                return;
            }
        }
        let firsts = schema.get("prefixItems").and_then(Json::as_array);
        let rest = schema.get("items");
        for (at, element) in elements.iter().enumerate() {
            let rule = firsts.and_then(|rules| rules.get(at)).or(rest);
            if let Some(rule) = rule {
                self.value(rule, element, element.span.clone(), &path.index(at), depth);
            }
            if self.faults.len() >= MOST_FAULTS {
                return;
            }
        }
    }

    fn table(&mut self, schema: &'a Json, node: &Node, place: &Span, path: &Path, depth: usize) {
        let known = schema.get("properties").and_then(Json::as_object);
        // What misspelt keys were meant to be: that these are missing need not be said, too.
        let mut meant = Vec::new();
        for entry in node.entries() {
            let inner = path.key(&entry.key);
            let whole = matches!(entry.node.value, Value::Table(_));
            let place = if whole { entry.key_span.clone() } else { entry.node.span.clone() };
            if let Some(rule) = known.and_then(|known| known.get(&entry.key)) {
                self.value(rule, &entry.node, place, &inner, depth);
                continue;
            }
            match schema.get("additionalProperties") {
                Some(Json::Bool(false)) => {
                    let names: Vec<&str> =
                        known.into_iter().flat_map(|known| known.keys().map(String::as_str)).collect();
                    let near = nearest(&entry.key, names.iter().copied());
                    meant.extend(near);
                    let help = near.map(did_you_mean);
                    let problem = if names.is_empty() {
                        "is not known; no key is allowed here".to_owned()
                    } else {
                        format!("is not known; allowed here: {}", names.join(", "))
                    };
                    self.fault(entry.key_span.clone(), &inner, problem, help);
                }
                Some(rule @ Json::Object(_)) => self.value(rule, &entry.node, place, &inner, depth),
                _ => {}
            }
            if self.faults.len() >= MOST_FAULTS {
                return;
            }
        }
        if self.lenient_depth == Some(path.0.len()) {
            return;
        }
        for name in
            schema.get("required").and_then(Json::as_array).into_iter().flatten().filter_map(Json::as_str)
        {
            if node.entry(name).is_none() && !meant.contains(&name) {
                let rule = known.and_then(|known| known.get(name));
                let allowed = rule.map(|rule| self.describe(rule)).unwrap_or_else(|| "a value".to_owned());
                let here = if path.0.is_empty() { String::new() } else { format!(" of {path}") };
                let problem = format!("the key `{name}`{here} is missing; it must be {allowed}");
                self.fault(place.clone(), path, problem, None);
            }
        }
    }

    /// `anyOf` and `oneOf`: fine when one choice fits; else the faults of the choice that was probably meant.
    fn choice(&mut self, choices: &'a [Json], node: &Node, place: &Span, path: &Path, depth: usize) {
        let try_one = |choice: &'a Json| {
            let mut inner = Checker { faults: Vec::new(), ..*self };
            inner.value(choice, node, place.clone(), path, depth + 1);
            inner.faults
        };
        let mut attempts = Vec::new();
        for choice in choices {
            let faults = try_one(choice);
            if faults.is_empty() {
                return;
            }
            attempts.push((choice, faults));
        }
        // Tables that tell themselves apart by one key with a fixed value in each choice.
        if let (Value::Table(_), Some((tag, values))) = (&node.value, tag_of(self.root, choices)) {
            match node.entry(&tag) {
                None => {
                    let problem = format!("the key `{tag}` is missing; it must be {}", quoted(&values));
                    self.fault(place.clone(), path, problem, None);
                }
                Some(entry) => {
                    let said = entry.node.as_str().unwrap_or_default();
                    match values.iter().position(|value| value == said) {
                        Some(at) => {
                            if let Some((_, faults)) = attempts.into_iter().nth(at) {
                                self.faults.extend(faults);
                            }
                        }
                        None => {
                            let help = nearest(said, values.iter().map(String::as_str)).map(did_you_mean);
                            let json = entry.node.to_json();
                            let problem = format!("is {json}, but must be {}", quoted(&values));
                            self.fault(entry.node.span.clone(), &path.key(&tag), problem, help);
                        }
                    }
                }
            }
            return;
        }
        // All choices are lists of names (schemars writes an enum whose members have descriptions so).
        let mut names = Vec::new();
        let all_names = choices.iter().map(|choice| deref(self.root, choice)).all(|choice| {
            if choice.get("type").and_then(Json::as_str) == Some("null") {
                return true;
            }
            match (choice.get("const"), choice.get("enum")) {
                (Some(name), _) => names.push(name),
                (_, Some(Json::Array(more))) => names.extend(more),
                _ => return false,
            }
            true
        });
        if all_names && !names.is_empty() {
            let json = node.to_json();
            let words = names.iter().filter_map(|name| name.as_str());
            let help = node.as_str().and_then(|text| nearest(text, words)).map(did_you_mean);
            self.fault(place.clone(), path, format!("is {json}, but must be {}", one_of(&names)), help);
            return;
        }
        // Otherwise the choice of the same kind of value, if there is exactly one.
        let mut same_kind: Vec<_> =
            attempts.into_iter().filter(|(choice, _)| fits_kind(self.root, choice, node)).collect();
        if same_kind.len() == 1 {
            self.faults.extend(same_kind.remove(0).1);
            return;
        }
        let kinds: Vec<String> = choices
            .iter()
            .filter(|choice| choice.get("type").and_then(Json::as_str) != Some("null"))
            .map(|choice| self.describe(choice))
            .collect();
        self.fault(
            place.clone(),
            path,
            format!("is {}, but must be {}", node.kind(), kinds.join(", or ")),
            None,
        );
    }

    fn fault(&mut self, span: Span, path: &Path, problem: String, help: Option<String>) {
        let fault = Fault { span, path: path.clone(), problem, help };
        // Two branches of `allOf` may find the same thing.
        if !self.faults.contains(&fault) {
            self.faults.push(fault);
        }
    }
}

/// What `#/$defs/NAME` refers to.
pub fn resolve<'a>(root: &'a Json, reference: &str) -> Option<&'a Json> {
    let pointer = reference.strip_prefix('#')?;
    if pointer.is_empty() { Some(root) } else { root.pointer(pointer) }
}

/// The schema itself behind a chain of references.
pub fn deref<'a>(root: &'a Json, schema: &'a Json) -> &'a Json {
    let mut schema = schema;
    for _ in 0..DEEPEST_REFERENCE {
        match schema.get("$ref").and_then(Json::as_str).and_then(|target| resolve(root, target)) {
            Some(target) => schema = target,
            None => break,
        }
    }
    schema
}

/// The key whose fixed value tells the choices apart, and that value for each choice.
pub fn tag_of(root: &Json, choices: &[Json]) -> Option<(String, Vec<String>)> {
    let fixed = |choice: &Json, key: &str| {
        deref(root, choice).get("properties")?.get(key)?.get("const")?.as_str().map(str::to_owned)
    };
    let first = deref(root, choices.first()?).get("properties")?.as_object()?;
    first.keys().find_map(|key| {
        let values: Option<Vec<_>> = choices.iter().map(|choice| fixed(choice, key)).collect();
        Some((key.clone(), values?))
    })
}

fn fits_kind(root: &Json, schema: &Json, node: &Node) -> bool {
    let schema = deref(root, schema);
    let wanted = match &node.value {
        Value::Bool(_) => ["boolean", "boolean"],
        Value::Integer(_) => ["integer", "number"],
        Value::Float(_) => ["number", "number"],
        Value::String(_) => ["string", "string"],
        Value::Array(_) => ["array", "array"],
        Value::Table(_) => ["object", "object"],
    };
    match schema.get("type") {
        Some(Json::String(name)) => wanted.contains(&name.as_str()),
        Some(Json::Array(names)) => names.iter().filter_map(Json::as_str).any(|name| wanted.contains(&name)),
        _ => ["anyOf", "oneOf"].iter().any(|word| {
            let choices = schema.get(*word).and_then(Json::as_array);
            choices.is_some_and(|choices| choices.iter().any(|choice| fits_kind(root, choice, node)))
        }),
    }
}
