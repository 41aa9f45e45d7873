//! Every number of the schemas at the ends of its range and between them, alone and in pairs.

use reef_flow::random::Random;
use reef_sea::scene::{bounds::Bounds, check::deref};
use serde_json::{Map, Value as Json, json};

use crate::{
    random::Choose,
    sea::{self, MODULES},
};

/// No number of a scene is greater.
const LARGEST: f64 = 1e15;
/// Steps that a sea makes whose numbers were taken.
const STEPS: usize = 3;
/// Whole numbers up to here cost little, as a count of things.
const FEW: f64 = 60.0;
/// References and tables in one another at most.
const DEEPEST: usize = 24;

/// What leads to a number in what a schema describes.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Way {
    Key(String),
    Item(usize),
    Choice(usize),
}

/// A number of a schema.
#[derive(Clone, Debug)]
pub struct Leaf {
    way: Vec<Way>,
    least: f64,
    most: f64,
    whole: bool,
}

/// A schema, what else the scene is, and where in it the schema's table stands.
#[derive(Clone, Debug)]
pub struct Subject {
    /// For people.
    pub name: String,
    schema: Json,
    scene: Json,
    place: Vec<String>,
    /// Its numbers.
    pub leaves: Vec<Leaf>,
}

/// The scene's own keys; configuration, species and parameters of each module.
///
/// # Panics
/// When a model has no schema.
pub fn subjects() -> Vec<Subject> {
    let mut all = Vec::new();
    let mut add = |name: String, schema: Json, scene: Json, place: &[&str]| {
        let mut leaves = Vec::new();
        collect(&schema, &schema, &mut Vec::new(), 0, &mut leaves);
        let place = place.iter().map(|key| (*key).to_owned()).collect();
        all.push(Subject { name, schema, scene, place, leaves });
    };
    let plain = |scene: toml::Table| serde_json::to_value(scene).expect("plain data");
    let scene = sea::SMALL.parse().expect("TOML of this folder");
    add("scene".to_owned(), reef_sea::scene::format::schema(), plain(scene), &[]);
    for module in MODULES {
        let mut scene = module.scene();
        if !module.species.is_empty() {
            let base = toml::Table::from_iter([("base".to_owned(), module.species.into())]);
            scene = sea::with_species(scene, base);
        }
        let (id, scene) = (module.id(), plain(scene));
        let info = sea::models().get(&id).expect("a linked model").info();
        let schema = info.config_schema.clone().expect("a schema");
        if let Some(species) = reef_sea::scene::species_schema(&schema) {
            add(format!("{id} species"), species.clone(), scene.clone(), &["species", "s"]);
        }
        let params: Map<String, Json> = info
            .params
            .iter()
            .filter(|param| param.kind == reef_plugin::ParamKind::Float)
            .map(|p| (p.key.clone(), json!({ "type": "number", "minimum": p.minimum, "maximum": p.maximum })))
            .collect();
        let params = json!({ "type": "object", "properties": params });
        add(format!("{id} parameters"), params, scene.clone(), &["modules", "m", "params"]);
        add(id, schema, scene, &["modules", "m"]);
    }
    all
}

fn choices(schema: &Json) -> Option<&Vec<Json>> {
    ["anyOf", "oneOf"].iter().find_map(|word| schema.get(word)).and_then(Json::as_array)
}

fn is(schema: &Json, kind: &str) -> bool {
    match schema.get("type") {
        Some(Json::String(name)) => name == kind,
        Some(Json::Array(names)) => names.iter().any(|name| name == kind),
        _ => false,
    }
}

fn collect(root: &Json, schema: &Json, way: &mut Vec<Way>, depth: usize, found: &mut Vec<Leaf>) {
    let schema = deref(root, schema);
    if depth > DEEPEST {
        return;
    }
    let mut inner = |step: Way, schema: &Json, way: &mut Vec<Way>| {
        way.push(step);
        collect(root, schema, way, depth + 1, found);
        way.pop();
    };
    for (at, choice) in choices(schema).into_iter().flatten().enumerate() {
        inner(Way::Choice(at), choice, way);
    }
    for (key, property) in schema.get("properties").and_then(Json::as_object).into_iter().flatten() {
        inner(Way::Key(key.clone()), property, way);
    }
    for (at, item) in schema.get("prefixItems").and_then(Json::as_array).into_iter().flatten().enumerate() {
        inner(Way::Item(at), item, way);
    }
    if let Some(items) = schema.get("items") {
        let last = schema.get("minItems").and_then(Json::as_u64).unwrap_or(1).saturating_sub(1) as usize;
        inner(Way::Item(0), items, way);
        if last > 0 {
            inner(Way::Item(last), items, way);
        }
    }
    let whole = is(schema, "integer");
    if whole || is(schema, "number") {
        let bounds = Bounds::of(schema).unwrap_or_default();
        let least = bounds.minimum.or(bounds.above).unwrap_or(-LARGEST);
        let most = bounds.maximum.or(bounds.below).unwrap_or(LARGEST);
        found.push(Leaf { way: way.clone(), least, most, whole });
    }
}

/// The least that a schema takes. `key`: what it is of.
fn least(root: &Json, schema: &Json, key: &str, depth: usize) -> Json {
    let schema = deref(root, schema);
    if let Some(default) = schema.get("default").filter(|default| !default.is_null()) {
        return default.clone();
    }
    if let Some(value) = schema.get("const").or_else(|| schema.get("enum")?.get(0)) {
        return value.clone();
    }
    if depth > DEEPEST {
        return Json::Null;
    }
    if let Some(choice) = choices(schema).and_then(|choices| choices.first()) {
        return least(root, choice, key, depth + 1);
    }
    if schema.get("properties").is_some() || is(schema, "object") {
        let required = schema.get("required").and_then(Json::as_array).into_iter().flatten();
        let entry = |name: &Json| {
            let name = name.as_str()?;
            Some((name.to_owned(), least(root, schema.get("properties")?.get(name)?, name, depth + 1)))
        };
        return Json::Object(required.filter_map(entry).collect());
    }
    if is(schema, "array") {
        let count = schema.get("minItems").and_then(Json::as_u64).unwrap_or(0) as usize;
        let item = |at: usize| {
            let rule = schema.get("prefixItems").and_then(|rules| rules.get(at)).or(schema.get("items"));
            rule.map_or(Json::Null, |rule| least(root, rule, key, depth + 1))
        };
        let count = if key == "species" { count.max(1) } else { count };
        return Json::Array((0..count).map(item).collect());
    }
    let bounds = Bounds::of(schema).unwrap_or_default();
    match () {
        () if is(schema, "integer") => json!(bounds.minimum.unwrap_or(1.0) as i64),
        () if is(schema, "number") => {
            json!(1.0_f64.clamp(bounds.minimum.unwrap_or(-LARGEST), bounds.maximum.unwrap_or(LARGEST)))
        }
        () if is(schema, "boolean") => json!(false),
        () if schema.get("pattern").is_some() => json!("#808080"),
        () if key == "species" => json!("s"),
        () => json!("m"),
    }
}

/// A value on its way into a table.
struct Placing<'a> {
    root: &'a Json,
    way: &'a [Way],
    /// Ways of values that are there already.
    before: Vec<&'a [Way]>,
    value: Json,
}

impl Placing<'_> {
    /// Whether the table at this step of the way is of the choice that the way takes there.
    fn is_chosen(&self, at: usize) -> bool {
        let here = self.before.iter().rev().find(|other| other.get(..at) == self.way.get(..at));
        here.is_some_and(|other| other.get(at) == self.way.get(at))
    }

    /// Puts the value where its way leads from a step on, and makes what is missing on it.
    fn put(&self, schema: &Json, here: Json, key: &str, at: usize) -> Json {
        let root = self.root;
        let schema = deref(root, schema);
        let Some(step) = self.way.get(at) else { return self.value.clone() };
        match step {
            Way::Choice(number) => {
                let choice = choices(schema).and_then(|choices| choices.get(*number)).unwrap_or(&Json::Null);
                let here = if self.is_chosen(at) { here } else { least(root, choice, key, 0) };
                self.put(choice, here, key, at + 1)
            }
            Way::Key(name) => {
                let property = schema.get("properties").and_then(|all| all.get(name)).unwrap_or(&Json::Null);
                let made = if here.is_object() { here } else { least(root, schema, key, 0) };
                let mut table = made.as_object().cloned().unwrap_or_default();
                let inner = table.remove(name).unwrap_or_else(|| least(root, property, name, 0));
                table.insert(name.clone(), self.put(property, inner, name, at + 1));
                Json::Object(table)
            }
            Way::Item(number) => {
                let rules = schema.get("prefixItems").and_then(|rules| rules.get(*number));
                let rule = rules.or(schema.get("items")).unwrap_or(&Json::Null);
                let mut list = here.as_array().cloned().unwrap_or_default();
                while list.len() <= *number {
                    list.push(least(root, rule, key, 0));
                }
                let inner = std::mem::take(&mut list[*number]);
                list[*number] = self.put(rule, inner, key, at + 1);
                Json::Array(list)
            }
        }
    }
}

impl Leaf {
    /// The number's key, as a scene calls it.
    pub fn name(&self) -> String {
        let part = |step: &Way| match step {
            Way::Key(key) => format!(".{key}"),
            Way::Item(at) => format!("[{at}]"),
            Way::Choice(at) => format!("({at})"),
        };
        self.way.iter().map(part).collect::<String>().trim_start_matches('.').to_owned()
    }

    /// The ends of the range, and what lies just inside of them.
    fn ends(&self) -> Vec<f64> {
        let Self { least, most, whole, .. } = *self;
        let inside = |x: &f64| (least..=most).contains(x);
        let more: &[f64] = match whole {
            true => &[0.0, 1.0, 2.0],
            false => &[5e-324, 1e-300, 1e-30, 1e-9, 1.1e-9, 1e-5, 0.0, 1.0, 1e5, -1e5, 1e9, 1e14],
        };
        let mut all = vec![least, most];
        all.extend(more.iter().copied().filter(inside));
        all.sort_by(f64::total_cmp);
        all.dedup();
        all
    }

    /// Any number of the range: small ones are as likely as great ones.
    fn any(&self, random: &mut Random) -> f64 {
        let Self { least, most, whole, .. } = *self;
        if whole {
            let most = most.min(least.max(0.0) + FEW);
            return (least.max(-FEW) + random.unit() * (most - least.max(-FEW))).floor();
        }
        if random.below(3) == 0 && most - least < 1e12 {
            return least + random.unit() * (most - least);
        }
        let size = 10_f64.powf(random.unit() * 24.0 - 12.0);
        let signed = if random.below(2) == 0 { size } else { -size };
        let from = if least.is_finite() && least > -LARGEST { least } else { 0.0 };
        (from + signed).clamp(least, most)
    }

    /// Whether so great a number is one of very many things, whose sea is not made in a moment.
    fn is_slow(&self, value: f64) -> bool {
        self.whole && value > FEW && !self.name().ends_with("seed")
    }

    fn json(&self, value: f64) -> Json {
        match self.whole {
            true => json!(value.clamp(i64::MIN as f64, i64::MAX as f64) as i64),
            false => json!(value),
        }
    }
}

/// Numbers to be tried together: the leaf's index and the value.
pub type Case = Vec<(usize, f64)>;

impl Subject {
    /// All ends of all ranges, one at a time. `slow`: with those of very many things.
    pub fn singles(&self, slow: bool) -> Vec<Case> {
        let mut all = Vec::new();
        for (at, leaf) in self.leaves.iter().enumerate() {
            let ends = leaf.ends().into_iter().filter(|value| slow || !leaf.is_slow(*value));
            all.extend(ends.map(|value| vec![(at, value)]));
        }
        all
    }

    /// One number, or two, at an end or anywhere.
    pub fn some(&self, random: &mut Random) -> Case {
        let mut case = Case::new();
        for _ in 0..1 + random.below(2) {
            let at = random.below(self.leaves.len());
            let leaf = &self.leaves[at];
            let ends: Vec<f64> = leaf.ends().into_iter().filter(|value| !leaf.is_slow(*value)).collect();
            let value = match random.below(2) {
                0 => random.one(&ends).copied(),
                _ => None,
            };
            case.push((at, value.unwrap_or_else(|| leaf.any(random))));
        }
        case
    }

    /// The scene's text with these numbers.
    ///
    /// # Panics
    /// When JSON is no TOML.
    pub fn text(&self, case: &Case) -> String {
        let mut scene = self.scene.clone();
        let mut table = &mut scene;
        for key in &self.place {
            let Json::Object(map) = table else { unreachable!("a scene is made of tables") };
            table = map.entry(key.clone()).or_insert_with(|| json!({}));
        }
        let mut here = std::mem::take(table);
        let way = |(at, _): &(usize, f64)| self.leaves[*at].way.as_slice();
        for (number, part) in case.iter().enumerate() {
            let before = case[..number].iter().map(way).collect();
            let value = self.leaves[part.0].json(part.1);
            let placing = Placing { root: &self.schema, way: way(part), before, value };
            here = placing.put(&self.schema, here, "", 0);
        }
        *table = here;
        let table = toml::Table::try_from(without_nulls(scene)).expect("a scene is a table");
        table.to_string()
    }

    /// What a case is, in words.
    pub fn words(&self, case: &Case) -> String {
        let part = |(at, value): &(usize, f64)| format!("{} = {value:e}", self.leaves[*at].name());
        format!("{}: {}", self.name, case.iter().map(part).collect::<Vec<_>>().join(", "))
    }

    /// Tries these numbers. `Err`: neither an answer with a place nor a finite sea.
    pub fn attempt(&self, case: &Case) -> Result<(), String> {
        let text = self.text(case);
        let ended = std::panic::catch_unwind(|| sea::live(&text, STEPS));
        match ended {
            Ok(Ok(())) => Ok(()),
            Ok(Err(problem)) => Err(format!("{}: {problem}", self.words(case))),
            Err(_) => Err(format!("{}: a panic", self.words(case))),
        }
    }
}

fn without_nulls(value: Json) -> Json {
    match value {
        Json::Object(table) => {
            table.into_iter().filter(|(_, v)| !v.is_null()).map(|(k, v)| (k, without_nulls(v))).collect()
        }
        Json::Array(list) => list.into_iter().map(without_nulls).collect(),
        other => other,
    }
}
