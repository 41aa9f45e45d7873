//! A whole sea as bytes: step, inputs that still work, what modules said in the last step, and each module's
//! own state.
//!
//! ```text
//! "REEFSAVE" · format u32 · header length u32 · header (JSON) · per module: flows · actors · objects · envelope ·
//! BLAKE3 of all before        (little-endian; the header says how many of each)
//! ```

use std::path::{Path, PathBuf};

use bytemuck::Pod;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use reef_abi as abi;
use reef_files as files;
use reef_files::{WriteError, bounded};
use reef_plugin::{Payload, PluginError, Saving, save_together};
use reef_streams::{Outputs, Stream, check};

use super::{
    clock::LATEST,
    exchange::{Listed, Said},
    hash::{Chain, hex, unhex},
    journal::CameraInput,
    water::{ActivePoke, MOST_POKES},
    world::World,
};

const MAGIC: &[u8; 8] = b"REEFSAVE";
const FORMAT: u32 = 1;
/// Bytes before the header: magic, format, the header's length.
const PREFIX: usize = 16;
/// Largest saved sea that is read [bytes].
const LARGEST: u64 = 8 << 30;
const HASH: usize = 32;

/// Why a saved sea was not taken. The world is as it was.
#[derive(Debug, Error)]
pub enum StateError {
    /// The bytes are no saved sea, or not a whole one.
    #[error("this is no saved sea: {0}")]
    Damaged(String),
    /// It is of another run.
    #[error("the saved sea does not fit this run: {0}")]
    Other(String),
    /// A module does not take its part.
    #[error("the module {module:?} does not take its state: {source}")]
    Module {
        /// Its name in the scene.
        module: String,
        /// What its plugin said.
        source: PluginError,
    },
    /// A module does not give its part.
    #[error(transparent)]
    Plugin(#[from] PluginError),
    /// The file cannot be read.
    #[error("{}: {problem}", path.display())]
    File {
        /// Which.
        path: PathBuf,
        /// Why.
        problem: String,
    },
    /// The file cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}

impl miette::Diagnostic for StateError {}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Header {
    scene: String,
    seed: u64,
    dt: f64,
    step: u64,
    camera: Option<CameraInput>,
    pokes: Vec<ActivePoke>,
    /// Inputs that the journal held.
    journal_entries: u64,
    /// The chain of hashes so far, where there was one.
    chain: Option<String>,
    modules: Vec<ModuleHeader>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ModuleHeader {
    name: String,
    plugin: String,
    flows: u64,
    actors: u64,
    objects: u64,
    envelope: u64,
}

/// Id and origin of an object, as they are saved.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct SavedObject {
    id: u64,
    origin: [f64; 3],
}

impl World {
    /// Each module's state, all at the same time; `memory`: to write them into.
    pub(crate) fn save_payloads(
        &mut self,
        mut memory: impl FnMut() -> Vec<u8>,
    ) -> Vec<Result<Payload, PluginError>> {
        let members = self.members.iter_mut().enumerate();
        let mut savings: Vec<Saving<'_>> =
            members.map(|(at, member)| Saving::new(at, &mut member.instance, memory())).collect();
        save_together(&mut savings);
        savings.into_iter().map(|saving| saving.state).collect()
    }

    /// Each module's state in its envelope.
    pub(crate) fn save_members(&mut self) -> Result<Vec<Vec<u8>>, PluginError> {
        let states = self.save_payloads(Vec::new);
        let members = self.members.iter();
        states.into_iter().zip(members).map(|(state, m)| Ok(state?.seal(&m.instance.info().id))).collect()
    }

    /// The whole sea. `chain`: the hashes so far, so that a run from here continues them.
    pub fn save(&mut self, chain: Option<&Chain>) -> Result<Vec<u8>, StateError> {
        let envelopes = self.save_members()?;
        self.encode(&envelopes, chain)
    }

    /// The whole sea of these states of its modules.
    pub(crate) fn encode(&self, envelopes: &[Vec<u8>], chain: Option<&Chain>) -> Result<Vec<u8>, StateError> {
        let said = &self.exchange.said;
        let modules =
            self.members.iter().zip(said).zip(envelopes).map(|((member, said), envelope)| ModuleHeader {
                name: member.name.clone(),
                plugin: member.instance.info().id.clone(),
                flows: said.flows.len() as u64,
                actors: said.actors.len() as u64,
                objects: said.objects.len() as u64,
                envelope: envelope.len() as u64,
            });
        let header = Header {
            scene: self.setting.scene.name.clone(),
            seed: self.setting.seed,
            dt: self.clock.dt,
            step: self.clock.step,
            camera: self.hands.camera,
            pokes: self.hands.pokes.clone(),
            journal_entries: self.hands.journal.entries.len() as u64,
            chain: chain.map(|chain| hex(&chain.digest)),
            modules: modules.collect(),
        };
        let header = serde_json::to_vec(&header).map_err(|error| StateError::Damaged(error.to_string()))?;
        let mut bytes = Vec::new();
        bytes.extend_from_slice(MAGIC);
        bytes.extend_from_slice(&FORMAT.to_le_bytes());
        bytes.extend_from_slice(&(header.len() as u32).to_le_bytes());
        bytes.extend_from_slice(&header);
        for (said, envelope) in said.iter().zip(envelopes) {
            bytes.extend_from_slice(bytemuck::cast_slice(&said.flows));
            bytes.extend_from_slice(bytemuck::cast_slice(&said.actors));
            for (id, origin) in said.objects.iter() {
                bytes.extend_from_slice(bytemuck::bytes_of(&SavedObject { id, origin }));
            }
            bytes.extend_from_slice(envelope);
        }
        let hash = blake3::hash(&bytes);
        bytes.extend_from_slice(hash.as_bytes());
        Ok(bytes)
    }

    /// Writes the whole sea to a file, whole or not at all.
    pub fn save_to(&mut self, path: &Path, chain: Option<&Chain>) -> Result<(), StateError> {
        let bytes = self.save(chain)?;
        Ok(files::write(path, &bytes)?)
    }

    /// Takes over a saved sea of the same scene and seed; on an error nothing changes. Returns the chain that
    /// was saved with it. The journal begins anew at the saved step.
    pub fn load(&mut self, bytes: &[u8]) -> Result<Option<Chain>, StateError> {
        let (header, sections) = open(bytes)?;
        self.fits(&header)?;
        let mut said = Vec::with_capacity(header.modules.len());
        let mut envelopes = Vec::with_capacity(header.modules.len());
        let mut rest = Rest(sections);
        for module in &header.modules {
            said.push(rest.said(module)?);
            envelopes.push(rest.take(module.envelope)?);
        }
        if !rest.0.is_empty() {
            return Err(damaged("bytes are left over"));
        }
        let before = self.save_members();
        for (at, envelope) in envelopes.iter().enumerate() {
            let Err(source) = self.members[at].instance.load(envelope) else { continue };
            if let Ok(before) = &before {
                for (member, old) in self.members.iter_mut().zip(before).take(at) {
                    // It took these bytes' like a moment ago; should it refuse its own, it stands still and
                    // says so.
                    if let Err(error) = member.instance.load(old) {
                        tracing::error!(module = member.name, "{error}");
                    }
                }
                let said = self.exchange.said.iter().cloned().enumerate().collect();
                self.refresh_after(said, World::refresh);
            }
            return Err(StateError::Module { module: self.members[at].name.clone(), source });
        }
        self.clock.step = header.step;
        self.hands.pokes = header.pokes;
        self.hands.camera = header.camera;
        self.hands.journal = self.setting.journal_from(header.step);
        self.history.graft();
        // What this run had lived through before a jump back is not the loaded sea's future.
        if std::mem::take(&mut self.hands.relived) {
            self.hands.replay.clear();
        }
        self.refresh_after(said.into_iter().enumerate().collect(), World::refresh);
        let digest = header.chain.as_deref().and_then(unhex);
        Ok(digest.map(|digest| Chain { digest }))
    }

    /// The same from a file.
    pub fn load_from(&mut self, path: &Path) -> Result<Option<Chain>, StateError> {
        let fail = |problem: String| StateError::File { path: path.to_owned(), problem };
        let unreadable = |error: std::io::Error| fail(error.to_string());
        let file = bounded::open(path).map_err(unreadable)?;
        // What is no state is refused by its first bytes, however many follow.
        let first = bounded::beginning(&file, PREFIX as u64).map_err(unreadable)?;
        begins(&first).map_err(|error| fail(error.to_string()))?;
        let bytes = bounded::rest(&file, first, LARGEST).map_err(unreadable)?;
        self.load(&bytes).map_err(|error| fail(error.to_string()))
    }

    fn fits(&self, header: &Header) -> Result<(), StateError> {
        let other = |text: String| Err(StateError::Other(text));
        if header.scene != self.setting.scene.name {
            return other(format!(
                "it is of the scene {:?}, not {:?}",
                header.scene, self.setting.scene.name
            ));
        }
        if header.seed != self.setting.seed {
            return other(format!(
                "its seed is {}, this run's is {} (--seed {0})",
                header.seed, self.setting.seed
            ));
        }
        if header.dt != self.clock.dt {
            return other(format!("its steps are {} s long, this run's {} s", header.dt, self.clock.dt));
        }
        let names = |modules: &mut dyn Iterator<Item = (&str, &str)>| {
            modules.map(|(name, plugin)| format!("{name} ({plugin})")).collect::<Vec<_>>().join(", ")
        };
        let theirs =
            names(&mut header.modules.iter().map(|module| (module.name.as_str(), module.plugin.as_str())));
        let ours = names(&mut self.modules().map(|(name, info)| (name, info.id.as_str())));
        if theirs != ours {
            return other(format!("its modules are {theirs}; this scene's are {ours}"));
        }
        if header.step > LATEST {
            return Err(damaged(&format!("its step {} is beyond the last one, {LATEST}", header.step)));
        }
        if header.pokes.len() > MOST_POKES || header.pokes.iter().any(|active| !active.poke.is_sound()) {
            return Err(damaged("its pokes make no sense"));
        }
        if header.camera.is_some_and(|camera| camera.pose().is_none()) {
            return Err(damaged("its camera makes no sense"));
        }
        Ok(())
    }
}

fn damaged(problem: &str) -> StateError {
    StateError::Damaged(problem.to_owned())
}

/// Whether bytes begin as a state of this format does; returns the length of its header.
fn begins(bytes: &[u8]) -> Result<usize, StateError> {
    if bytes.len() < PREFIX || &bytes[..8] != MAGIC {
        return Err(damaged("it does not begin like one"));
    }
    let number = |at: usize| u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]);
    if number(8) != FORMAT {
        return Err(StateError::Other(format!("it has format {}, this program reads {FORMAT}", number(8))));
    }
    Ok(number(12) as usize)
}

/// The header, and the bytes of the modules.
fn open(bytes: &[u8]) -> Result<(Header, &[u8]), StateError> {
    let length = begins(bytes)?;
    if bytes.len() < PREFIX + HASH {
        return Err(damaged("it is cut"));
    }
    let (content, hash) = bytes.split_at(bytes.len() - HASH);
    if blake3::hash(content).as_bytes() != hash {
        return Err(damaged("its hash does not fit its bytes: it was cut or changed"));
    }
    let json = content[PREFIX..].get(..length).ok_or_else(|| damaged("its header is cut"))?;
    let header =
        serde_json::from_slice(json).map_err(|error| StateError::Damaged(format!("its header: {error}")))?;
    Ok((header, &content[PREFIX + length..]))
}

struct Rest<'a>(&'a [u8]);

impl<'a> Rest<'a> {
    fn take(&mut self, length: u64) -> Result<&'a [u8], StateError> {
        let length = usize::try_from(length).unwrap_or(usize::MAX);
        if length > self.0.len() {
            return Err(damaged("it is shorter than its header says"));
        }
        let (taken, rest) = self.0.split_at(length);
        self.0 = rest;
        Ok(taken)
    }

    /// What a module said in the saved step, looked at as what a step emits: other modules are about to hear
    /// it.
    fn said(&mut self, module: &ModuleHeader) -> Result<Said, StateError> {
        let of = |problem: String| StateError::Damaged(format!("of the module {}: {problem}", module.name));
        for (Stream { name, limit, .. }, count) in [
            (Stream::of::<abi::Flow>(), module.flows),
            (Stream::of::<abi::Actor>(), module.actors),
            (Stream::of::<abi::Object>(), module.objects),
        ] {
            if let Some(limit) = limit.filter(|limit| count > *limit) {
                return Err(of(format!("stream {name} has {count} elements; the limit is {limit}")));
            }
        }
        let (flows, actors) = (self.list(module.flows)?, self.list(module.actors)?);
        let saved: Vec<SavedObject> = self.list(module.objects)?;
        let object =
            |saved: &SavedObject| abi::Object { id: saved.id, origin: saved.origin, ..Default::default() };
        let objects = saved.iter().map(object).collect();
        let outputs = Outputs { flows, actors, objects, ..Outputs::default() };
        check::Checker::default().check(&outputs, &check::alone).map_err(of)?;
        let objects = Listed::Loaded(saved.iter().map(|saved| (saved.id, saved.origin)).collect());
        Ok(Said { flows: outputs.flows, actors: outputs.actors, objects })
    }

    fn list<T: Pod>(&mut self, count: u64) -> Result<Vec<T>, StateError> {
        let bytes = self.take(count.saturating_mul(size_of::<T>() as u64))?;
        Ok(bytes.chunks_exact(size_of::<T>()).map(bytemuck::pod_read_unaligned).collect())
    }
}
