//! The shaders: SPIR-V embedded in the program, replaced one by one where somebody edits them.

use std::{
    collections::HashMap,
    sync::{
        Arc, Mutex, PoisonError, RwLock,
        atomic::{AtomicU64, Ordering},
    },
};

use super::{
    embedded,
    error::{GpuError, Result},
    reflect::{Interface, reflect, words},
};

/// A shader in the form that pipelines are made from.
#[derive(Clone)]
pub(crate) struct Shader {
    pub(crate) code: Arc<[u32]>,
    pub(crate) interface: Arc<Interface>,
    /// Counts the replacements.
    pub(crate) generation: u64,
}

/// A shader that could not be compiled or used; the one before it is still drawn with.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ShaderFailure {
    /// The shader's file name.
    pub name: String,
    /// What the compiler or the driver said, with file and line.
    pub text: String,
}

/// All shaders by file name (`fibre.vert`).
pub struct ShaderStore {
    shaders: RwLock<HashMap<String, Shader>>,
    failures: Mutex<Vec<ShaderFailure>>,
    /// New versions by name, from another thread; the next frame takes them.
    offered: Mutex<Vec<(String, Vec<u8>)>>,
    epoch: AtomicU64,
}

impl ShaderStore {
    /// Those that were compiled into the program. They are read when they are first asked for.
    pub(crate) fn embedded() -> Self {
        Self {
            shaders: RwLock::new(HashMap::new()),
            failures: Mutex::new(Vec::new()),
            offered: Mutex::new(Vec::new()),
            epoch: AtomicU64::new(0),
        }
    }

    /// Changes whenever a shader is replaced: cheap to compare.
    pub(crate) fn epoch(&self) -> u64 {
        self.epoch.load(Ordering::Acquire)
    }

    /// The shader of this name.
    pub(crate) fn get(&self, name: &str) -> Result<Shader> {
        if let Some(shader) = self.shaders.read().unwrap_or_else(PoisonError::into_inner).get(name) {
            return Ok(shader.clone());
        }
        let (_, bytes) = embedded::SHADERS.iter().find(|(n, _)| *n == name).ok_or_else(|| {
            GpuError::Shader { name: name.to_owned(), reason: "there is no such shader".to_owned() }
        })?;
        let shader = read(name, bytes, 0)?;
        self.shaders
            .write()
            .unwrap_or_else(PoisonError::into_inner)
            .entry(name.to_owned())
            .or_insert_with(|| shader.clone());
        Ok(shader)
    }

    /// Replaces a shader from the next frame on. SPIR-V that cannot be read is refused and changes nothing.
    pub fn replace(&self, name: &str, spirv: &[u8]) -> Result<()> {
        let generation = self.get(name).map_or(0, |old| old.generation) + 1;
        let shader = match read(name, spirv, generation) {
            Ok(shader) => shader,
            Err(error) => {
                self.fail(name, error.to_string());
                return Err(error);
            }
        };
        self.shaders.write().unwrap_or_else(PoisonError::into_inner).insert(name.to_owned(), shader);
        self.failures.lock().unwrap_or_else(PoisonError::into_inner).retain(|f| f.name != name);
        self.epoch.fetch_add(1, Ordering::Release);
        Ok(())
    }

    /// Offers a new version of a shader, from any thread: the next frame that begins replaces it.
    pub fn offer(&self, name: &str, spirv: Vec<u8>) {
        self.offered.lock().unwrap_or_else(PoisonError::into_inner).push((name.to_owned(), spirv));
    }

    /// Between two frames: replaces what was offered.
    pub(crate) fn take_offered(&self) {
        let offered = std::mem::take(&mut *self.offered.lock().unwrap_or_else(PoisonError::into_inner));
        for (name, spirv) in offered {
            // What cannot be used is noted, and the old version stays.
            if self.replace(&name, &spirv).is_ok() {
                tracing::info!("shader {name}: reloaded");
            }
        }
    }

    /// Notes that a shader could not be compiled or used.
    pub fn fail(&self, name: &str, text: String) {
        tracing::error!("shader {name}: {text}");
        let mut failures = self.failures.lock().unwrap_or_else(PoisonError::into_inner);
        failures.retain(|f| f.name != name);
        failures.push(ShaderFailure { name: name.to_owned(), text });
    }

    /// The shaders whose newest version is not the one that is drawn with.
    pub fn failures(&self) -> Vec<ShaderFailure> {
        self.failures.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// How many times a shader was replaced.
    pub fn replacements(&self) -> u64 {
        self.epoch()
    }
}

fn read(name: &str, bytes: &[u8], generation: u64) -> Result<Shader> {
    let refuse = |reason| GpuError::Shader { name: name.to_owned(), reason };
    let code = words(bytes).map_err(refuse)?;
    let interface = reflect(&code).map_err(refuse)?;
    Ok(Shader { code: code.into(), interface: Arc::new(interface), generation })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_embedded_shader_has_an_interface() {
        let store = ShaderStore::embedded();
        for (name, _) in embedded::SHADERS {
            store.get(name).unwrap_or_else(|error| panic!("{error}"));
        }
    }

    #[test]
    fn a_broken_replacement_is_noted_and_changes_nothing() {
        let store = ShaderStore::embedded();
        let (name, bytes) = embedded::SHADERS[0];
        let before = store.get(name).expect("embedded").generation;
        assert!(store.replace(name, b"not SPIR-V").is_err());
        assert_eq!(store.failures().len(), 1);
        assert_eq!(store.get(name).expect("still there").generation, before);
        store.replace(name, bytes).expect("a good one");
        assert!(store.failures().is_empty(), "a good version clears the failure");
        assert_eq!(store.get(name).expect("replaced").generation, before + 1);
    }

    #[test]
    fn an_unknown_shader_is_refused_by_name() {
        let error = ShaderStore::embedded().get("nothing.comp").err().expect("refused");
        assert!(error.to_string().contains("nothing.comp"));
    }
}
