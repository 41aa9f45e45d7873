//! One instance: a plugin's value, its parameters and saved states, and what becomes of the value in a fault.

use reef_abi as abi;

use crate::{
    Plugin,
    config::{self, SceneInfo},
    error::{ConfigError, Status, StepError},
    guard,
    host::{Host, Level, read_sized},
    param::Params,
    state::{StateReader, StateWriter},
    step::{Output, StepInput, events},
};

/// One instance: the plugin's value and what the SDK keeps for it.
pub(crate) struct Shell<T> {
    pub(crate) plugin: T,
    pub(crate) params: Params,
    /// Values before this step's events, should the step refuse them.
    pub(crate) params_before: Params,
    pub(crate) host: Host,
    /// What `create` got: `reset` and `load_state` make the instance anew from it.
    pub(crate) config: Vec<u8>,
    /// The value that the last load replaced, for the next one, and how many steps it is kept for.
    pub(crate) spare: Option<(T, u32)>,
    /// Where states are written; its memory stays from one to the next.
    pub(crate) saved: StateWriter,
    /// The message of a panic that left the plugin's value in an unknown state.
    pub(crate) broken: Option<String>,
}

/// The parameters right after `create`.
pub(crate) fn first_params<T: Plugin>(plugin: &T) -> Params {
    let mut params = Params::new(T::params());
    for param in T::params() {
        params.set(param.id, plugin.initial_param(param));
    }
    params
}

/// What a load has replaced is kept for so many steps.
pub(crate) const SPARE_STEPS: u32 = 600;

/// A call's end: a status and, when it is a failure, its message.
pub(crate) struct Failed(pub(crate) i32, pub(crate) String);

impl From<StepError> for Failed {
    fn from(error: StepError) -> Self {
        Self(error.code(), error.to_string())
    }
}

impl From<ConfigError> for Failed {
    fn from(error: ConfigError) -> Self {
        Self(abi::BAD_INPUT, error.to_string())
    }
}

/// Name of the fields in which the SDK saves parameters.
const PARAM_IDS: &str = "reef.params.ids";
const PARAM_VALUES: &str = "reef.params.values";

impl<T: Plugin> Shell<T> {
    pub(crate) fn new(host: Host, config: Vec<u8>) -> Result<Self, Failed> {
        let (scene, parsed): (SceneInfo, T::Config) = config::parse(&config)?;
        let plugin = T::create(&host, &scene, parsed)?;
        let params = first_params(&plugin);
        Ok(Self {
            plugin,
            params_before: params.clone(),
            params,
            host,
            config,
            spare: None,
            saved: StateWriter::new(),
            broken: None,
        })
    }

    /// # Safety
    /// Input and output are the host's, for this step.
    pub(crate) unsafe fn step(
        &mut self,
        input: *const abi::Step,
        output: *const abi::Output,
    ) -> Result<Status, Failed> {
        if let Some(message) = &self.broken {
            return Err(Failed(abi::FATAL, format!("the instance broke earlier: {message}")));
        }
        if let Some((_, steps)) = &mut self.spare {
            match steps.checked_sub(1) {
                Some(left) => *steps = left,
                None => put_away::<T>(&self.host, self.spare.take()),
            }
        }
        let unusable = |what: &str| Failed(abi::BAD_INPUT, format!("the host's step {what} is unusable"));
        // SAFETY: the caller's promise.
        let raw = unsafe { read_sized(input) }.ok_or_else(|| unusable("input"))?;
        // SAFETY: the caller's promise.
        let raw_output = unsafe { read_sized(output) }.ok_or_else(|| unusable("output"))?;
        // SAFETY: the caller's promise.
        let events = unsafe { events(&raw) }.map_err(|message| Failed(abi::BAD_INPUT, message))?;
        // Most steps come without events, and then there is nothing to take back.
        if !events.is_empty() {
            self.params_before.copy_from(&self.params);
        }
        for event in events {
            if event.kind == abi::EVENT_PARAM && !self.params.set(event.param, event.value) {
                let text = format!("{}: no parameter {} takes {}", T::ID, event.param, event.value);
                self.host.log(Level::Warn, &text);
            }
        }
        // SAFETY: the caller's promise.
        let input = unsafe { StepInput::new(raw, &self.host, &self.params) }
            .map_err(|message| Failed(abi::BAD_INPUT, message))?;
        // SAFETY: the caller's promise.
        let mut output = unsafe { Output::new(&raw_output) };
        let result = self.plugin.step(&input, &mut output);
        if result.is_err() && !events.is_empty() {
            self.params.copy_from(&self.params_before);
        }
        Ok(result?)
    }

    pub(crate) fn save(&mut self) -> Result<&[u8], Failed> {
        let writer = &mut self.saved;
        writer.begin();
        let (ids, values): (Vec<u32>, Vec<f64>) = self.params.iter().unzip();
        writer.put(PARAM_IDS, &ids);
        writer.put(PARAM_VALUES, &values);
        self.plugin.save(writer);
        writer.finished().map_err(|message| Failed(abi::ERROR, message))
    }

    /// Another instance of the same configuration, with the saved state in it.
    pub(crate) fn loaded(&mut self, version: u32, bytes: &[u8]) -> Result<Self, Failed> {
        let refused = |message: String| Failed(abi::BAD_STATE, message);
        if !(T::STATE_MIN_VERSION..=T::STATE_VERSION).contains(&version) {
            return Err(refused(format!(
                "the state is of version {version}; {} {} reads {} to {}",
                T::ID,
                T::VERSION,
                T::STATE_MIN_VERSION,
                T::STATE_VERSION
            )));
        }
        let mut reader = StateReader::parse(version, bytes).map_err(|error| refused(error.to_string()))?;
        let mut fresh = match self.spare.take() {
            Some((plugin, _)) => Self {
                params: first_params(&plugin),
                plugin,
                params_before: self.params.clone(),
                host: self.host,
                config: self.config.clone(),
                spare: None,
                saved: StateWriter::new(),
                broken: None,
            },
            None => Self::new(self.host, self.config.clone())?,
        };
        let mut read_params = || {
            let (ids, values) = (reader.get::<u32>(PARAM_IDS)?, reader.get::<f64>(PARAM_VALUES)?);
            for (id, value) in ids.into_iter().zip(values) {
                fresh.params.set(id, value); // One that is gone, or was never a number, stays at its default.
            }
            fresh.plugin.load(&mut reader)
        };
        read_params().map_err(|error| refused(error.to_string()))?;
        fresh.saved = std::mem::take(&mut self.saved);
        Ok(fresh)
    }

    /// Replaces the instance.
    pub(crate) fn replace(&mut self, fresh: Self) {
        let host = self.host;
        put_away::<T>(&host, std::mem::replace(self, fresh));
    }
}

/// Drops what a newer value stands in for; a panic of a destructor is reported, not passed on.
fn put_away<T: Plugin>(host: &Host, old: impl Sized) {
    if let Err(message) = guard::catch(move || drop(old)) {
        host.log(Level::Error, &format!("{}: while an instance was replaced: {message}", T::ID));
    }
}
