//! Scene files: what they may say, and how one is read.
//!
//! A file goes through these stages, and the first that finds a fault ends the way: it is [`read`], parsed
//! into a tree that knows where everything stands ([`document`]), held against the schema of its own keys and
//! those of each module's plugin ([`check`]), its species are put together ([`species`]), and what only makes
//! sense as a whole is looked at last ([`whole`]). What comes out is in metres, whatever unit of length the
//! file counts in ([`mod@scale`]).

pub mod assets;
pub mod bounds;
pub mod catalogue;
pub mod check;
pub mod document;
pub mod error;
pub mod flow_tables;
pub mod format;
pub mod keyed;
mod param;
pub mod read;
pub mod reference;
pub mod scale;
pub mod schema;
pub mod species;
pub mod terrain_tables;
pub mod unit;
pub mod wave_tables;
pub mod whole;
pub mod words;

use std::{
    collections::BTreeMap,
    path::{Path as FilePath, PathBuf},
};

use reef_plugin::{ParamInfo, PluginInfo};
use serde_json::{Map, Value as Json, json};

use self::{
    check::{Terms, check},
    document::{Node, Path, Value},
    error::{Fault, SceneError, Source},
    format::SceneFile,
    param::Param,
    scale::{Defaults, in_metres},
    species::{Library, Mention, Species, check_species},
    words::{did_you_mean, nearest},
};

/// Where the loader learns about plugins.
pub trait Catalogue {
    /// What is known of a plugin. `Err`: why it cannot be used. `Ok(None)`: there is none with this id.
    fn plugin(&self, id: &str) -> Result<Option<PluginInfo>, String>;
    /// The ids of all plugins.
    fn ids(&self) -> Vec<String>;
}

/// A catalogue in which every plugin exists and takes everything: for looking at a scene without its plugins.
#[derive(Clone, Copy, Debug, Default)]
pub struct AnyPlugin;

impl Catalogue for AnyPlugin {
    fn plugin(&self, _id: &str) -> Result<Option<PluginInfo>, String> {
        Ok(Some(PluginInfo::default()))
    }

    fn ids(&self) -> Vec<String> {
        Vec::new()
    }
}

/// A scene that was read and found sound.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Its file.
    pub path: PathBuf,
    /// Its name.
    pub name: String,
    /// What the file says, with defaults, all lengths in metres.
    pub file: SceneFile,
    /// Its modules, in the order of the file.
    pub modules: Vec<Module>,
    /// All files that were read for it: what a change of makes reading it again worthwhile.
    pub files: Vec<PathBuf>,
    /// The folder of assets: modules' own files are in it, too.
    pub assets: PathBuf,
}

/// A module of a scene.
#[derive(Clone, Debug)]
pub struct Module {
    /// Its name in the scene.
    pub name: String,
    /// The plugin's id.
    pub plugin: String,
    /// Parameters that the scene sets, in metres: number and value.
    pub params: Vec<(u32, f64)>,
    /// The plugin's own keys, in metres.
    pub config: Json,
    /// Species that it names, by name.
    pub species: BTreeMap<String, Species>,
    source: Source,
    node: Node,
    key: Path,
    /// What to say where the plugin refuses a length.
    remark: Option<String>,
}

impl Module {
    /// The configuration that the plugin's `create` gets.
    pub fn create_json(&self, scene: &Scene, seed: u64) -> String {
        let species: Map<String, Json> =
            self.species.iter().map(|(name, species)| (name.clone(), species.table.clone().into())).collect();
        let file = &scene.file.scene;
        json!({
            "scene": { "name": scene.name, "seed": seed, "scale": file.scale, "dt": file.dt },
            "species": species,
            "config": self.config,
        })
        .to_string()
    }

    /// What the plugin's `create` said about its configuration (`anemones[3].species: …`), at the place in
    /// the file.
    pub fn create_error(&self, message: &str) -> SceneError {
        if let Some((path, problem)) = message.split_once(": ")
            && let Some(path) = Path::parse(path.trim_start_matches("config."))
        {
            let in_species = match path.0.as_slice() {
                [document::Segment::Key(top), document::Segment::Key(name), rest @ ..]
                    if top == "species" =>
                {
                    self.species.get(name).map(|species| (species, Path(rest.to_vec())))
                }
                _ => None,
            };
            if let Some((species, rest)) = in_species {
                return species.error(&rest, problem.to_owned());
            }
            if !path.0.is_empty() && self.node.has(&Path(path.0[..1].to_vec())) {
                let span = self.node.locate(&path);
                let (path, help) = (self.key.join(&path), self.remark.clone());
                let fault = Fault { span, path, problem: problem.to_owned(), help };
                return SceneError::at(&self.source, fault);
            }
        }
        let problem = format!("the plugin {:?} refused: {message}", self.plugin);
        SceneError::at(
            &self.source,
            Fault {
                span: self.node.span.clone(),
                path: self.key.clone(),
                problem,
                help: self.remark.clone(),
            },
        )
    }
}

/// Reads a scene, with species from `assets`/species.
pub fn load(path: &FilePath, assets: &FilePath, plugins: &dyn Catalogue) -> Result<Scene, SceneError> {
    let source = read::read(path, "scene")?;
    load_text(path, source, assets, plugins)
}

/// The same for a text that was read before.
pub fn load_text(
    path: &FilePath,
    source: Source,
    assets: &FilePath,
    plugins: &dyn Catalogue,
) -> Result<Scene, SceneError> {
    let node = read::parse(&source)?;
    let schema = format::schema();
    let scale = scale_of(&node);
    let terms = Terms { scale, ..Terms::default() };
    let faults = check(&schema, &schema, &node, &Path::default(), terms);
    fail(&source, faults)?;
    let read = |json: Json| -> Result<SceneFile, SceneError> {
        serde_path_to_error::deserialize(json).map_err(|error| {
            let path = Path::parse(&error.path().to_string()).unwrap_or_default();
            let fault =
                Fault { span: node.locate(&path), path, problem: error.inner().to_string(), help: None };
            SceneError::at(&source, fault)
        })
    };
    let mut json = node.to_json();
    let mut file = read(json.clone())?;
    fail(&source, whole::check_whole(&file, &node))?;
    if scale != 1.0 {
        in_metres(&schema, &schema, &mut json, scale, Defaults::Scaled);
        file = read(json)?;
    }
    let library = Library { source: &source, scene: &node, folder: &assets.join("species"), scale };
    let mut modules = Vec::new();
    let entries = node.get("modules").map(Node::entries).unwrap_or_default();
    for entry in entries {
        modules.push(module(entry, &source, &library, plugins)?);
    }
    let name = match file.scene.name.as_str() {
        "" => path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default(),
        name => name.to_owned(),
    };
    let mut files = vec![path.to_owned()];
    let layers =
        modules.iter().flat_map(|module| module.species.values()).flat_map(|species| &species.layers);
    files.extend(layers.filter_map(|layer| layer.file.clone()));
    files.sort();
    files.dedup();
    Ok(Scene { path: path.to_owned(), name, file, modules, files, assets: assets.to_owned() })
}

/// Metres per unit of a file's lengths; 1 where it says none that makes sense.
fn scale_of(node: &Node) -> f64 {
    let scale = match node.get("scene").and_then(|table| table.get("scale")).map(|node| &node.value) {
        Some(Value::Float(scale)) => *scale,
        Some(Value::Integer(scale)) => *scale as f64,
        _ => 1.0,
    };
    if format::SCALES.contains(&scale) { scale } else { 1.0 }
}

fn fail(source: &Source, faults: Vec<Fault>) -> Result<(), SceneError> {
    SceneError::all(source, faults).map_or(Ok(()), Err)
}

fn module(
    entry: &document::Entry,
    source: &Source,
    library: &Library<'_>,
    plugins: &dyn Catalogue,
) -> Result<Module, SceneError> {
    let key = Path::default().key("modules").key(&entry.key);
    let table = &entry.node;
    let used = table.get("use");
    let plugin = used.and_then(Node::as_str).unwrap_or_default().to_owned();
    let used_at = used.map_or(entry.key_span.clone(), |node| node.span.clone());
    let refuse = |problem: String, help: Option<String>| {
        SceneError::at(source, Fault { span: used_at.clone(), path: key.key("use"), problem, help })
    };
    let info = match plugins.plugin(&plugin) {
        Ok(Some(info)) => info,
        Ok(None) => {
            let ids = plugins.ids();
            let known = if ids.is_empty() { "none was found".to_owned() } else { ids.join(", ") };
            let help = nearest(&plugin, ids.iter().map(String::as_str)).map(did_you_mean);
            return Err(refuse(format!("there is no plugin {plugin:?}; known: {known}"), help));
        }
        Err(reason) => return Err(refuse(format!("the plugin {plugin:?} cannot be used: {reason}"), None)),
    };
    let mut own = table.clone();
    own.span = entry.key_span.clone();
    if let Value::Table(entries) = &mut own.value {
        entries.retain(|entry| entry.key != "use" && entry.key != "params");
    }
    let scale = library.scale;
    if let Some(schema) = &info.config_schema {
        fail(source, check(schema, schema, &own, &key, Terms { scale, ..Terms::default() }))?;
    }
    let params = params(table, &key, &info, scale).map_err(|fault| SceneError::at(source, fault))?;
    let mut named: Vec<Mention> = Vec::new();
    species::mentions(&own, &key, &mut named);
    let mut species = BTreeMap::new();
    for mention in named {
        if species.contains_key(&mention.name) {
            continue;
        }
        let schema = info.config_schema.as_ref().and_then(|root| Some((root, species_schema(root)?)));
        let found = library.resolve(&mention, schema)?;
        if let Some((root, schema)) = schema
            && let Some(error) = check_species(root, schema, &found, scale)
        {
            return Err(error);
        }
        species.insert(mention.name, found);
    }
    let mut config = own.to_json();
    if let Some(schema) = &info.config_schema {
        in_metres(schema, schema, &mut config, scale, Defaults::Scaled);
    }
    let remark =
        (scale != 1.0).then(|| format!("the plugin counts in metres; a unit of this scene is {scale} m"));
    Ok(Module {
        name: entry.key.clone(),
        plugin,
        params,
        config,
        species,
        source: source.clone(),
        node: own,
        key,
        remark,
    })
}

/// What a plugin's species are made of: the schema under `x-species` of its configuration's schema.
pub fn species_schema(root: &Json) -> Option<&Json> {
    Some(check::deref(root, root.get("x-species")?))
}

/// Parameters that a scene sets, and those with a length in their unit: their defaults are in the scene's
/// units, too.
pub fn params(table: &Node, key: &Path, info: &PluginInfo, scale: f64) -> Result<Vec<(u32, f64)>, Fault> {
    let key = key.key("params");
    let mut values = Vec::new();
    for entry in table.get("params").map(Node::entries).unwrap_or_default() {
        let path = key.key(&entry.key);
        let Some(param) = info.params.iter().find(|param| param.key == entry.key) else {
            let names: Vec<&str> = info.params.iter().map(|param| param.key.as_str()).collect();
            let help = nearest(&entry.key, names.iter().copied()).map(did_you_mean);
            let problem = match names.as_slice() {
                [] => "is not known; this plugin has no parameters".to_owned(),
                _ => format!("is not known; allowed here: {}", names.join(", ")),
            };
            return Err(Fault { span: entry.key_span.clone(), path, problem, help });
        };
        match (Param { info: param, scale }).value_of(&entry.node) {
            Ok(value) => values.push((param.id, value)),
            Err(problem) => return Err(Fault { span: entry.node.span.clone(), path, problem, help: None }),
        }
    }
    if scale != 1.0 {
        let set = values.len();
        let unset = |param: &&ParamInfo| values[..set].iter().all(|(id, _)| *id != param.id);
        let unset = info.params.iter().filter(unset);
        let defaults: Vec<_> = unset.filter_map(|info| Param { info, scale }.scaled_default()).collect();
        values.extend(defaults);
    }
    Ok(values)
}

#[cfg(test)]
mod tests;
