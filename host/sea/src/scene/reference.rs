//! The reference of scene files for people, made from the same types and schemas that check them.

use std::fmt::Write;

use reef_plugin::PluginInfo;
use serde_json::{Map, Value as Json};

use super::{
    bounds::Bounds,
    check::{deref, tag_of},
    format, schema, species_schema,
    words::describe,
};

/// The complete scene of the introduction; a test loads and steps it.
pub const EXAMPLE: &str = include_str!("example.toml");

/// Name of the definition of keyframes in the schema begins so.
const KEYS: &str = "Keys";

/// The whole reference.
pub fn markdown<'a>(plugins: impl Iterator<Item = &'a PluginInfo>) -> String {
    let root = format::schema();
    let mut out = introduction();
    let properties = root.get("properties").and_then(Json::as_object).cloned().unwrap_or_default();
    for (key, rule) in &properties {
        if key == "modules" || key == "species" {
            continue;
        }
        let (title, table) = titled(&root, key, rule);
        section(&mut out, &root, &title, &table, 2);
    }
    keyframes(&mut out, &root);
    species_and_modules(&mut out);
    let mut any = false;
    for plugin in plugins {
        any = true;
        module(&mut out, plugin);
    }
    if !any {
        out.push_str("No plugin was found when this page was made.\n");
    }
    // One blank line between blocks, one newline at the end.
    while out.contains("\n\n\n") {
        out = out.replace("\n\n\n", "\n\n");
    }
    out.trim_end().to_owned() + "\n"
}

fn introduction() -> String {
    format!(
        "# Scenes\n\n\
         <!-- Made from the code by `reef scene reference`. To renew it: REEF_BLESS=1 cargo test -p reef-tests reference -->\n\n\
         A scene is a [TOML](https://toml.io) file: what is in the sea, what moves the water, how it is lit and looked at. \
         Every key has a default, so a scene says only what it wants different. Lengths are metres, times seconds, y points up, \
         still water is at y = 0 and the bed around y = −depth.\n\n\
         ```toml\n{EXAMPLE}```\n\n\
         Save it as `first.toml`, then\n\n\
         | command | does |\n|---|---|\n\
         | `reef first.toml` | opens it in a window |\n\
         | `reef scene check first.toml` | says what is wrong with it, with line and column |\n\
         | `reef render first.toml --out first.png` | makes a picture |\n\
         | `reef sim first.toml --steps 600 --record first.csv` | steps it without a GPU and writes down where everything was |\n\
         | `reef scene schema > scene.schema.json` | a JSON Schema with which editors complete and check keys |\n\n\
         A key that is not known, a value of the wrong type or out of its range is an error that names the file, the line, what is \
         allowed and the nearest spelling. Numbers must be finite and below 1e15, lengths at most 100 km, and sizes 0 or at least 1 nm. \
         A file may have 4 MiB.\n\n\
         In the tables below, **unit** is what a number is in. A scene that sets `scale` (metres per unit) writes all lengths in \
         units of its own, defaults included: m then stands for that unit, in m/s, m³/s, 1/m and 1/m³, too. What is allowed is \
         allowed in metres, after that; an error tells it in the scene's units. Units of matter (kg/m³, N, N/m, Pa·s) stay as they \
         are. Species in assets/species, and what no table of a species says, are in metres for every scene.\n"
    )
}

/// Heading and schema of a key's table: `[scene]` for one table, `[[flow]]` for a list of them.
fn titled(root: &Json, key: &str, rule: &Json) -> (String, Json) {
    let target = solid(root, rule);
    match target.get("items") {
        Some(items) => (format!("[[{key}]]"), with_description(deref(root, items), rule, target)),
        None => (format!("[{key}]"), with_description(target, rule, target)),
    }
}

/// A schema with the description that stands nearest to its use.
fn with_description(schema: &Json, near: &Json, far: &Json) -> Json {
    let mut schema = schema.clone();
    let words = near.get("description").or_else(|| far.get("description")).cloned();
    if let (Some(table), Some(words)) = (schema.as_object_mut(), words) {
        table.insert("description".to_owned(), words);
    }
    schema
}

/// Behind references, and behind "or null".
fn solid<'a>(root: &'a Json, schema: &'a Json) -> &'a Json {
    let schema = deref(root, schema);
    if let Some(choices) = schema.get("anyOf").and_then(Json::as_array) {
        let mut real =
            choices.iter().filter(|choice| choice.get("type").and_then(Json::as_str) != Some("null"));
        if let (Some(one), None) = (real.next(), real.next()) {
            return deref(root, one);
        }
    }
    schema
}

/// A table's description, its keys, then the tables within.
fn section(out: &mut String, root: &Json, title: &str, schema: &Json, level: usize) {
    let level = level.min(6);
    let _ = writeln!(out, "\n{} `{title}`\n", "#".repeat(level));
    if let Some(words) = schema.get("description").and_then(Json::as_str) {
        let _ = writeln!(out, "{}\n", plain(words));
    }
    let variants = ["oneOf", "anyOf"].iter().find_map(|word| schema.get(*word).and_then(Json::as_array));
    if let Some((variants, (tag, values))) = variants.and_then(|list| Some((list, tag_of(root, list)?))) {
        for (variant, value) in variants.iter().zip(values) {
            let mut merged = deref(root, variant).clone();
            merge_reference(root, variant, &mut merged);
            section(out, root, &format!("{title} {tag} = \"{value}\""), &merged, level + 1);
        }
        return;
    }
    let Some(properties) = schema.get("properties").and_then(Json::as_object) else { return };
    rows(out, root, schema, properties);
    for (key, rule) in properties {
        for (title, table) in inner_tables(root, title, key, rule) {
            section(out, root, &title, &table, level + 1);
        }
    }
}

/// A variant that is its tag beside a reference: both tables' keys together.
fn merge_reference(root: &Json, variant: &Json, merged: &mut Json) {
    let Some(target) = variant.get("$ref") else { return };
    let target = deref(root, &serde_json::json!({ "$ref": target })).clone();
    let mut properties = variant.get("properties").and_then(Json::as_object).cloned().unwrap_or_default();
    properties.extend(target.get("properties").and_then(Json::as_object).cloned().unwrap_or_default());
    let lists =
        [variant, &target].into_iter().filter_map(|schema| schema.get("required")?.as_array().cloned());
    let required: Vec<Json> = lists.flatten().collect();
    let words = variant.get("description").or_else(|| target.get("description")).cloned();
    *merged = serde_json::json!({ "properties": properties, "required": required, "description": words });
}

/// The tables that stand under a key, keyframes left out (they have a chapter of their own).
fn inner_tables(root: &Json, title: &str, key: &str, rule: &Json) -> Vec<(String, Json)> {
    let name = title.trim_matches(['[', ']']);
    let name = name.split("]]").next().unwrap_or(name);
    let path = format!("{name}.{key}");
    let target = solid(root, rule);
    let is_table = |schema: &Json| {
        schema.get("properties").is_some_and(|known| known.as_object().is_some_and(|k| !k.is_empty()))
    };
    let is_tagged = |schema: &Json| {
        ["oneOf", "anyOf"].iter().any(|word| {
            let list = schema.get(*word).and_then(Json::as_array);
            list.is_some_and(|list| tag_of(root, list).is_some())
        })
    };
    let mut tables = Vec::new();
    if is_table(target) || is_tagged(target) {
        tables.push((format!("[{path}]"), with_description(target, rule, target)));
    } else if let Some(items) = target.get("items") {
        let items = solid(root, items);
        if is_table(items) || is_tagged(items) {
            tables.push((format!("[[{path}]]"), with_description(items, items, rule)));
        }
    } else if let Some(choices) = target.get("anyOf").and_then(Json::as_array) {
        for choice in choices.iter().filter(|choice| !is_keys(choice)) {
            let choice = deref(root, choice);
            if is_table(choice) {
                tables.push((format!("[{path}]"), choice.clone()));
            }
        }
    }
    tables
}

fn is_keys(choice: &Json) -> bool {
    let target = choice.get("$ref").and_then(Json::as_str).unwrap_or_default();
    target.strip_prefix("#/$defs/").is_some_and(|name| name.starts_with(KEYS))
}

fn rows(out: &mut String, root: &Json, schema: &Json, properties: &Map<String, Json>) {
    let required: Vec<&str> = schema
        .get("required")
        .and_then(Json::as_array)
        .into_iter()
        .flatten()
        .filter_map(Json::as_str)
        .collect();
    out.push_str("| key | unit | allowed | default | what it does |\n|---|---|---|---|---|\n");
    for (key, rule) in properties {
        let unit = rule.get("x-unit").and_then(Json::as_str).unwrap_or_default();
        let default = match (rule.get("default"), required.contains(&key.as_str())) {
            (_, true) => "*required*".to_owned(),
            (None | Some(Json::Null), _) => "—".to_owned(),
            (Some(value), _) => literal(value),
        };
        let words = rule.get("description").or_else(|| solid(root, rule).get("description"));
        let words = words.and_then(Json::as_str).map(plain);
        let tag =
            || if rule.get("const").is_some() { "Tells the kinds apart.".to_owned() } else { String::new() };
        let words = words.unwrap_or_else(tag);
        let _ = writeln!(out, "| `{key}` | {unit} | {} | {default} | {words} |", allowed(root, rule));
    }
    out.push('\n');
}

/// What a key takes, without the unit, which has a column of its own.
fn allowed(root: &Json, rule: &Json) -> String {
    let mut bare = rule.clone();
    if let Some(table) = bare.as_object_mut() {
        table.shift_remove("x-unit");
    }
    let target = deref(root, &bare);
    let choices = target.get("anyOf").and_then(Json::as_array);
    let text = match choices {
        Some(choices) if choices.iter().any(is_keys) => {
            let fixed: Vec<String> = choices
                .iter()
                .filter(|choice| !is_keys(choice))
                .map(|choice| describe(root, choice))
                .collect();
            let bounds = Bounds::of(rule).map(|bounds| format!(" {}", bounds.words())).unwrap_or_default();
            format!("{}{bounds}, or [keyframes](#keyframes)", fixed.join(", or "))
        }
        _ => describe(root, &bare),
    };
    let inner =
        target.get("items").and_then(Bounds::of).filter(|_| target.get("minItems") == target.get("maxItems"));
    let inner = inner.map(|bounds| format!(", each {}", bounds.words())).unwrap_or_default();
    let most = match (target.get("minItems"), target.get("maxItems").and_then(Json::as_u64)) {
        (least, Some(most)) if least.and_then(Json::as_u64) != Some(most) => format!(", {most} at most"),
        _ => String::new(),
    };
    escape(&format!("{text}{inner}{most}"))
}

/// A value as TOML writes it.
fn literal(value: &Json) -> String {
    let text = match value {
        Json::Array(elements) if elements.is_empty() => "none".to_owned(),
        Json::Object(table) if table.is_empty() => "none".to_owned(),
        Json::Object(_) => return "see below".to_owned(),
        Json::String(text) if text.is_empty() => "\"\"".to_owned(),
        value => value.to_string().replace(',', ", "),
    };
    format!("`{}`", escape(&text))
}

/// Doc comments as one line of Markdown.
fn plain(words: &str) -> String {
    escape(&words.split_whitespace().collect::<Vec<_>>().join(" "))
}

fn escape(text: &str) -> String {
    text.replace('|', "\\|")
}

fn keyframes(out: &mut String, root: &Json) {
    out.push_str(
        "\n## Keyframes\n\n\
         Positions, strengths, axes and the camera take a fixed value, or a table of keyframes:\n\n\
         ```toml\nstrength = { interpolation = \"smooth\", keys = [{ time = 0.0, value = 2.0 }, { time = 4.0, value = -2.0 }] }\n```\n\n",
    );
    let definitions = root.get("$defs").and_then(Json::as_object);
    let keys = definitions.and_then(|all| all.iter().find(|(name, _)| name.starts_with(KEYS)));
    if let Some(properties) = keys.and_then(|(_, keys)| keys.get("properties")?.as_object()) {
        rows(out, root, keys.map_or(&Json::Null, |(_, keys)| keys), properties);
    }
    let key = definitions.and_then(|all| all.iter().find(|(name, _)| *name == "Key"));
    if let Some((_, key)) = key {
        out.push_str("Each of `keys`:\n\n");
        let mut properties = key.get("properties").and_then(Json::as_object).cloned().unwrap_or_default();
        let words = "What the key is worth then: as its fixed value would be written.";
        properties.insert("value".to_owned(), serde_json::json!({ "description": words }));
        rows(out, root, key, &properties);
    }
    let interpolation = definitions.and_then(|all| all.get("Interpolation")?.get("oneOf")?.as_array());
    for choice in interpolation.into_iter().flatten() {
        let name = choice.get("const").and_then(Json::as_str).unwrap_or_default();
        let words = choice.get("description").and_then(Json::as_str).map(plain).unwrap_or_default();
        let _ = writeln!(out, "- `{name}`: {words}");
    }
}

fn species_and_modules(out: &mut String) {
    out.push_str(
        "\n## `[modules.NAME]`\n\n\
         What lives in the sea: one table for each module, under a name of your choice (letters, digits, `-`, `_`). `use` names \
         the plugin, as `reef plugin list` shows it; `params` sets parameters that the panel shows; all other keys are the \
         plugin's own, and follow below. A scene may have 64 modules, several of the same plugin among them.\n\n\
         ## Species\n\n\
         Keys called `species` name a table of parameters: `[species.NAME]` in the scene, or the file `NAME.toml` in \
         assets/species. With `base = \"OTHER\"` a species takes all keys of another that it does not set itself; tables within \
         are merged key by key, lists are replaced whole. A species that is missing or builds on itself is an error; a chain may \
         be 16 species long.\n",
    );
}

fn module(out: &mut String, plugin: &PluginInfo) {
    let _ = writeln!(
        out,
        "\n## Plugin `{}`: {}\n\n{}\n",
        plugin.id,
        plain(&plugin.name),
        plain(&plugin.description)
    );
    if let Some(root) = &plugin.config_schema {
        section(out, root, "[modules.NAME]", root, 3);
        if let Some(species) = species_schema(root) {
            section(out, root, "[species.NAME]", species, 3);
        }
    }
    let params = schema::params(plugin);
    if let Some(properties) =
        params.get("properties").and_then(Json::as_object).filter(|known| !known.is_empty())
    {
        let _ = writeln!(
            out,
            "\n### `[modules.NAME.params]` of `{}`\n\nThey can be changed while the sea runs, too.\n",
            plugin.id
        );
        rows(out, &params, &params, properties);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{AnyPlugin, error::Source, load_text};

    #[test]
    fn the_example_of_the_introduction_is_a_good_scene() {
        let source = Source { name: "example".into(), text: EXAMPLE.into() };
        let path = std::path::Path::new("example.toml");
        let scene = load_text(path, source, path, &AnyPlugin).expect("the example loads");
        assert_eq!((scene.name.as_str(), scene.file.flow.len()), ("First scene", 2));
    }

    #[test]
    fn every_key_of_the_schema_has_a_line_with_words() {
        let text = markdown([].into_iter());
        fn visit(root: &Json, schema: &Json, text: &str, depth: usize) {
            let schema = solid(root, schema);
            for (key, rule) in schema.get("properties").and_then(Json::as_object).into_iter().flatten() {
                if depth > 0 {
                    let line = text.lines().find(|line| line.starts_with(&format!("| `{key}` |")));
                    let line = line.unwrap_or_else(|| panic!("{key} is missing"));
                    assert!(
                        line.rsplit('|').nth(1).is_some_and(|words| words.trim().len() > 5),
                        "no words: {line}"
                    );
                }
                if key != "modules" && key != "species" {
                    visit(root, rule, text, depth + 1);
                }
            }
            for word in ["oneOf", "anyOf"] {
                for choice in schema.get(word).and_then(Json::as_array).into_iter().flatten() {
                    visit(root, choice, text, depth + 1);
                }
            }
            if let Some(items) = schema.get("items") {
                visit(root, items, text, depth + 1);
            }
        }
        let root = format::schema();
        visit(&root, &root, &text, 0);
        for part in [
            "## `[scene]`",
            "### `[[flow]] kind = \"whirlwind\"`",
            "[terrain.ripples]",
            "[[terrain.rock]]",
            "[water.optics]",
        ] {
            assert!(text.contains(part), "{part} is missing");
        }
    }
}
