//! One module of a sea at work.

use std::path::Path;

use reef_abi as abi;
use reef_plugin::{Health, Instance, PluginError, Registry};

use super::world::WorldError;
use crate::scene::Module;

/// One module at work.
#[derive(Debug)]
pub(crate) struct Member {
    pub(crate) name: String,
    /// What the scene sets from the start.
    pub(super) params: Vec<(u32, f64)>,
    pub(crate) instance: Instance,
    pub(super) events: Vec<abi::Event>,
    /// Parameters that changed while it stood still: they come before the next step's events.
    pub(crate) missed: Vec<abi::Event>,
    pub(crate) standing: bool,
    /// Steps that this instance discarded: told the first times, and then at growing distances.
    pub(crate) discards: u64,
    /// It does not give its state: asked once.
    pub(crate) unsavable: bool,
    /// It has made steps: what the scene sets from the start was set.
    pub(super) known: bool,
}

impl Member {
    /// It runs, and gives its state as far as is known.
    pub(crate) fn is_savable(&self) -> bool {
        !self.unsavable && *self.instance.health() == Health::Running
    }

    pub(crate) fn new(name: &str, params: &[(u32, f64)], instance: Instance) -> Self {
        Self {
            name: name.to_owned(),
            params: params.to_vec(),
            instance,
            events: Vec::new(),
            missed: Vec::new(),
            standing: false,
            discards: 0,
            unsavable: false,
            known: false,
        }
    }

    /// Parameters that an edited scene sets to other values than before.
    pub(crate) fn changed_params<'a>(&self, new: &'a [(u32, f64)]) -> impl Iterator<Item = (u32, f64)> + 'a {
        let old = self.params.clone();
        new.iter().filter(move |param| !old.contains(param)).copied()
    }

    /// Goes on in an edited scene, which sets these parameters from the start. One that stands still is told
    /// about again.
    pub(crate) fn go_on(&mut self, params: &[(u32, f64)]) {
        self.params = params.to_vec();
        self.known = true;
        self.heard_anew();
    }

    /// Whatever it does from now on is told as if for the first time.
    fn heard_anew(&mut self) {
        self.standing = false;
        self.discards = 0;
    }

    /// Begins with another state.
    pub(crate) fn begin_anew(&mut self) {
        self.heard_anew();
        self.unsavable = false;
    }

    /// What the scene sets from the start.
    pub(crate) fn first_events(&self) -> impl Iterator<Item = abi::Event> {
        self.params.iter().map(|&(id, value)| param_event(id, value))
    }
}

/// Makes the instance of a module; what its plugin says about the configuration is told at its place in the
/// scene.
pub(crate) fn instance_of(
    module: &Module,
    config: &str,
    assets: &Path,
    plugins: &Registry,
) -> Result<Instance, WorldError> {
    let plugin = plugins.get(&module.plugin).ok_or_else(|| WorldError::NoPlugin(module.plugin.clone()))?;
    plugin.create_among(config, assets).map_err(|error| match error {
        PluginError::Config { path, message, .. } => {
            let told = path.map_or(message.clone(), |path| format!("{path}: {message}"));
            module.create_error(&told).into()
        }
        source => WorldError::Module { module: module.name.clone(), source },
    })
}

/// How many of a module's discarded steps are told one by one.
const FIRST_DISCARDS: u64 = 3;

/// What is told of a module's discarded step with this number: all of the first ones, then each whose number
/// is twice as great as that of the last one told.
pub(super) fn counted(number: u64, text: &str) -> Option<String> {
    match number {
        ..FIRST_DISCARDS => Some(text.to_owned()),
        FIRST_DISCARDS => {
            Some(format!("{text} (for the 3rd time: from now on every 2nd, 4th, 8th … time is told)"))
        }
        _ if number.is_power_of_two() => Some(format!("{text} (for the {number}th time)")),
        _ => None,
    }
}

pub(super) fn param_event(id: u32, value: f64) -> abi::Event {
    abi::Event { kind: abi::EVENT_PARAM, param: id, value, ..abi::Event::default() }
}
