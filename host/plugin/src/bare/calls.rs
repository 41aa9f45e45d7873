//! Calls that the host itself never makes: tables of another size, a writer that is full, a reader that gives
//! little.

use std::ffi::{CStr, c_void};

use reef_abi as abi;

use super::super::{
    assets::Assets,
    error::PluginError,
    input::StepInput,
    instance::{Instance, NO_INSTANCE, Pointer, StepReport, generation},
    library::Plugin,
    names::status_name,
    recorder,
    retained::Refused,
    saved::{Sink, Source, expect, read, write},
    services::Services,
    tag::Tag,
};
use super::process::float_control;

/// How often jobs reserved or committed, in this process.
pub fn misplaced() -> u64 {
    recorder::misplaced()
}

/// A struct of the contract as a newer version of it would be: fields that this version does not know follow.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Grown<T> {
    known: T,
    later: [u64; 8],
}

/// What stands where nobody may write, and where nobody need look.
const LATER: u64 = 0x5a5a_5a5a_5a5a_5a5a;

impl<T> Grown<T> {
    /// `known` says by itself how large it is.
    fn new(known: T) -> Self {
        Self { known, later: [LATER; 8] }
    }
}

/// Bytes of a grown struct.
const fn grown<T>() -> u32 {
    size_of::<Grown<T>>() as u32
}

/// What `create` did with a table of some size.
#[derive(Clone, Debug)]
pub struct Filled {
    /// What it returned, `abi::OK` or another.
    pub status: i32,
    /// What it said with `set_error`.
    pub message: Option<String>,
    /// Bytes that it says to have filled.
    pub size: u32,
    /// Functions of the table that are there.
    pub functions: [(&'static str, bool); 6],
    /// Nothing behind the size that it was given was written.
    pub kept: bool,
}

/// A place for an instance, on its way to the control thread.
struct Place(*mut abi::Instance);

// SAFETY: the control thread uses it while its owner waits.
unsafe impl Send for Place {}

impl Plugin {
    /// Calls `create` with a table of `size` bytes, with nonsense behind it; an instance that comes of it is
    /// destroyed.
    pub fn create_sized(&self, config: &str, size: u32) -> Result<Filled, PluginError> {
        let id = &self.info().id;
        let fault = |message| PluginError::Fault { plugin: id.clone(), call: "create", message };
        let generation = generation(self)?;
        let services = Services::of_instance(generation, id, Assets::new(id, None, self.library().path()));
        let Some(create) = self.descriptor().create else {
            return Err(fault("it has no create".into()));
        };
        let empty = Grown::new(abi::Instance { size, ..NO_INSTANCE });
        let mut given = empty;
        let words = size_of_val(&given) / 8;
        // SAFETY: a `repr(C)` struct of whole words, all of them initialised; any words are a value of it.
        let bytes = |grown: &Grown<abi::Instance>| unsafe {
            std::slice::from_raw_parts((&raw const *grown).cast::<u64>(), words).to_vec()
        };
        let first = (size as usize / 8).min(words);
        for word in first..words {
            // SAFETY: inside the struct, as above: functions that are not offered are never called.
            unsafe { (&raw mut given).cast::<u64>().add(word).write(LATER) };
        }
        services.begin_call();
        let (place, services_of) = (Place((&raw mut given).cast()), &services);
        let status = generation
            .enter(id, "create", move || {
                let Place(out) = { place };
                // SAFETY: the descriptor's function; the table at `out` is as long as it says, and longer.
                unsafe { create(services_of.table(), config.as_ptr().cast(), config.len() as u64, out) }
            })
            .map_err(fault)?;
        let kept = bytes(&given)[first..].iter().all(|word| *word == LATER);
        let message = services.take_error();
        // Only what lies in front of the size is a function.
        let mut known = empty;
        // SAFETY: as above: whole words of one value over those of another.
        unsafe {
            let (from, to) = ((&raw const given).cast::<u64>(), (&raw mut known).cast::<u64>());
            std::ptr::copy_nonoverlapping(from, to, first.min(size_of::<abi::Instance>() / 8));
        }
        let table = known.known;
        if let (abi::OK, Some(destroy)) = (status, table.destroy) {
            let ctx = Pointer(table.ctx);
            generation
                .enter(id, "destroy", move || {
                    let Pointer(ctx) = { ctx };
                    // SAFETY: the instance's own function, its last call.
                    unsafe { destroy(ctx) };
                })
                .map_err(|message| PluginError::Fault { plugin: id.clone(), call: "destroy", message })?;
        }
        Ok(Filled { status, message, size: table.size, functions: functions(&table), kept })
    }

    /// Makes an instance whose host is a newer one.
    pub fn create_in_grown_host(&self, config: &str) -> Result<Instance, PluginError> {
        self.create_with(config, None, |services| {
            // SAFETY: the services' own table, which lives as long as they.
            let mut table = unsafe { *services.table() };
            table.size = grown::<abi::Host>();
            // As long as the instance, which is as long as the checker's process.
            let table: &'static Grown<abi::Host> = Box::leak(Box::new(Grown::new(table)));
            &table.known
        })
    }
}

fn functions(table: &abi::Instance) -> [(&'static str, bool); 6] {
    [
        ("destroy", table.destroy.is_some()),
        ("reset", table.reset.is_some()),
        ("step", table.step.is_some()),
        ("save_state", table.save_state.is_some()),
        ("load_state", table.load_state.is_some()),
        ("get_param", table.get_param.is_some()),
    ]
}

/// Which of the structs of a call are those of a newer host.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Newer {
    /// `reef_step`.
    Step,
    /// `reef_output`.
    Output,
}

impl Instance {
    /// The instance's functions, and whether it offers them.
    pub fn functions(&self) -> [(&'static str, bool); 6] {
        functions(&self.raw.0)
    }

    /// Whether it has an extension; None: it has none at all.
    pub fn has_extension(&self, id: &CStr) -> Result<Option<bool>, PluginError> {
        let mut there = None;
        let place = Pointer((&raw mut there).cast());
        self.call("get_extension", move |ctx, raw| {
            let Pointer(there) = { place };
            if let Some(ask) = raw.get_extension {
                // SAFETY: the instance's function on its control thread; the text and `there` live during the
                // call.
                unsafe { there.cast::<Option<bool>>().write(Some(!ask(ctx, id.as_ptr()).is_null())) };
            }
            Some(abi::OK)
        })
        .map_err(|(_, error)| error)?;
        Ok(there)
    }

    /// Steps with a struct of a newer host.
    pub fn step_newer(&mut self, input: &StepInput<'_>, events: &[abi::Event], newer: Newer) -> StepReport {
        self.step_with(input, events, |step, ctx, input, output| {
            let size = if newer == Newer::Step { grown::<abi::Step>() } else { input.size };
            let input = Grown::new(abi::Step { size, ..*input });
            let size = if newer == Newer::Output { grown::<abi::Output>() } else { output.size };
            let output = Grown::new(abi::Output { size, ..*output });
            // SAFETY: the instance's function on its control thread; both are as long as they say.
            unsafe { step(ctx, &input.known, &output.known) }
        })
    }

    /// Steps, and tells the floating-point unit's control bits before and after, within the call.
    pub fn step_float(&mut self, input: &StepInput<'_>) -> [u64; 2] {
        let mut seen = [0; 2];
        let place = Pointer((&raw mut seen).cast());
        // Whether it fails is for others.
        let _ = self.step_with(input, &[], move |step, ctx, input, output| {
            let Pointer(seen) = { place };
            let before = float_control();
            // SAFETY: the instance's function on its control thread; input and output live during the call,
            // and so does `seen`.
            unsafe {
                let status = step(ctx, input, output);
                seen.cast::<[u64; 2]>().write([before, float_control()]);
                status
            }
        });
        seen
    }

    /// Between two steps: fills scratch memory with nonsense.
    pub fn soil_scratch(&self) {
        self.services.soil();
    }

    /// Between two steps: fills the room for elements with nonsense.
    pub fn soil_outputs(&mut self) {
        self.recorder.soil();
    }

    /// Throws the last outputs away, as the host does after a trial step.
    pub fn forget(&mut self) {
        self.recorder.forget();
    }

    /// How many elements of a stream the last step committed; None: it did not commit it.
    pub fn committed(&self, stream: u32) -> Option<u64> {
        self.recorder.committed(stream)
    }

    /// The state's bytes without their envelope, in a writer that has `room` for so many, and is a newer
    /// host's or not.
    pub fn save_bare(&mut self, room: usize, newer: bool) -> Result<Vec<u8>, PluginError> {
        let generation = generation(self.plugin())?.number();
        let mut sink = Sink { generation, room, ..Sink::default() };
        sink.tag.set();
        let place = Pointer((&raw mut sink).cast());
        self.call("save_state", move |ctx, raw| {
            let Pointer(sink) = { place };
            let size = if newer { grown::<abi::Writer>() } else { size_of::<abi::Writer>() as u32 };
            let writer = Grown::new(abi::Writer {
                size,
                spare: 0,
                ctx: sink,
                write: Some(write),
                expect: Some(expect),
            });
            // SAFETY: the instance's function on its control thread; the writer and the sink live during the
            // call.
            raw.save_state.map(|save| unsafe { save(ctx, &writer.known) })
        })
        .map_err(|(_, error)| error)?;
        Ok(sink.bytes)
    }

    /// Gives bytes without an envelope to `load_state`; Err: the status, and what it said.
    pub fn load_bare(&mut self, state: Bare<'_>) -> Result<(), (i32, PluginError)> {
        let mut source = Source { rest: state.bytes, most: state.at_once, tag: Tag::default() };
        source.tag.set();
        let length = state.bytes.len() as u64;
        let place = Pointer((&raw mut source).cast());
        let result = self.call("load_state", move |ctx, raw| {
            let Pointer(source) = { place };
            let size = if state.newer { grown::<abi::Reader>() } else { size_of::<abi::Reader>() as u32 };
            let reader =
                abi::Reader { size, state_version: state.version, ctx: source, read: Some(read), length };
            let reader = Grown::new(reader);
            // SAFETY: the instance's function on its control thread; the reader and the source live during
            // the call.
            raw.load_state.map(|load| unsafe { load(ctx, &reader.known) })
        });
        if result.is_ok() {
            self.recorder.forget();
        }
        result
    }

    /// Destroys it; Err: what its code did in place of returning.
    pub fn destroy(mut self) -> Result<(), PluginError> {
        self.end()
    }

    /// Destroys it, and tells what was refused of its textures and of its meshes in its life.
    pub fn destroy_and_tell(mut self) -> Result<[Refused; 2], PluginError> {
        self.end()?;
        Ok([self.services.refused_textures(), self.services.refused_meshes()])
    }

    fn end(&mut self) -> Result<(), PluginError> {
        let result = self.call("destroy", |ctx: *mut c_void, raw| {
            raw.destroy.map(|destroy| {
                // SAFETY: the last call on the instance, on its control thread: below it is taken from the
                // table.
                unsafe { destroy(ctx) };
                abi::OK
            })
        });
        self.raw.0.destroy = None;
        result.map_err(|(_, error)| error)
    }
}

/// A state without an envelope, and how it is read.
#[derive(Clone, Copy, Debug)]
pub struct Bare<'a> {
    /// The payload.
    pub bytes: &'a [u8],
    /// Its version, by the plugin's own count.
    pub version: u32,
    /// Most bytes that a call of `read` gives.
    pub at_once: usize,
    /// The reader is a newer host's.
    pub newer: bool,
}

impl<'a> Bare<'a> {
    /// As the host gives it.
    pub fn new(bytes: &'a [u8], version: u32) -> Self {
        Self { bytes, version, at_once: usize::MAX, newer: false }
    }
}

/// A status as the header names it.
pub fn status(status: i32) -> String {
    status_name(status)
}
