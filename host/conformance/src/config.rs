//! The configuration that checked instances are made with: read as a scene would be, so that what the host
//! refuses never gets to the plugin.

use std::path::{Path, PathBuf};

use reef_files::bounded;
use reef_plugin::PluginInfo;
use reef_sea::scene::{self, Catalogue, error::Source, read::LARGEST_FILE};
use serde_json::{Map, Value};

use super::verdict::Not;

/// What `--config` says.
#[derive(Clone, Debug)]
pub(super) enum Config {
    /// Nothing.
    Nothing,
    /// The module's table.
    Table(Map<String, Value>),
    /// A scene that uses the plugin.
    Scene { path: PathBuf, table: toml::Table },
}

/// The seed of checked instances.
const SEED: u64 = 1;
/// The module's name in the scene that is made around its table.
const MODULE: &str = "checked";

impl Config {
    /// JSON, or the name of a file.
    pub(super) fn read(text: Option<&str>) -> Result<Self, miette::Report> {
        let Some(text) = text else { return Ok(Self::Nothing) };
        if text.trim_start().starts_with('{') {
            return table(text).map_err(|problem| miette::miette!("--config: {problem}"));
        }
        let path = Path::new(text);
        let content = bounded::read_text(path, LARGEST_FILE)
            .map_err(|error| miette::miette!("--config {text}: {error}"))?;
        if path.extension().is_some_and(|ending| ending == "toml") {
            let table = content
                .parse()
                .map_err(|error: toml::de::Error| miette::miette!("--config {text}: {}", error.message()))?;
            return Ok(Self::Scene { path: path.to_owned(), table });
        }
        table(&content).map_err(|problem| miette::miette!("--config {text}: {problem}"))
    }

    /// Did somebody give one?
    pub(super) fn is_given(&self) -> bool {
        !matches!(self, Self::Nothing)
    }

    /// What `create` gets.
    pub(super) fn for_create(&self, info: &PluginInfo, assets: &Path) -> Result<String, Not> {
        let unfit = |problem: String| Not::Configured(problem);
        let (path, table) = match self {
            Self::Nothing => (PathBuf::from("--config"), wrapped(&info.id, &Map::new()).map_err(unfit)?),
            Self::Table(table) => (PathBuf::from("--config"), wrapped(&info.id, table).map_err(unfit)?),
            Self::Scene { path, table } => (path.clone(), without_others(table.clone(), &info.id)),
        };
        let text = toml::to_string(&table).map_err(|error| unfit(error.to_string()))?;
        let source = Source { name: path.display().to_string().into(), text: text.into() };
        let scene =
            scene::load_text(&path, source, assets, &One(info)).map_err(|error| unfit(error.to_string()))?;
        match scene.modules.first() {
            Some(module) => Ok(module.create_json(&scene, SEED)),
            None => Err(unfit(format!("{} uses no plugin {}", path.display(), info.id))),
        }
    }
}

fn table(text: &str) -> Result<Config, String> {
    match serde_json::from_str(text) {
        Ok(Value::Object(table)) => Ok(Config::Table(table)),
        Ok(_) => Err("it must be a JSON object: the module's table".into()),
        Err(error) => Err(format!("it is not JSON: {error}")),
    }
}

/// A scene around a module's table.
fn wrapped(id: &str, table: &Map<String, Value>) -> Result<toml::Table, String> {
    let mut module = toml::Table::try_from(table).map_err(|error| error.to_string())?;
    module.insert("use".into(), id.into());
    let modules = toml::Table::from_iter([(MODULE.to_owned(), module.into())]);
    Ok(toml::Table::from_iter([("modules".to_owned(), modules.into())]))
}

/// The scene with no modules but those of this plugin, and without what is attached to the others.
fn without_others(mut scene: toml::Table, id: &str) -> toml::Table {
    let mut left = Vec::new();
    if let Some(toml::Value::Table(modules)) = scene.get_mut("modules") {
        modules.retain(|_, module| module.get("use").and_then(toml::Value::as_str) == Some(id));
        left = modules.keys().cloned().collect();
    }
    for list in scene.iter_mut().filter_map(|(_, value)| value.as_array_mut()) {
        list.retain(|element| {
            let module = element.get("attach").and_then(|attach| attach.get("module")?.as_str());
            module.is_none_or(|module| left.iter().any(|name| name == module))
        });
    }
    scene
}

/// A catalogue of one.
struct One<'a>(&'a PluginInfo);

impl Catalogue for One<'_> {
    fn plugin(&self, id: &str) -> Result<Option<PluginInfo>, String> {
        Ok((id == self.0.id).then(|| self.0.clone()))
    }

    fn ids(&self) -> Vec<String> {
        vec![self.0.id.clone()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_configuration_is_json_or_a_file_and_nothing_else() {
        assert!(!Config::read(None).unwrap().is_given());
        let Config::Table(table) = Config::read(Some(r#" {"count": 3}"#)).unwrap() else {
            panic!("no table")
        };
        assert_eq!(table["count"], 3);
        for (text, told) in [("{", "it is not JSON"), ("no-such.json", "--config no-such.json")] {
            let report = Config::read(Some(text)).unwrap_err().to_string();
            assert!(report.contains(told), "{report}");
        }
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| {
            let path = folder.path().join(name);
            std::fs::write(&path, text).unwrap();
            path.to_str().unwrap().to_owned()
        };
        assert!(Config::read(Some(&write("a.json", "[1]"))).unwrap_err().to_string().contains("JSON object"));
        let scene = write("a.toml", "[modules.a]\nuse = \"x.y\"\n[modules.b]\nuse = \"x.z\"\n");
        let Config::Scene { table, .. } = Config::read(Some(&scene)).unwrap() else { panic!("no scene") };
        let modules = without_others(table, "x.z");
        assert_eq!(modules["modules"].as_table().unwrap().keys().collect::<Vec<_>>(), ["b"]);
        assert!(Config::read(Some(&write("b.toml", "a = "))).is_err());
    }
}
