//! What is given changed inputs.

use std::{
    cell::RefCell,
    fs,
    path::{Path, PathBuf},
};

use reef_abi as abi;
use reef_plugin::{image::Image, inspect};
use reef_sea::{World, step::journal::Journal};
use serde_json::Value;

use crate::sea::{self, MODULES, Module};

/// How an input ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// In an answer that says what is wrong with it.
    Refused,
    /// It was taken.
    Taken,
    /// It is none for this target, or its sea is not made in a moment: nobody was asked.
    Skipped,
}

/// Something that reads what others wrote.
#[derive(Clone, Copy, Debug)]
pub struct Target {
    /// As the command line names it; its inputs are in the folder of that name.
    pub name: &'static str,
    /// Inputs are text.
    pub text: bool,
    /// Gives it an input; `Err`: a finding.
    pub try_one: fn(&[u8]) -> Result<Ending, String>,
    /// Inputs that no file holds.
    pub made: fn() -> Vec<Vec<u8>>,
    /// So many take a second or two: a moment's trial.
    pub few: u64,
}

/// All of them.
pub const TARGETS: [Target; 7] = [
    Target { name: "scenes", text: true, try_one: scene, made: small, few: 100 },
    Target { name: "species", text: true, try_one: species, made: Vec::new, few: 60 },
    Target { name: "skeletons", text: true, try_one: skeleton, made: Vec::new, few: 100 },
    Target { name: "configs", text: true, try_one: config, made: Vec::new, few: 100 },
    Target { name: "states", text: false, try_one: state, made: states, few: 300 },
    Target { name: "journals", text: true, try_one: journal, made: Vec::new, few: 300 },
    Target { name: "plugins", text: false, try_one: plugin, made: library, few: 3000 },
];

/// Steps that a sea makes which was taken.
const STEPS: usize = 2;
/// The greatest whole number of a scene that is made, apart from seeds: greater ones are refused or slow, and
/// [`crate::ranges`] looks at them.
const FEW: i64 = 300;

fn run(world: Result<Option<World>, String>) -> Result<Ending, String> {
    match world? {
        Some(mut world) => sea::step(&mut world, STEPS).map(|()| Ending::Taken),
        None => Ok(Ending::Refused),
    }
}

fn small() -> Vec<Vec<u8>> {
    vec![sea::SMALL.into()]
}

fn scene(input: &[u8]) -> Result<Ending, String> {
    let Ok(text) = std::str::from_utf8(input) else { return Ok(Ending::Skipped) };
    match text.parse::<toml::Table>() {
        // What TOML does not read, the scene's reader must refuse by itself.
        Ok(table) if !is_small(&toml::Value::Table(table.clone())) => Ok(Ending::Skipped),
        _ => run(sea::world(text)),
    }
}

/// Is this a sea that is made in a moment?
fn is_small(value: &toml::Value) -> bool {
    match value {
        toml::Value::Integer(number) => *number <= FEW,
        toml::Value::Array(list) => list.iter().all(is_small),
        toml::Value::Table(table) => {
            table.iter().all(|(key, value)| match (key.as_str(), value.as_float()) {
                // A bed of a million heights.
                ("cell", Some(cell)) => cell >= 0.5,
                ("seed", _) => true,
                _ => is_small(value),
            })
        }
        _ => true,
    }
}

/// A file of a species, whose first line names the module.
fn species(input: &[u8]) -> Result<Ending, String> {
    let Ok(text) = std::str::from_utf8(input) else { return Ok(Ending::Skipped) };
    let is_own = |module: &&Module| text.starts_with(&format!("# {}", module.name));
    let Some(module) = MODULES.iter().find(is_own) else { return Ok(Ending::Skipped) };
    let own: toml::Table = match text.parse() {
        Ok(own) => own,
        // Scenes are given what is no TOML.
        Err(_) => return Ok(Ending::Skipped),
    };
    if !is_small(&toml::Value::Table(own.clone())) {
        return Ok(Ending::Skipped);
    }
    // In the scene's own table, whose keys are those of the file.
    run(sea::world(&sea::with_species(module.scene(), own).to_string()))
}

/// What a file of a modelling program begins with, and the chunk of its buffer.
const MODEL: &[u8] = b"glTF\x02\0\0\0";
const BUFFER: &[u8] = b"BIN\0";
/// Where in it the JSON begins.
const JSON: usize = 20;

/// Lets a file's lengths fit what was changed in it.
fn measure(bytes: &[u8]) -> Option<Vec<u8>> {
    let json = bytes.get(JSON..)?;
    let at = json.windows(BUFFER.len()).position(|word| word == BUFFER)?;
    let (json, buffer) = (json.get(..at.checked_sub(4)?)?, &json[at + BUFFER.len()..]);
    let word = |length: usize| (length as u32).to_le_bytes();
    let whole = word(JSON + json.len() + 8 + buffer.len());
    Some([MODEL, &whole, &word(json.len()), b"JSON", json, &word(buffer.len()), BUFFER, buffer].concat())
}

/// A plant's skeleton and mesh from a modelling program: as it is, and with lengths that fit.
fn skeleton(input: &[u8]) -> Result<Ending, String> {
    let assets = tempfile::tempdir().map_err(|error| error.to_string())?;
    let assets = assets.path();
    let Some(module) = MODULES.iter().find(|module| module.name == "seaweed") else {
        return Err("no module reads skeletons".to_owned());
    };
    let folder = assets.join("modules").join(module.id());
    let own = toml::Table::from_iter([("skeleton".to_owned(), "plant.glb".into())]);
    let scene = sea::with_species(module.scene(), own).to_string();
    let mut ending = Ending::Refused;
    for bytes in [Some(input.to_vec()), measure(input)].into_iter().flatten() {
        fs::create_dir_all(&folder)
            .and_then(|()| fs::write(folder.join("plant.glb"), bytes))
            .map_err(|error| error.to_string())?;
        if run(sea::world_among(&scene, assets))? == Ending::Taken {
            ending = Ending::Taken;
        }
    }
    Ok(ending)
}

/// A configuration as a plugin's `create` gets it, without the host's look at it.
fn config(input: &[u8]) -> Result<Ending, String> {
    let Ok(text) = std::str::from_utf8(input) else { return Ok(Ending::Skipped) };
    let (first, json) = text.split_once('\n').unwrap_or_default();
    let Some(plugin) = sea::models().get(first.trim_start_matches("# ")) else { return Ok(Ending::Skipped) };
    if serde_json::from_str::<Value>(json).is_ok_and(|value| !is_few(&value)) {
        return Ok(Ending::Skipped);
    }
    match plugin.create_among(json, &sea::assets()) {
        Ok(_) => Ok(Ending::Taken),
        Err(error) if error.is_fatal() => Err(error.to_string()),
        Err(_) => Ok(Ending::Refused),
    }
}

fn is_few(value: &Value) -> bool {
    match value {
        Value::Number(number) => number.as_i64().is_none_or(|number| number <= FEW),
        Value::Array(list) => list.iter().all(is_few),
        Value::Object(table) => table.iter().all(|(key, value)| key == "seed" || is_few(value)),
        _ => true,
    }
}

/// The small sea at its start, for as long as `act` takes. After a finding another one is made.
fn with_sea<T>(act: impl FnOnce(&mut World) -> Result<T, String>) -> Result<T, String> {
    thread_local! {
        static KEPT: RefCell<Option<World>> = const { RefCell::new(None) };
    }
    let mut world = match KEPT.take() {
        Some(world) => world,
        None => sea::world(sea::SMALL)?.ok_or("the small sea is refused")?,
    };
    world.reset();
    let done = act(&mut world)?;
    KEPT.set(Some(world));
    Ok(done)
}

/// Length of the hash at a state's end.
const HASH: usize = 32;

/// States of the small sea; the hash at their ends is taken off.
fn states() -> Vec<Vec<u8>> {
    let saved = with_sea(|world| {
        let mut states = Vec::new();
        for _ in 0..2 {
            let mut state = world.save(None).map_err(|error| error.to_string())?;
            state.truncate(state.len() - HASH);
            states.push(state);
            world.step();
        }
        Ok(states)
    });
    saved.unwrap_or_else(|told| panic!("{told}"))
}

/// What a module's envelope begins with, and where its parts stand: see `reef_plugin::envelope`.
const ENVELOPE: &[u8] = b"REEFINST";
const ENVELOPE_HASH: std::ops::Range<usize> = 32..64;

/// Lets the hash of each module's envelope fit what was changed in it.
fn seal(bytes: &mut [u8]) {
    let starts: Vec<usize> = (0..bytes.len()).filter(|at| bytes[*at..].starts_with(ENVELOPE)).collect();
    for start in starts {
        let whole = &bytes[start..];
        let number = |at: usize| {
            whole.get(at..at + 8).map(|word| u64::from_le_bytes(word.try_into().unwrap_or_default()))
        };
        let (Some(id), Some(payload)) = (number(16).map(|id| id & 0xffff_ffff), number(24)) else { continue };
        let length = payload.saturating_add(id).saturating_add(ENVELOPE_HASH.end as u64);
        let Some(whole) = usize::try_from(length).ok().and_then(|length| whole.get(..length)) else {
            continue;
        };
        let mut hasher = blake3::Hasher::new();
        hasher.update(&whole[..ENVELOPE_HASH.start]).update(&whole[ENVELOPE_HASH.end..]);
        let hash = *hasher.finalize().as_bytes();
        bytes[start + ENVELOPE_HASH.start..start + ENVELOPE_HASH.end].copy_from_slice(&hash);
    }
}

/// A state whose hashes fit, whatever was changed.
fn state(input: &[u8]) -> Result<Ending, String> {
    let mut bytes = input.to_vec();
    seal(&mut bytes);
    let hash = blake3::hash(&bytes);
    bytes.extend_from_slice(hash.as_bytes());
    with_sea(|world| {
        let loaded = world.load(&bytes);
        // Whether it is taken or not, the sea goes on. What a module says of a state that it does not take is
        // an answer.
        world.take_messages();
        sea::step(world, STEPS)?;
        Ok(if loaded.is_ok() { Ending::Taken } else { Ending::Refused })
    })
}

fn journal(input: &[u8]) -> Result<Ending, String> {
    let Ok(text) = std::str::from_utf8(input) else { return Ok(Ending::Skipped) };
    let Ok(journal) = Journal::parse(Path::new("fuzz.journal"), text) else { return Ok(Ending::Refused) };
    let again = journal.text();
    if Journal::parse(Path::new("again"), &again).ok().as_ref() != Some(&journal) {
        return Err("what was read is not what is written".to_owned());
    }
    with_sea(|world| match world.replay(journal) {
        Ok(()) => sea::step(world, 4).map(|()| Ending::Taken),
        Err(_) => Ok(Ending::Refused),
    })
}

/// A library's file before the system's loader sees it.
fn plugin(input: &[u8]) -> Result<Ending, String> {
    let image = Image::whole(input);
    let head = inspect::inspect(&image).and_then(|head| inspect::judge(head, inspect::CONTRACT));
    let _ = inspect::entry_word(&image, 0);
    let _ = inspect::passed_over(&image);
    Ok(if head.is_ok() { Ending::Taken } else { Ending::Refused })
}

/// A library of today's contract: the file's own entry names none.
fn library() -> Vec<Vec<u8>> {
    let mut bytes = include_bytes!("../corpus/plugins/tiny").to_vec();
    let magic = abi::MAGIC.to_ne_bytes();
    let Some(at) = bytes.windows(magic.len()).position(|word| word == magic) else { return Vec::new() };
    bytes[at + 12..at + 16].copy_from_slice(&abi::VERSION.to_ne_bytes());
    bytes[at + 16..at + 24].copy_from_slice(&abi::HEADER_HASH.to_ne_bytes());
    vec![bytes]
}

/// The folder of a target's inputs.
pub fn folder(target: &Target) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus").join(target.name)
}

/// The inputs that a target begins with.
///
/// # Panics
/// When the folder cannot be read.
pub fn inputs(target: &Target) -> Vec<Vec<u8>> {
    let mut paths: Vec<PathBuf> = fs::read_dir(folder(target))
        .map(|entries| entries.flatten().map(|entry| entry.path()).collect())
        .unwrap_or_default();
    paths.sort();
    let files = paths.iter().map(|path| fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display())));
    files.chain((target.made)()).collect()
}
