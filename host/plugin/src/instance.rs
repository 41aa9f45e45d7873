//! One instance of a plugin: made, stepped, reset, saved and loaded. Each call runs on the control thread of
//! the plugin's generation. A failure stays with this instance: its last good outputs stand still, and the
//! sea goes on.

use std::{
    ffi::c_void,
    path::Path,
    sync::Arc,
    time::{Duration, Instant},
};

use reef_abi as abi;

use super::{
    assets::{Asset, Assets},
    envelope::Envelope,
    error::PluginError,
    generation::Generation,
    health::Health,
    info::PluginInfo,
    input::StepInput,
    lent::Lent,
    library::Plugin,
    names::status_name,
    recorder::Recorder,
    saved::{LARGEST_STATE, Sink, Source, expect, read, write},
    services::{Figure, Services},
    streams::Outputs,
    tag::Tag,
};

/// How a step ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StepStatus {
    /// New outputs.
    Ok,
    /// Nothing changed: the last outputs count.
    Sleep,
    /// It refused this step: the last outputs stay.
    Discarded,
    /// It failed in this step.
    Failed,
    /// It failed earlier and was not called.
    Standing,
}

/// What a step did.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StepReport {
    /// How it ended.
    pub status: StepStatus,
    /// Why it failed or was refused.
    pub message: Option<String>,
}

/// Real time that a step took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StepTimes {
    /// From the host's thread to the library's own and back.
    pub way: Duration,
    /// The call of the library's function on that thread.
    pub code: Duration,
    /// The look at what it emitted.
    pub check: Duration,
}

/// A state without the envelope that keeps it from harm outside of the program.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Payload {
    state_version: u32,
    bytes: Vec<u8>,
}

impl Payload {
    /// Memory that it takes [bytes].
    pub fn size(&self) -> usize {
        self.bytes.capacity()
    }

    /// Memory for a state that is not there yet.
    pub(crate) fn in_memory(bytes: Vec<u8>) -> Self {
        Self { state_version: 0, bytes }
    }

    /// The state in the envelope of its plugin.
    pub fn seal(&self, plugin: &str) -> Vec<u8> {
        Envelope { plugin, state_version: self.state_version, payload: &self.bytes }.seal()
    }

    /// Its memory, for another one.
    pub fn into_memory(self) -> Vec<u8> {
        self.bytes
    }
}

/// One module of a scene at work.
#[derive(Debug)]
pub struct Instance {
    pub(super) raw: Raw,
    pub(super) recorder: Box<Recorder>,
    lent: Lent,
    health: Health,
    times: StepTimes,
    // Dropped in this order: the services' pool before the library that owns its threads.
    pub(super) services: Box<Services>,
    plugin: Plugin,
}

/// An instance's step.
pub(super) type StepFn = unsafe extern "C" fn(*mut c_void, *const abi::Step, *const abi::Output) -> i32;

/// The functions of an instance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Raw(pub(super) abi::Instance);

// SAFETY: the context is the plugin's own, and its functions are called on the control thread only.
unsafe impl Send for Raw {}
// SAFETY: as above; a shared reference calls nothing.
unsafe impl Sync for Raw {}

impl Plugin {
    /// Makes an instance. `config` is the JSON object `{"scene": …, "species": …, "config": …}`.
    pub fn create(&self, config: &str) -> Result<Instance, PluginError> {
        self.create_with(config, None, Services::table)
    }

    /// The same, where the host has a folder of assets.
    pub fn create_among(&self, config: &str, assets: &Path) -> Result<Instance, PluginError> {
        self.create_with(config, Some(assets), Services::table)
    }

    /// The same, with the table that `table` makes of the instance's services; it must live as long as they.
    pub(super) fn create_with(
        &self,
        config: &str,
        assets: Option<&Path>,
        table: impl Fn(&Services) -> *const abi::Host + Sync,
    ) -> Result<Instance, PluginError> {
        let id = &self.info().id;
        let failed = |status: i32, message: String| PluginError::Call {
            plugin: id.clone(),
            call: "create",
            status: status_name(status),
            message,
        };
        let generation = generation(self)?;
        let assets = Assets::new(id, assets, self.library().path());
        let services = Services::of_instance(generation, id, assets);
        let Some(create) = self.descriptor().create else {
            return Err(failed(abi::UNSUPPORTED, "it has no create".into()));
        };
        let mut raw = Raw(NO_INSTANCE);
        services.begin_call();
        let (place, services_of, table) = (&mut raw, &services, &table);
        let status = generation
            .enter(id, "create", move || {
                let Raw(out) = place;
                // SAFETY: the descriptor's function with the arguments that the contract asks for; the table
                // lives as long as the instance.
                unsafe { create(table(services_of), config.as_ptr().cast(), config.len() as u64, out) }
            })
            .map_err(|message| PluginError::Fault { plugin: id.clone(), call: "create", message })?;
        services.end_call();
        if status != abi::OK {
            let message = services.take_error().unwrap_or_else(|| "it gave no reason".into());
            if status == abi::BAD_INPUT {
                let (path, message) = split_path(&message);
                return Err(PluginError::Config { plugin: id.clone(), path, message });
            }
            return Err(failed(status, message));
        }
        raw.forget_beyond_its_size();
        if raw.0.step.is_none() || raw.0.destroy.is_none() {
            return Err(failed(status, "it returned an instance without step or destroy".into()));
        }
        let instance = Instance {
            recorder: Box::new(Recorder::new(self.info().traces.len() as u32)),
            raw,
            lent: Lent::default(),
            health: Health::Running,
            times: StepTimes::default(),
            services,
            plugin: self.clone(),
        };
        if instance.raw.0.spare != 0 {
            let spare = instance.raw.0.spare;
            return Err(failed(status, format!("the instance's spare field is {spare:#x}, allowed is 0")));
        }
        Ok(instance)
    }
}

pub(super) const NO_INSTANCE: abi::Instance = abi::Instance {
    size: size_of::<abi::Instance>() as u32,
    spare: 0,
    ctx: std::ptr::null_mut(),
    destroy: None,
    reset: None,
    step: None,
    save_state: None,
    load_state: None,
    get_param: None,
    get_extension: None,
};

impl Raw {
    /// Fields behind the size that the plugin left there are not its own.
    fn forget_beyond_its_size(&mut self) {
        let size = (self.0.size as usize).min(size_of::<abi::Instance>());
        let mut known = NO_INSTANCE;
        // SAFETY: both are `repr(C)` values of the contract of at least that many bytes; a prefix of one with
        // the rest of the other is a value again, since fields are whole words and `size` only ever cuts
        // between or inside functions that are dropped below.
        unsafe {
            let size = size & !7;
            std::ptr::copy_nonoverlapping(
                (&raw const self.0).cast::<u8>(),
                (&raw mut known).cast::<u8>(),
                size,
            );
        }
        self.0 = known;
    }
}

pub(super) fn generation(plugin: &Plugin) -> Result<&Generation, PluginError> {
    plugin.library().generation().ok_or_else(|| PluginError::Call {
        plugin: plugin.info().id.clone(),
        call: "load",
        status: status_name(abi::FATAL),
        message: "its library is closed".into(),
    })
}

/// Takes the JSON path off a configuration error: `anemones[3].species: what is wrong`.
fn split_path(message: &str) -> (Option<String>, String) {
    let is_path = |text: &str| {
        let good = |c: char| c.is_alphanumeric() || matches!(c, '_' | '-' | '.' | '[' | ']');
        !text.is_empty() && text.chars().all(good)
    };
    match message.split_once(": ") {
        Some((path, rest)) if is_path(path) => (Some(path.to_owned()), rest.to_owned()),
        _ => (None, message.to_owned()),
    }
}

impl Instance {
    /// The plugin that it is of.
    pub fn plugin(&self) -> &Plugin {
        &self.plugin
    }

    /// The plugin's description.
    pub fn info(&self) -> &Arc<PluginInfo> {
        self.plugin.info()
    }

    /// In what state it is.
    pub fn health(&self) -> &Health {
        let generation = self.plugin.library().generation();
        generation.and_then(Generation::quarantine).unwrap_or(&self.health)
    }

    /// What the last good step emitted.
    pub fn outputs(&self) -> &Arc<Outputs> {
        self.recorder.current()
    }

    /// It is not to be stepped any more, for a reason that no step gave.
    pub fn condemn(&mut self, reason: String) {
        self.health = Health::Faulty(reason);
    }

    /// What it shows of itself: names and last values, in the order in which it first did.
    pub fn figures(&self) -> Vec<Figure> {
        self.services.figures()
    }

    /// The files of its module's own that it has read.
    pub fn assets(&self) -> Vec<Asset> {
        self.services.assets()
    }

    /// Real time of the last step.
    pub fn times(&self) -> StepTimes {
        self.times
    }

    /// Steps once. Never fails as a whole: the report says what happened, and [`Instance::outputs`] holds
    /// what counts.
    pub fn step(&mut self, input: &StepInput<'_>, events: &[abi::Event]) -> StepReport {
        self.step_with(input, events, |step, ctx, input, output| {
            // SAFETY: the instance's function on its control thread; input and output live during the call,
            // and nobody else uses the recorder meanwhile.
            unsafe { step(ctx, input, output) }
        })
    }

    /// The same, with the call left to `call`, which runs guarded on the control thread.
    pub(super) fn step_with(
        &mut self,
        input: &StepInput<'_>,
        events: &[abi::Event],
        call: impl FnOnce(StepFn, *mut c_void, &abi::Step, &abi::Output) -> i32 + Send,
    ) -> StepReport {
        if let Health::Stopped(message) | Health::Faulty(message) = self.health() {
            return StepReport { status: StepStatus::Standing, message: Some(message.clone()) };
        }
        let (Some(step), Some(generation)) = (self.raw.0.step, self.plugin.library().generation()) else {
            return StepReport {
                status: StepStatus::Standing,
                message: Some("its library is closed".into()),
            };
        };
        self.services.begin_step(input);
        self.recorder.begin();
        let (raw, recorder) = (self.raw, &mut *self.recorder);
        let step_input = Shown(self.lent.step(input, events));
        let output = Shown(recorder.table());
        // The plugin may have changed its table: what the host goes on with is its own.
        let own = Pointer((&raw mut *recorder).cast());
        let began = Instant::now();
        let (step_input, output) = (&step_input, &output);
        let code = move || {
            let (Raw(instance), Shown(step_input), Shown(output)) = ({ raw }, step_input, output);
            let called = Instant::now();
            let status = call(step, instance.ctx, step_input, output);
            (status, called.elapsed())
        };
        // Checked where the workers are, and while much of it is near to them.
        let (flags, pool, services) = (input.flags, generation.pool(), &*self.services);
        let checked = move |(status, code): (i32, Duration)| {
            if status != abi::OK {
                return (status, [code, Duration::ZERO], Ok(()));
            }
            let returned = Instant::now();
            let Pointer(own) = { own };
            // SAFETY: this instance's recorder; the plugin's call is over, and its jobs with it.
            let recorder = unsafe { &mut *own.cast::<Recorder>() };
            let share = |count: usize, job: &(dyn Fn(usize) + Sync)| pool.share(count, job);
            let checked = services
                .scratch_is_whole()
                .and_then(|()| recorder.finish(flags, (services.textures(), services.meshes()), &share));
            (status, [code, returned.elapsed()], checked)
        };
        let outcome = generation.enter_then(&self.plugin.info().id, "step", code, checked);
        self.services.end_step();
        self.recorder.end();
        for news in self.recorder.news() {
            tracing::warn!("plugin `{}`: {news}", self.plugin.info().id);
        }
        let whole = began.elapsed();
        let mut took = [Duration::ZERO; 2];
        let report = match outcome {
            Ok((status, times, checked)) => {
                took = times;
                self.conclude(status, checked)
            }
            Err(message) => StepReport { status: StepStatus::Failed, message: Some(message) },
        };
        let [code, check] = took;
        self.times = StepTimes { way: whole.saturating_sub(code + check), code, check };
        report
    }

    fn conclude(&mut self, status: i32, checked: Result<(), String>) -> StepReport {
        let given = self.services.take_error().or_else(|| self.recorder.take_message());
        let reason = || given.unwrap_or_else(|| "it gave no reason".into());
        let report = |status, message| StepReport { status, message };
        match status {
            abi::OK => match checked {
                Ok(()) => report(StepStatus::Ok, None),
                Err(message) => {
                    self.health = Health::Faulty(message.clone());
                    report(StepStatus::Failed, Some(message))
                }
            },
            abi::SLEEP => report(StepStatus::Sleep, None),
            abi::DISCARD => report(StepStatus::Discarded, Some(reason())),
            abi::ERROR | abi::UNSUPPORTED | abi::NO_SPACE | abi::BAD_INPUT | abi::BAD_STATE => {
                let message = format!("step failed ({}): {}", status_name(status), reason());
                self.health = Health::Stopped(message.clone());
                report(StepStatus::Failed, Some(message))
            }
            _ => {
                let message = format!("step failed ({}): {}", status_name(status), reason());
                self.health = Health::Faulty(message.clone());
                report(StepStatus::Failed, Some(message))
            }
        }
    }

    /// Calls one of the instance's functions on its control thread; a failure comes back with its message.
    pub(super) fn call(
        &self,
        name: &'static str,
        call: impl FnOnce(*mut c_void, &abi::Instance) -> Option<i32> + Send,
    ) -> Result<(), (i32, PluginError)> {
        let failed = |status: i32, message: String| {
            let plugin = self.info().id.clone();
            (status, PluginError::Call { plugin, call: name, status: status_name(status), message })
        };
        let generation = generation(&self.plugin).map_err(|error| (abi::FATAL, error))?;
        self.services.begin_call();
        let raw = self.raw;
        let status = generation.enter(&self.info().id, name, move || {
            let Raw(instance) = { raw };
            call(instance.ctx, &instance)
        });
        self.services.end_call();
        match status {
            Err(message) => {
                let plugin = self.info().id.clone();
                Err((abi::FATAL, PluginError::Fault { plugin, call: name, message }))
            }
            Ok(Some(abi::OK)) => Ok(()),
            Ok(Some(status)) => {
                let reason = self.services.take_error().unwrap_or_else(|| "it gave no reason".into());
                Err(failed(status, reason))
            }
            Ok(None) => Err(failed(abi::UNSUPPORTED, "the plugin does not offer it".into())),
        }
    }

    /// Back to the state after `create`, parameters included. Outputs are empty until the next step.
    pub fn reset(&mut self) -> Result<(), PluginError> {
        // SAFETY: the instance's function on its control thread.
        let result = self.call("reset", |ctx, raw| raw.reset.map(|reset| unsafe { reset(ctx) }));
        match result {
            Ok(()) => {
                self.recorder.forget();
                self.health = Health::Running;
                Ok(())
            }
            Err((_, error)) => {
                self.health = Health::Faulty(error.to_string());
                Err(error)
            }
        }
    }

    /// The whole state of the instance, in its envelope.
    pub fn save(&mut self) -> Result<Vec<u8>, PluginError> {
        let payload = self.save_payload(Vec::new())?;
        Ok(payload.seal(&self.info().id))
    }

    /// The whole state of the instance, to be kept in this program's memory. `memory`: to write it into.
    pub fn save_payload(&mut self, mut memory: Vec<u8>) -> Result<Payload, PluginError> {
        memory.clear();
        let generation = generation(&self.plugin)?.number();
        let mut sink = Sink { generation, room: LARGEST_STATE, bytes: memory, ..Sink::default() };
        sink.tag.set();
        let sink_pointer = Pointer((&raw mut sink).cast());
        self.call("save_state", move |ctx, raw| {
            let Pointer(sink) = { sink_pointer };
            let writer = abi::Writer {
                size: size_of::<abi::Writer>() as u32,
                spare: 0,
                ctx: sink,
                write: Some(write),
                expect: Some(expect),
            };
            // SAFETY: the instance's function on its control thread; the writer and the sink live during the
            // call.
            raw.save_state.map(|save| unsafe { save(ctx, &writer) })
        })
        .map_err(|(_, error)| error)?;
        if sink.overflow {
            return Err(self.state_error(format!("it is larger than {LARGEST_STATE} bytes")));
        }
        Ok(Payload { state_version: self.info().state_version, bytes: sink.bytes })
    }

    /// Takes over a saved state. On an error the instance is as it was.
    pub fn load(&mut self, state: &[u8]) -> Result<(), PluginError> {
        let envelope = Envelope::open(state).map_err(|message| self.state_error(message))?;
        let info = self.info();
        if envelope.plugin != info.id {
            return Err(self.state_error(format!("it is of plugin `{}`", envelope.plugin)));
        }
        let readable = info.state_min_version..=info.state_version;
        if !readable.contains(&envelope.state_version) {
            return Err(self.state_error(format!(
                "it is of state version {}; version {} of the plugin reads {} to {}",
                envelope.state_version,
                info.version,
                readable.start(),
                readable.end()
            )));
        }
        self.load_bytes(envelope.state_version, envelope.payload)
    }

    /// Takes over a state that an instance of the same build gave. On an error the instance is as it was.
    pub fn load_payload(&mut self, payload: &Payload) -> Result<(), PluginError> {
        self.load_bytes(payload.state_version, &payload.bytes)
    }

    fn load_bytes(&mut self, state_version: u32, bytes: &[u8]) -> Result<(), PluginError> {
        let mut source = Source { rest: bytes, most: usize::MAX, tag: Tag::default() };
        source.tag.set();
        let source_pointer = Pointer((&raw mut source).cast());
        let result = self.call("load_state", move |ctx, raw| {
            let Pointer(source) = { source_pointer };
            let reader = abi::Reader {
                size: size_of::<abi::Reader>() as u32,
                state_version,
                ctx: source,
                read: Some(read),
                length: bytes.len() as u64,
            };
            // SAFETY: the instance's function on its control thread; the reader and the source live during
            // the call.
            raw.load_state.map(|load| unsafe { load(ctx, &reader) })
        });
        match result {
            Ok(()) => {
                self.recorder.forget();
                self.health = Health::Running;
                Ok(())
            }
            Err((abi::BAD_STATE, PluginError::Call { message, .. })) => Err(self.state_error(message)),
            Err((_, error)) => Err(error),
        }
    }

    /// The present value of a parameter.
    pub fn param(&self, id: u32) -> Result<f64, PluginError> {
        let mut value = 0.0;
        let place = Pointer((&raw mut value).cast());
        self.call("get_param", move |ctx, raw| {
            let Pointer(place) = { place };
            // SAFETY: the instance's function on its control thread; the value lives during the call.
            raw.get_param.map(|get| unsafe { get(ctx, id, place.cast::<f64>()) })
        })
        .map_err(|(_, error)| error)?;
        Ok(value)
    }

    fn state_error(&self, message: String) -> PluginError {
        PluginError::State { plugin: self.info().id.clone(), message }
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        if generation(&self.plugin).is_ok_and(|generation| generation.quarantine().is_some()) {
            return;
        }
        let destroyed = self.call("destroy", |ctx, raw| {
            raw.destroy.map(|destroy| {
                // SAFETY: the last call on the instance, on its control thread.
                unsafe { destroy(ctx) };
                abi::OK
            })
        });
        // The function itself cannot fail.
        if let Err((_, PluginError::Fault { message, .. })) = destroyed {
            tracing::warn!("{message}");
        }
    }
}

/// A pointer on its way to the control thread, which uses it while its owner waits.
pub(super) struct Pointer(pub(super) *mut c_void);

// SAFETY: `Generation::run` returns when the control thread is done with it.
unsafe impl Send for Pointer {}

/// Something of the contract on its way to the control thread, which reads it while its owner waits.
struct Shown<T>(T);

// SAFETY: as above: what it points to lives, and changes through the plugin alone, until the call returned.
unsafe impl<T> Sync for Shown<T> {}
