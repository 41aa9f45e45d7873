//! The plugin that is checked: loaded, made and stepped in the ways that most checks need.

use std::{
    ops::Range,
    path::{Path, PathBuf},
    time::Duration,
};

use reef_abi as abi;
use reef_command::Common;
use reef_plugin::{
    Instance, Library, Plugin, PluginError, StepInput, StepStatus, bare::survey::Descriptor,
    envelope::Envelope, image::Image, inspect,
};
use reef_sea::scene::assets;
use reef_streams::Outputs;

use super::{
    Args,
    config::Config,
    limit,
    sea::Sea,
    verdict::{Not, broken},
};

/// Workers, where a check says nothing about them.
pub(super) const WORKERS: usize = 2;

/// What is checked, and how.
pub(super) struct Subject {
    /// The library's file.
    pub(super) path: PathBuf,
    /// What is in it.
    pub(super) image: Image<'static>,
    /// Which of its plugins; None: the only one.
    pub(super) plugin: Option<String>,
    pub(super) config: Config,
    assets: PathBuf,
    /// The longest that the check may take.
    pub(super) limit: Duration,
}

impl Subject {
    /// Err: the file cannot be read.
    pub(super) fn new(common: &Common, args: &Args, path: &Path, config: Config) -> Result<Self, String> {
        Ok(Self {
            image: inspect::read(path).map_err(|refusal| refusal.to_string())?,
            path: path.to_owned(),
            plugin: args.plugin.clone(),
            config,
            // Species come from there; a plugin that names none needs no such folder.
            assets: assets::folder(common.assets.as_deref()).unwrap_or_default(),
            limit: limit(args),
        })
    }

    /// Loads and opens the library.
    pub(super) fn open(&self, workers: usize) -> Result<Library, Not> {
        Ok(Library::open_image(&self.path, &self.image, workers)?)
    }

    /// Its descriptors as they stand.
    pub(super) fn descriptors(&self) -> Result<Vec<Descriptor>, Not> {
        let surveyed = self.open(1)?.survey().map_err(Not::Kept)?;
        Ok(surveyed.into_iter().flatten().collect())
    }

    /// The plugin, in a library that was loaded anew.
    pub(super) fn load(&self, workers: usize) -> Result<Plugin, Not> {
        let (_, plugins) = Library::load_image(&self.path, &self.image, workers)?;
        let mut plugins = plugins.into_iter();
        match &self.plugin {
            None => plugins.next(),
            Some(id) => plugins.find(|plugin| plugin.info().id == *id),
        }
        .ok_or_else(|| Not::Kept("the library has no such plugin any more".into()))
    }

    /// What `create` gets.
    pub(super) fn create_text(&self, plugin: &Plugin) -> Result<String, Not> {
        self.config.for_create(plugin.info(), &self.assets)
    }

    /// A new instance.
    pub(super) fn create(&self, plugin: &Plugin) -> Result<Instance, Not> {
        plugin.create(&self.create_text(plugin)?).map_err(|error| match error {
            PluginError::Config { .. } => Not::Configured(error.to_string()),
            error => Not::Kept(error.to_string()),
        })
    }

    /// A new instance in a library that was loaded anew.
    pub(super) fn fresh(&self) -> Result<(Plugin, Instance), Not> {
        let plugin = self.load(WORKERS)?;
        let instance = self.create(&plugin)?;
        Ok((plugin, instance))
    }

    /// A new instance after some steps in the usual sea.
    pub(super) fn stepped(&self, steps: u64) -> Result<(Plugin, Instance), Not> {
        let (plugin, mut instance) = self.fresh()?;
        run(&mut instance, &Sea::usual(), 0..steps)?;
        Ok((plugin, instance))
    }
}

/// One step, which must not fail.
pub(super) fn step(
    instance: &mut Instance,
    input: &StepInput<'_>,
    events: &[abi::Event],
) -> Result<StepStatus, Not> {
    let report = instance.step(input, events);
    match report.status {
        StepStatus::Ok | StepStatus::Sleep | StepStatus::Discarded => Ok(report.status),
        StepStatus::Failed | StepStatus::Standing => {
            broken!("step {}: {}", input.step, report.message.unwrap_or_else(|| "it failed".into()))
        }
    }
}

/// Steps, each of which must not fail.
pub(super) fn run(instance: &mut Instance, sea: &Sea, steps: Range<u64>) -> Result<(), Not> {
    for number in steps {
        step(instance, &sea.input(number), &[])?;
    }
    Ok(())
}

/// Sets parameters, in one step.
pub(super) fn set(instance: &mut Instance, values: &[(u32, f64)]) -> Result<(), Not> {
    let event = |&(param, value): &(u32, f64)| abi::Event {
        kind: abi::EVENT_PARAM,
        param,
        value,
        ..Default::default()
    };
    let events: Vec<abi::Event> = values.iter().map(event).collect();
    step(instance, &Sea::usual().input(1), &events)?;
    Ok(())
}

/// The state without its envelope.
pub(super) fn payload(instance: &mut Instance) -> Result<Vec<u8>, Not> {
    let state = instance.save()?;
    let envelope = Envelope::open(&state).map_err(Not::Kept)?;
    Ok(envelope.payload.to_vec())
}

/// All that was emitted without being asked for, as bytes.
pub(super) fn emitted(outputs: &Outputs) -> Vec<u8> {
    let mut bytes = Vec::new();
    for (_, count, elements) in outputs.all_bytes().filter(|(stream, ..)| stream.is_wanted(0)) {
        bytes.extend_from_slice(&(count as u64).to_le_bytes());
        bytes.extend_from_slice(elements);
    }
    bytes
}

/// All that was emitted and would be saved, as bytes.
pub(super) fn everything(instance: &mut Instance) -> Result<Vec<u8>, Not> {
    let mut bytes = emitted(instance.outputs());
    if offers(instance, "save_state") {
        bytes.extend(payload(instance)?);
    }
    Ok(bytes)
}

/// Does its table have this function?
pub(super) fn offers(instance: &Instance, function: &str) -> bool {
    instance.functions().iter().any(|(name, there)| *name == function && *there)
}

/// Where two runs of bytes begin to differ, in words.
pub(super) fn difference(one: &[u8], other: &[u8]) -> Option<String> {
    if one == other {
        return None;
    }
    if one.len() != other.len() {
        return Some(format!("{} bytes and {}", one.len(), other.len()));
    }
    let at = one.iter().zip(other).position(|(a, b)| a != b)?;
    Some(format!("they differ from byte {at} of {} on", one.len()))
}
