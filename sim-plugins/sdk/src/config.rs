//! The scene's configuration on its way into `create`.

use schemars::{JsonSchema, Schema, generate::SchemaSettings};
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

use crate::error::ConfigError;

/// What the scene says to every module.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SceneInfo {
    /// Name of the scene.
    pub name: String,
    /// Seed of everything random.
    pub seed: u64,
    /// Metres per unit of the scene's lengths. The host has used it: where the schema of a configuration
    /// names a unit (`x-unit`), the number that comes is in metres.
    pub scale: f64,
    /// The fixed step [s].
    pub dt: f64,
    /// Tables of species by name, as the scene's `species` files say.
    pub species: Map<String, Value>,
}

/// The fixed part of `"scene"`.
#[derive(serde::Deserialize)]
#[serde(default)]
struct Scene {
    name: String,
    seed: u64,
    scale: f64,
    dt: f64,
}

impl Default for Scene {
    fn default() -> Self {
        Self { name: String::new(), seed: 0, scale: 1.0, dt: 1.0 / 60.0 }
    }
}

impl SceneInfo {
    /// The table of a species as a type of the plugin's own. The error's path is `species.NAME.key`.
    pub fn species<S: DeserializeOwned>(&self, name: &str) -> Result<S, ConfigError> {
        let Some(table) = self.species.get(name) else {
            let known: Vec<&str> = self.species.keys().map(String::as_str).collect();
            let known = if known.is_empty() { "none is known".into() } else { known.join(", ") };
            return Err(ConfigError::new("", format!("unknown species `{name}`; allowed: {known}")));
        };
        from_value(table.clone()).map_err(|error| error.within(&format!("species.{name}")))
    }

    /// The same for the key at `path` of the configuration, which names the species: an unknown name is its
    /// fault. Errors inside of a species keep their own path.
    pub fn species_at<S: DeserializeOwned>(&self, name: &str, path: &str) -> Result<S, ConfigError> {
        self.species(name).map_err(|error| {
            if error.path.is_empty() { ConfigError::new(path, error.message) } else { error }
        })
    }
}

/// Tells the schema of a module's table what a species is made of, for `#[schemars(transform =
/// describe_species::<Species>)]`: the scene's reader holds species files against it.
pub fn describe_species<S: JsonSchema>(schema: &mut Schema) {
    schema.insert("x-species".to_owned(), species_schema::<S>().to_value());
}

/// The schema of a species, in one piece.
pub fn species_schema<S: JsonSchema>() -> Schema {
    let settings = SchemaSettings::draft2020_12().with(|settings| settings.inline_subschemas = true);
    settings.into_generator().into_root_schema_for::<S>()
}

/// Reads the JSON object `{"scene": …, "species": …, "config": …}`.
pub(crate) fn parse<C: DeserializeOwned>(json: &[u8]) -> Result<(SceneInfo, C), ConfigError> {
    let whole: Value = serde_json::from_slice(json)
        .map_err(|error| ConfigError::new("", format!("the configuration is not valid JSON: {error}")))?;
    let Value::Object(mut whole) = whole else {
        return Err(ConfigError::new("", "the configuration must be a JSON object"));
    };
    let mut take = |key: &str| match whole.remove(key) {
        None | Some(Value::Null) => Value::Object(Map::new()),
        Some(value) => value,
    };
    let scene: Scene = from_value(take("scene")).map_err(|error| error.within("scene"))?;
    let Value::Object(species) = take("species") else {
        return Err(ConfigError::new("species", "must be a table of species"));
    };
    let config = from_value(take("config"))?;
    Ok((SceneInfo { name: scene.name, seed: scene.seed, scale: scene.scale, dt: scene.dt, species }, config))
}

/// Deserialises and keeps the path to what is wrong.
fn from_value<T: DeserializeOwned>(value: Value) -> Result<T, ConfigError> {
    serde_path_to_error::deserialize(value).map_err(|error| {
        let path = match error.path().to_string() {
            path if path == "." => String::new(),
            path => path,
        };
        ConfigError::new(path, error.into_inner().to_string())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Plant {
        species: String,
    }

    #[derive(Debug, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Bed {
        plants: Vec<Plant>,
    }

    #[test]
    fn an_error_begins_with_the_path_in_the_config() {
        let json = br#"{"config": {"plants": [{"species": "a"}, {"species": 7}]}}"#;
        let error = parse::<Bed>(json).unwrap_err();
        assert_eq!(error.path, "plants[1].species");
        assert!(error.to_string().starts_with("plants[1].species: invalid type"), "{error}");
        let json = br#"{"config": {"plants": [{"spezies": "a"}]}}"#;
        assert!(parse::<Bed>(json).unwrap_err().to_string().contains("unknown field `spezies`"));
        let error = parse::<Bed>(b"{\"config\": {}}").unwrap_err();
        assert_eq!(error.to_string(), "missing field `plants`");
    }

    #[test]
    fn the_scene_reaches_the_plugin_and_has_defaults() {
        let json =
            br#"{"scene": {"name": "x", "seed": 18446744073709551615}, "species": {"a": {"species": "b"}},
                        "config": {"plants": []}}"#;
        let (scene, bed) = parse::<Bed>(json).unwrap();
        assert_eq!((scene.name.as_str(), scene.seed, scene.scale), ("x", u64::MAX, 1.0));
        assert!(bed.plants.is_empty());
        assert_eq!(scene.species::<Plant>("a").unwrap().species, "b");
        assert_eq!(scene.species::<Plant>("c").unwrap_err().message, "unknown species `c`; allowed: a");
        assert_eq!(scene.species::<Bed>("a").unwrap_err().path, "species.a.species");
        let path = |name: &str| scene.species_at::<Bed>(name, "plants[0].species").unwrap_err().path;
        assert_eq!([path("c"), path("a")], ["plants[0].species", "species.a.species"]);
    }

    #[test]
    fn what_is_no_object_is_refused() {
        assert!(parse::<Bed>(b"[]").unwrap_err().message.contains("JSON object"));
        assert!(parse::<Bed>(b"{").unwrap_err().message.contains("not valid JSON"));
        assert!(parse::<Bed>(b"").unwrap_err().message.contains("not valid JSON"));
    }
}
