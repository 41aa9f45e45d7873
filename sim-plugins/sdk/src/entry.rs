//! The C side of a plugin: entry, descriptor, instance functions.

use std::{
    any::TypeId,
    cell::UnsafeCell,
    collections::HashMap,
    ffi::{CString, c_char, c_void},
    ptr,
    sync::{Mutex, PoisonError},
};

use reef_abi as abi;

use crate::{
    Plugin,
    config::{self, SceneInfo},
    error::{ConfigError, Reset, Status, StepError},
    guard,
    host::{Host, Level, read_sized},
    param::{self, Param, Params},
    state::{StateReader, StateWriter},
    step::{Output, StepInput, events},
};

// -------------------------------------------------------------------------------------------------------
// descriptors

/// A pointer to a descriptor that may stand in a static.
#[doc(hidden)]
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub struct DescriptorPointer(*const abi::Descriptor);
// SAFETY: it leads to a descriptor in a static; who reads it, and when, is `Slots`' business.
unsafe impl Sync for DescriptorPointer {}
// SAFETY: as above.
unsafe impl Send for DescriptorPointer {}

/// A descriptor that `open` fills and `close` clears: its texts need memory, which a static cannot have.
#[doc(hidden)]
#[derive(Debug)]
pub struct Slot {
    descriptor: UnsafeCell<abi::Descriptor>,
    /// What the descriptor points to.
    texts: Mutex<Option<Texts>>,
    fill: fn() -> Result<(abi::Descriptor, Texts), String>,
}

// SAFETY: the descriptor is written by `open` and `close` only, which `Slots` locks, while the host does not
// read it: it reads between its own open and close.
unsafe impl Sync for Slot {}

impl Slot {
    /// The slot of plugin T, empty.
    pub const fn new<T: Plugin>() -> Self {
        Self { descriptor: UnsafeCell::new(NO_DESCRIPTOR), texts: Mutex::new(None), fill: describe::<T> }
    }
}

const NO_DESCRIPTOR: abi::Descriptor = abi::Descriptor {
    size: 0,
    flags: 0,
    id: ptr::null(),
    name: ptr::null(),
    version: ptr::null(),
    vendor: ptr::null(),
    description: ptr::null(),
    config_schema: ptr::null(),
    params: ptr::null(),
    param_count: 0,
    state_version: 0,
    state_min_version: 0,
    spare: 0,
    create: None,
    traces: ptr::null(),
    trace_count: 0,
    spare_traces: 0,
};

/// The slots of a library, and how many times it is open (a program that links a model may open it more than
/// once).
#[doc(hidden)]
#[derive(Debug)]
pub struct Slots<const N: usize> {
    slots: [Slot; N],
    opened: Mutex<u32>,
}

impl<const N: usize> Slots<N> {
    /// Slots that nobody has opened.
    pub const fn new(slots: [Slot; N]) -> Self {
        Self { slots, opened: Mutex::new(0) }
    }
}

/// Where the descriptors are.
#[doc(hidden)]
pub const fn descriptor_pointers<const N: usize>(slots: &'static Slots<N>) -> [DescriptorPointer; N] {
    let mut pointers = [DescriptorPointer(ptr::null()); N];
    let mut i = 0;
    while i < N {
        pointers[i] = DescriptorPointer(slots.slots[i].descriptor.get());
        i += 1;
    }
    pointers
}

/// Fills the descriptors.
///
/// # Safety
/// `host` is NULL or the host's table.
#[doc(hidden)]
pub unsafe fn open<const N: usize>(slots: &'static Slots<N>, host: *const abi::Host) -> i32 {
    guard::install_hook();
    // SAFETY: the caller's promise.
    let host = unsafe { Host::from_raw(host) };
    let opened = guard::catch(|| {
        let mut opened = slots.opened.lock().unwrap_or_else(PoisonError::into_inner);
        if *opened == 0 {
            for slot in &slots.slots {
                let (descriptor, texts) = (slot.fill)()?;
                *slot.texts.lock().unwrap_or_else(PoisonError::into_inner) = Some(texts);
                // SAFETY: nobody has the library open, and the lock is held: nobody reads or writes the
                // descriptor.
                unsafe { *slot.descriptor.get() = descriptor };
            }
        }
        *opened += 1;
        Ok::<(), String>(())
    });
    match opened.and_then(|result| result) {
        Ok(()) => abi::OK,
        Err(message) => {
            if let Some(host) = host {
                host.set_error(&message);
            }
            abi::FATAL
        }
    }
}

/// Clears the descriptors when the last user closes the library.
#[doc(hidden)]
pub fn close<const N: usize>(slots: &'static Slots<N>) {
    // A panic here has nowhere to go: close returns nothing.
    let _ = guard::catch(|| {
        let mut opened = slots.opened.lock().unwrap_or_else(PoisonError::into_inner);
        *opened = opened.saturating_sub(1);
        if *opened == 0 {
            for slot in &slots.slots {
                // SAFETY: nobody has the library open, and the lock is held.
                unsafe { *slot.descriptor.get() = NO_DESCRIPTOR };
                *slot.texts.lock().unwrap_or_else(PoisonError::into_inner) = None;
            }
        }
    });
}

/// Memory that a descriptor points to.
#[doc(hidden)]
#[derive(Debug, Default)]
pub struct Texts {
    strings: Vec<CString>,
    lists: Vec<Box<[TextPointer]>>,
    params: Box<[abi::Param]>,
}

#[derive(Debug)]
#[repr(transparent)]
struct TextPointer(#[allow(dead_code, reason = "read through the C contract")] *const c_char);

// SAFETY: the pointers lead to the strings beside them.
unsafe impl Send for Texts {}

impl Texts {
    fn text(&mut self, text: &str) -> Result<*const c_char, String> {
        let string = CString::new(text).map_err(|_| format!("{text:?} contains a NUL"))?;
        let pointer = string.as_ptr(); // A CString's bytes stay where they are when the CString moves.
        self.strings.push(string);
        Ok(pointer)
    }

    /// NULL where there are none.
    fn list(&mut self, texts: &[&str]) -> Result<*const *const c_char, String> {
        if texts.is_empty() {
            return Ok(ptr::null());
        }
        let list =
            texts.iter().map(|text| self.text(text).map(TextPointer)).collect::<Result<Box<[_]>, _>>()?;
        let pointer = list.as_ptr().cast();
        self.lists.push(list);
        Ok(pointer)
    }

    fn param(&mut self, param: &Param) -> Result<abi::Param, String> {
        let names = match param.kind {
            param::ParamKind::Choice(names) => names,
            _ => &[],
        };
        let choices = self.list(names)?;
        Ok(abi::Param {
            id: param.id,
            kind: param.kind_code(),
            flags: if param.logarithmic { abi::PARAM_LOG } else { 0 },
            choice_count: names.len() as u32,
            minimum: param.minimum,
            maximum: param.maximum,
            default_value: param.default,
            key: self.text(param.key)?,
            label: self.text(param.label)?,
            group: self.text(param.group)?,
            unit: self.text(param.unit)?,
            help: self.text(param.help)?,
            choices,
            spare: [0; 2],
        })
    }
}

fn describe<T: Plugin>() -> Result<(abi::Descriptor, Texts), String> {
    param::check_table(T::params()).map_err(|problem| format!("{}: {problem}", T::ID))?;
    if T::STATE_MIN_VERSION > T::STATE_VERSION {
        return Err(format!("{}: STATE_MIN_VERSION is above STATE_VERSION", T::ID));
    }
    let schema = serde_json::to_string(&schemars::schema_for!(T::Config))
        .map_err(|error| format!("{}: no JSON Schema of its configuration: {error}", T::ID))?;
    let mut texts = Texts::default();
    texts.params = T::params().iter().map(|p| texts.param(p)).collect::<Result<_, _>>()?;
    let descriptor = abi::Descriptor {
        size: size_of::<abi::Descriptor>() as u32,
        flags: 0,
        id: texts.text(T::ID)?,
        name: texts.text(T::NAME)?,
        version: texts.text(T::VERSION)?,
        vendor: texts.text(T::VENDOR)?,
        description: texts.text(T::DESCRIPTION)?,
        config_schema: texts.text(&schema)?,
        params: texts.params.as_ptr(),
        param_count: texts.params.len() as u32,
        state_version: T::STATE_VERSION,
        state_min_version: T::STATE_MIN_VERSION,
        spare: 0,
        create: Some(create::<T>),
        traces: texts.list(T::traces())?,
        trace_count: T::traces().len() as u32,
        spare_traces: 0,
    };
    Ok((descriptor, texts))
}

/// The entry of a model that is linked into the program (tests, benches): as [`crate::export!`] makes it for
/// a library.
pub fn entry<T: Plugin>() -> &'static abi::Entry {
    static LINKED: Mutex<Option<HashMap<TypeId, Linked>>> = Mutex::new(None);

    #[derive(Clone, Copy)]
    struct Linked {
        entry: &'static abi::Entry,
        slots: &'static Slots<1>,
    }

    fn linked<T: Plugin>() -> Linked {
        let mut all = LINKED.lock().unwrap_or_else(PoisonError::into_inner);
        *all.get_or_insert_default().entry(TypeId::of::<T>()).or_insert_with(|| {
            let slots: &'static Slots<1> = Box::leak(Box::new(Slots::new([Slot::new::<T>()])));
            let pointers = Box::leak(Box::new(descriptor_pointers(slots)));
            let entry = Box::leak(Box::new(abi::Entry {
                magic: abi::MAGIC,
                size: size_of::<abi::Entry>() as u32,
                version: abi::VERSION,
                header_hash: abi::HEADER_HASH,
                descriptor_count: 1,
                spare: 0,
                descriptors: pointers.as_ptr().cast(),
                open: Some(open_linked::<T>),
                close: Some(close_linked::<T>),
            }));
            Linked { entry, slots }
        })
    }

    unsafe extern "C" fn open_linked<T: Plugin>(host: *const abi::Host) -> i32 {
        // SAFETY: the host calls this with a valid pointer, as the contract says.
        unsafe { open(linked::<T>().slots, host) }
    }

    unsafe extern "C" fn close_linked<T: Plugin>() {
        close(linked::<T>().slots);
    }

    linked::<T>().entry
}

// ---------------------------------------------------------------------------------------------------------
// instances

/// One instance: the plugin's value and what the SDK keeps for it.
struct Shell<T> {
    plugin: T,
    params: Params,
    /// Values before this step's events, should the step refuse them.
    params_before: Params,
    host: Host,
    /// What `create` got: `reset` and `load_state` make the instance anew from it.
    config: Vec<u8>,
    /// The value that the last load replaced, for the next one, and how many steps it is kept for.
    spare: Option<(T, u32)>,
    /// Where states are written; its memory stays from one to the next.
    saved: StateWriter,
    /// The message of a panic that left the plugin's value in an unknown state.
    broken: Option<String>,
}

/// The parameters right after `create`.
fn first_params<T: Plugin>(plugin: &T) -> Params {
    let mut params = Params::new(T::params());
    for param in T::params() {
        params.set(param.id, plugin.initial_param(param));
    }
    params
}

/// What a load has replaced is kept for so many steps.
const SPARE_STEPS: u32 = 600;

/// A call's end: a status and, when it is a failure, its message.
struct Failed(i32, String);

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

/// Most room that is made for a state before it is read [bytes].
const LONGEST_GUESS: usize = 1 << 28;

/// Name of the fields in which the SDK saves parameters.
const PARAM_IDS: &str = "reef.params.ids";
const PARAM_VALUES: &str = "reef.params.values";

impl<T: Plugin> Shell<T> {
    fn new(host: Host, config: Vec<u8>) -> Result<Self, Failed> {
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
    unsafe fn step(&mut self, input: *const abi::Step, output: *const abi::Output) -> Result<Status, Failed> {
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

    fn save(&mut self) -> Result<&[u8], Failed> {
        let writer = &mut self.saved;
        writer.begin();
        let (ids, values): (Vec<u32>, Vec<f64>) = self.params.iter().unzip();
        writer.put(PARAM_IDS, &ids);
        writer.put(PARAM_VALUES, &values);
        self.plugin.save(writer);
        writer.finished().map_err(|message| Failed(abi::ERROR, message))
    }

    /// Another instance of the same configuration, with the saved state in it.
    fn loaded(&mut self, version: u32, bytes: &[u8]) -> Result<Self, Failed> {
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
                saved: std::mem::take(&mut self.saved),
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
        Ok(fresh)
    }

    /// Replaces the instance.
    fn replace(&mut self, fresh: Self) {
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

/// Runs a call of the host: panics and failures become a status, with the message left at the host.
fn answer(host: &Host, call: impl FnOnce() -> Result<i32, Failed>) -> i32 {
    status_of(host, guard::catch(call))
}

/// As [`answer`], for a call that a panic leaves in an unknown state.
fn answer_or_break<T>(shell: &mut Shell<T>, call: impl FnOnce(&mut Shell<T>) -> Result<i32, Failed>) -> i32 {
    let outcome = guard::catch(|| call(shell));
    if let Err(message) = &outcome {
        shell.broken = Some(message.clone());
    }
    status_of(&shell.host, outcome)
}

/// The status of a call that ended, perhaps in a panic.
fn status_of(host: &Host, outcome: Result<Result<i32, Failed>, String>) -> i32 {
    let (status, message) = match outcome {
        Ok(Ok(status)) => return status,
        Ok(Err(Failed(status, message))) => (status, message),
        Err(message) => (abi::FATAL, message),
    };
    // Where a host service failed, the host has a better message already.
    if !message.is_empty() {
        host.set_error(&message);
    }
    status
}

unsafe extern "C" fn create<T: Plugin>(
    host: *const abi::Host,
    config: *const c_char,
    length: u64,
    out: *mut abi::Instance,
) -> i32 {
    guard::install_hook();
    // SAFETY: the host passes its table, which outlives the instance.
    let Some(host) = (unsafe { Host::from_raw(host) }) else { return abi::FATAL };
    answer(&host, || {
        if config.is_null() || out.is_null() || !out.is_aligned() {
            return Err(Failed(abi::BAD_INPUT, "the host's arguments to create are unusable".into()));
        }
        // SAFETY: pointer and length of the host's text, valid during the call.
        let config = unsafe { std::slice::from_raw_parts(config.cast::<u8>(), length as usize) };
        let shell = Box::new(Shell::<T>::new(host, config.to_vec())?);
        // SAFETY: `size` is the first field of the host's struct.
        let room = unsafe { (&raw const (*out).size).read() } as usize;
        let size = room.min(size_of::<abi::Instance>());
        if size <= std::mem::offset_of!(abi::Instance, destroy) {
            return Err(Failed(abi::BAD_INPUT, "the host has no room for an instance".into()));
        }
        let instance = abi::Instance {
            size: size as u32,
            spare: 0,
            ctx: Box::into_raw(shell).cast(),
            destroy: Some(destroy::<T>),
            reset: Some(reset::<T>),
            step: Some(step::<T>),
            save_state: Some(save_state::<T>),
            load_state: Some(load_state::<T>),
            get_param: Some(get_param::<T>),
            get_extension: None,
        };
        // SAFETY: the host has room for `size` bytes there.
        unsafe { ptr::copy_nonoverlapping((&raw const instance).cast::<u8>(), out.cast::<u8>(), size) };
        Ok(abi::OK)
    })
}

/// The instance behind the contract's context.
///
/// # Safety
/// `ctx` came from [`create`] of the same T, is not destroyed, and no other call on it runs.
unsafe fn shell<'a, T>(ctx: *mut c_void) -> &'a mut Shell<T> {
    // SAFETY: the caller's promise.
    unsafe { &mut *ctx.cast::<Shell<T>>() }
}

unsafe extern "C" fn destroy<T: Plugin>(ctx: *mut c_void) {
    // SAFETY: the contract: destroy is the last call on the instance.
    let shell = unsafe { Box::from_raw(ctx.cast::<Shell<T>>()) };
    let host = shell.host;
    if let Err(message) = guard::catch(move || drop(shell)) {
        host.log(Level::Error, &format!("{}: while an instance was destroyed: {message}", T::ID));
    }
}

unsafe extern "C" fn reset<T: Plugin>(ctx: *mut c_void) -> i32 {
    // SAFETY: the contract: one call at a time, on a living instance.
    let shell = unsafe { shell::<T>(ctx) };
    answer_or_break(shell, |shell| {
        if shell.broken.is_none() && shell.plugin.reset() == Reset::Done {
            shell.params = first_params(&shell.plugin);
        } else {
            let fresh = Shell::new(shell.host, shell.config.clone())?;
            shell.replace(fresh);
        }
        Ok(abi::OK)
    })
}

unsafe extern "C" fn step<T: Plugin>(
    ctx: *mut c_void,
    input: *const abi::Step,
    output: *const abi::Output,
) -> i32 {
    // SAFETY: as in `reset`.
    let shell = unsafe { shell::<T>(ctx) };
    answer_or_break(shell, |shell| {
        // SAFETY: the host passes input and output of this step.
        match unsafe { shell.step(input, output) }? {
            Status::Ok => Ok(abi::OK),
            Status::Sleep => Ok(abi::SLEEP),
        }
    })
}

unsafe extern "C" fn save_state<T: Plugin>(ctx: *mut c_void, writer: *const abi::Writer) -> i32 {
    // SAFETY: as in `reset`.
    let shell = unsafe { shell::<T>(ctx) };
    let host = shell.host;
    answer(&host, || {
        if let Some(message) = &shell.broken {
            return Err(Failed(abi::ERROR, format!("the instance broke earlier: {message}")));
        }
        // SAFETY: the host's writer, valid during the call.
        let writer = unsafe { read_sized(writer) };
        let Some((writer, write)) = writer.and_then(|w: abi::Writer| Some((w, w.write?))) else {
            return Err(Failed(abi::BAD_INPUT, "the host's writer is unusable".into()));
        };
        let (ctx, bytes) = (writer.ctx, shell.save()?);
        if let Some(expect) = writer.expect {
            // SAFETY: a service with a number. What it refuses, `write` refuses, too.
            let _ = unsafe { expect(ctx, bytes.len() as u64) };
        }
        // SAFETY: pointer and length of living bytes.
        match unsafe { write(ctx, bytes.as_ptr().cast(), bytes.len() as u64) } {
            abi::OK => Ok(abi::OK),
            status => Err(Failed(status, String::new())),
        }
    })
}

unsafe extern "C" fn load_state<T: Plugin>(ctx: *mut c_void, reader: *const abi::Reader) -> i32 {
    // SAFETY: as in `reset`.
    let shell = unsafe { shell::<T>(ctx) };
    let host = shell.host;
    // A panic in here happens in the fresh instance: the running one stays as it was.
    answer(&host, || {
        // SAFETY: the host's reader, valid during the call.
        let reader = unsafe { read_sized(reader) };
        let Some((reader, read)) = reader.and_then(|r: abi::Reader| Some((r, r.read?))) else {
            return Err(Failed(abi::BAD_INPUT, "the host's reader is unusable".into()));
        };
        let mut bytes = Vec::with_capacity(usize::try_from(reader.length).unwrap_or(0).min(LONGEST_GUESS));
        let mut buffer = vec![0_u8; 1 << 16];
        loop {
            // SAFETY: room for as many bytes as it says.
            let count = unsafe { read(reader.ctx, buffer.as_mut_ptr().cast(), buffer.len() as u64) };
            match usize::try_from(count).ok().and_then(|count| buffer.get(..count)) {
                Some([]) => break,
                Some(part) => bytes.extend_from_slice(part),
                None => return Err(Failed(abi::BAD_STATE, "the host's reader cannot read".into())),
            }
        }
        let fresh = shell.loaded(reader.state_version, &bytes)?;
        if T::LOADS_OVER && shell.broken.is_none() {
            let Shell { plugin, .. } = std::mem::replace(shell, fresh);
            shell.spare = Some((plugin, SPARE_STEPS));
        } else {
            shell.replace(fresh);
        }
        Ok(abi::OK)
    })
}

unsafe extern "C" fn get_param<T: Plugin>(ctx: *mut c_void, id: u32, out_value: *mut f64) -> i32 {
    // SAFETY: as in `reset`.
    let shell = unsafe { shell::<T>(ctx) };
    answer(&shell.host, || match shell.params.get(id) {
        Some(value) if !out_value.is_null() && out_value.is_aligned() => {
            // SAFETY: the host's variable.
            unsafe { out_value.write(value) };
            Ok(abi::OK)
        }
        _ => Err(Failed(abi::BAD_INPUT, format!("{} has no parameter {id}", T::ID))),
    })
}
