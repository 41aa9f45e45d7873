//! Species: tables of a module's parameters that build on one another.
//!
//! A module's configuration names species under keys called `species`. Each name is a table `[species.NAME]`
//! of the scene or a file NAME.toml in assets/species. `base = "OTHER"` takes all keys of another species
//! that the table does not set itself; tables within are merged key by key, lists are replaced whole.

use std::path::{Path as FilePath, PathBuf};

use serde_json::{Map, Value as Json};

use super::{
    check::{Terms, check},
    document::{Node, Path, Span, Value},
    error::{Fault, SceneError, Source},
    read,
    scale::{Defaults, in_metres},
    words::{did_you_mean, nearest},
};

/// Most species that one builds on another.
const DEEPEST_BASE: usize = 16;
/// Largest number of letters of a species' name.
const LONGEST_NAME: usize = 100;

/// A species with everything it builds on.
#[derive(Clone, Debug)]
pub struct Species {
    /// Its name.
    pub name: String,
    /// All keys but `base`, merged.
    pub table: Map<String, Json>,
    /// Where its own keys stand, then those of its base, and so on.
    pub layers: Vec<Layer>,
}

/// One table of the chain.
#[derive(Clone, Debug)]
pub struct Layer {
    /// The file.
    pub source: Source,
    /// The table.
    pub node: Node,
    /// The way to it in the file.
    pub path: Path,
    /// Where the table begins.
    pub place: Span,
    /// The file on disk; None for a table of the scene.
    pub file: Option<PathBuf>,
}

impl Layer {
    /// Metres per unit of its lengths, in a scene with units of `scale` metres.
    fn scale(&self, scale: f64) -> f64 {
        if self.file.is_none() { scale } else { 1.0 }
    }
}

impl Species {
    /// The place of a key, in the layer that sets it.
    pub fn error(&self, path: &Path, problem: String) -> SceneError {
        let layer = self.layers.iter().find(|layer| layer.node.has(path)).unwrap_or(&self.layers[0]);
        let span = if layer.node.has(path) && !path.0.is_empty() {
            layer.node.locate(path)
        } else {
            layer.place.clone()
        };
        SceneError::at(&layer.source, Fault { span, path: layer.path.join(path), problem, help: None })
    }
}

/// A name of a species in a module's configuration, and where it stands.
#[derive(Clone, Debug, PartialEq)]
pub struct Mention {
    /// The species.
    pub name: String,
    /// Where.
    pub span: Span,
    /// Under which key.
    pub path: Path,
}

/// All strings under keys called `species`, alone or in lists.
pub fn mentions(node: &Node, path: &Path, found: &mut Vec<Mention>) {
    match &node.value {
        Value::Table(entries) => {
            for entry in entries {
                let inner = path.key(&entry.key);
                if entry.key == "species" {
                    let names = std::iter::once(&entry.node).chain(entry.node.elements());
                    for (at, name) in names.enumerate() {
                        if let Some(text) = name.as_str() {
                            let path = if at == 0 { inner.clone() } else { inner.index(at - 1) };
                            found.push(Mention { name: text.to_owned(), span: name.span.clone(), path });
                        }
                    }
                }
                mentions(&entry.node, &inner, found);
            }
        }
        Value::Array(elements) => {
            for (at, element) in elements.iter().enumerate() {
                mentions(element, &path.index(at), found);
            }
        }
        _ => {}
    }
}

/// Where species are looked for.
pub struct Library<'a> {
    /// The scene's file.
    pub source: &'a Source,
    /// Its tree.
    pub scene: &'a Node,
    /// The folder of species files.
    pub folder: &'a FilePath,
    /// Metres per unit of the scene's lengths. Files of species are in metres, for all scenes.
    pub scale: f64,
}

impl Library<'_> {
    /// The species that a mention names, with all it builds on, in metres. `schema`: what species are made
    /// of, and what its references lead into. What no table says keeps the plugin's default, in metres.
    pub fn resolve(&self, mention: &Mention, schema: Option<(&Json, &Json)>) -> Result<Species, SceneError> {
        let mut chain: Vec<String> = vec![mention.name.clone()];
        let first = self.layer(&mention.name, self.source, mention)?;
        let mut layers = vec![first];
        loop {
            let layer = &layers[layers.len() - 1];
            let Some(entry) = layer.node.entry("base") else { break };
            let at = Mention {
                name: entry.node.as_str().unwrap_or_default().to_owned(),
                span: entry.node.span.clone(),
                path: layer.path.key("base"),
            };
            let fault = |problem: String| {
                SceneError::at(
                    &layer.source,
                    Fault { span: at.span.clone(), path: at.path.clone(), problem, help: None },
                )
            };
            if entry.node.as_str().is_none() {
                return Err(fault(format!("is {}, but must be the name of a species", entry.node.kind())));
            }
            let round = chain.contains(&at.name);
            chain.push(at.name.clone());
            if round {
                return Err(fault(format!("this species builds on itself: {}", chain.join(" → "))));
            }
            if chain.len() > DEEPEST_BASE {
                let problem = format!(
                    "too many species build on one another: {}; the limit is {DEEPEST_BASE}",
                    chain.join(" → ")
                );
                return Err(fault(problem));
            }
            let source = layer.source.clone();
            let next = self.layer(&at.name, &source, &at)?;
            layers.push(next);
        }
        let mut table = Map::new();
        for layer in layers.iter().rev() {
            let mut own = layer.node.to_json();
            if let Some((root, schema)) = schema {
                in_metres(root, schema, &mut own, layer.scale(self.scale), Defaults::Metres);
            }
            if let Json::Object(own) = own {
                merge(&mut table, own);
            }
        }
        table.shift_remove("base");
        Ok(Species { name: mention.name.clone(), table, layers })
    }

    fn layer(&self, name: &str, named_in: &Source, mention: &Mention) -> Result<Layer, SceneError> {
        let path = Path::default().key("species").key(name);
        if let Some(entry) = self.scene.get("species").and_then(|all| all.entry(name)) {
            let (node, place) = (entry.node.clone(), entry.key_span.clone());
            return Ok(Layer { source: self.source.clone(), node, path, place, file: None });
        }
        let refuse = |problem: String, help: Option<String>| {
            let fault = Fault { span: mention.span.clone(), path: mention.path.clone(), problem, help };
            SceneError::at(named_in, fault)
        };
        let sound = !name.is_empty()
            && name.len() <= LONGEST_NAME
            && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
        if !sound {
            let problem =
                format!("{name:?} is no name of a species; allowed are letters, digits, `-` and `_`");
            return Err(refuse(problem, None));
        }
        let file = self.folder.join(format!("{name}.toml"));
        if !file.exists() {
            let names = self.names();
            let known = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
            let help = nearest(name, names.iter().map(String::as_str)).map(did_you_mean);
            let folder = self.folder.display();
            return Err(refuse(
                format!("there is no species {name:?}; known here and in {folder}: {known}"),
                help,
            ));
        }
        let source = read::read(&file, "species")?;
        let node = read::parse(&source)?;
        Ok(Layer { source, node, path: Path::default(), place: 0..0, file: Some(file) })
    }

    /// All species that can be named.
    fn names(&self) -> Vec<String> {
        let own =
            self.scene.get("species").into_iter().flat_map(Node::entries).map(|entry| entry.key.clone());
        let files = std::fs::read_dir(self.folder).into_iter().flatten().filter_map(|entry| {
            let name = entry.ok()?.file_name().into_string().ok()?;
            name.strip_suffix(".toml").map(str::to_owned)
        });
        let mut names: Vec<String> = own.chain(files).collect();
        names.sort();
        names.dedup();
        names
    }
}

/// Faults of a species against what its module's plugin says species are made of, in a scene with units of
/// `scale` metres.
pub fn check_species(root: &Json, schema: &Json, species: &Species, scale: f64) -> Option<SceneError> {
    for layer in &species.layers {
        let mut node = layer.node.clone();
        if let Value::Table(entries) = &mut node.value {
            entries.retain(|entry| entry.key != "base");
        }
        node.span = layer.place.clone();
        let terms = Terms { missing_keys: true, scale: layer.scale(scale) };
        let faults = check(root, schema, &node, &layer.path, terms);
        if let Some(error) = SceneError::all(&layer.source, faults) {
            return Some(error);
        }
    }
    let required =
        schema.get("required").and_then(Json::as_array).into_iter().flatten().filter_map(Json::as_str);
    for key in required {
        if !species.table.contains_key(key) {
            let problem = format!(
                "the species {:?} lacks the key `{key}`, and so does all that it builds on",
                species.name
            );
            return Some(species.error(&Path::default(), problem));
        }
    }
    None
}

/// Puts `over` on top of `table`: tables key by key, all else whole.
fn merge(table: &mut Map<String, Json>, over: Map<String, Json>) {
    for (key, value) in over {
        match (table.get_mut(&key), value) {
            (Some(Json::Object(below)), Json::Object(above)) => merge(below, above),
            (_, value) => {
                table.insert(key, value);
            }
        }
    }
}
