//! The JSON Schema of scenes with the tables of all plugins in it: what editors complete and underline.

use reef_plugin::{ParamKind, PluginInfo};
use serde_json::{Map, Value as Json, json};

use super::format;

/// The scene's schema, in which a module is one of the plugins.
pub fn merged<'a>(plugins: impl Iterator<Item = &'a PluginInfo>) -> Json {
    let mut schema = format::schema();
    let mut choices = Vec::new();
    let mut definitions = Map::new();
    for plugin in plugins {
        choices.push(module(plugin, &mut definitions));
    }
    if choices.is_empty() {
        return schema;
    }
    if let Some(place) = schema.pointer_mut("/properties/modules/additionalProperties") {
        *place = json!({ "anyOf": choices });
    }
    if let Some(all) = schema.get_mut("$defs").and_then(Json::as_object_mut) {
        all.shift_remove("ModuleTable");
        all.shift_remove("ParamValue");
        all.extend(definitions);
    }
    schema
}

/// The schema of a module that uses a plugin. The plugin's definitions go into `definitions` under names of
/// their own.
fn module(plugin: &PluginInfo, definitions: &mut Map<String, Json>) -> Json {
    let mut schema = plugin.config_schema.clone().unwrap_or_else(|| json!({ "type": "object" }));
    rename(&mut schema, &plugin.id);
    let Json::Object(table) = &mut schema else { return json!(true) };
    table.shift_remove("$schema");
    table.shift_remove("x-species");
    if let Some(Json::Object(own)) = table.shift_remove("$defs") {
        definitions.extend(own.into_iter().map(|(name, value)| (format!("{}.{name}", plugin.id), value)));
    }
    table.insert("title".to_owned(), plugin.name.clone().into());
    table.insert("description".to_owned(), plugin.description.clone().into());
    let properties = table.entry("properties").or_insert_with(|| json!({}));
    if let Json::Object(properties) = properties {
        let used = json!({ "const": plugin.id, "description": "The plugin's id." });
        properties.shift_insert(0, "use".to_owned(), used);
        properties.insert("params".to_owned(), params(plugin));
    }
    let required = table.entry("required").or_insert_with(|| json!([]));
    if let Json::Array(required) = required {
        required.insert(0, "use".into());
    }
    schema
}

/// The schema of a plugin's parameters.
pub fn params(plugin: &PluginInfo) -> Json {
    let properties = plugin.params.iter().map(|param| {
        let mut rule = match param.kind {
            ParamKind::Float => json!({ "type": "number", "minimum": param.minimum, "maximum": param.maximum, "default": param.default }),
            ParamKind::Int => {
                let [minimum, maximum, default] = [param.minimum, param.maximum, param.default].map(|x| x as i64);
                json!({ "type": "integer", "minimum": minimum, "maximum": maximum, "default": default })
            }
            ParamKind::Switch => json!({ "type": "boolean", "default": param.default != 0.0 }),
            ParamKind::Choice => {
                json!({ "enum": param.choices, "default": param.choices.get(param.default as usize) })
            }
        };
        rule["description"] = param.help.clone().into();
        if !param.unit.is_empty() {
            rule["x-unit"] = param.unit.clone().into();
        }
        (param.key.clone(), rule)
    });
    let properties: Map<String, Json> = properties.collect();
    json!({
        "type": "object",
        "description": "Parameters that the panel shows, with other values than their defaults from the start.",
        "properties": properties,
        "additionalProperties": false,
    })
}

/// Leads references to the plugin's definitions to their new names.
fn rename(schema: &mut Json, id: &str) {
    match schema {
        Json::Object(table) => {
            for (key, value) in table.iter_mut() {
                match value {
                    Json::String(target) if key == "$ref" => {
                        if let Some(name) = target.strip_prefix("#/$defs/") {
                            *target = format!("#/$defs/{id}.{name}");
                        }
                    }
                    value => rename(value, id),
                }
            }
        }
        Json::Array(elements) => elements.iter_mut().for_each(|element| rename(element, id)),
        _ => {}
    }
}
