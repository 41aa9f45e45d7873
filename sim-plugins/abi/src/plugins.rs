//! What a plugin shows of itself: parameters, instances, descriptors, the entry.

use core::ffi::{c_char, c_void};

use super::{Host, Output, Step};

pub const PARAM_FLOAT: u32 = 1;
pub const PARAM_INT: u32 = 2;
/// 0 or 1
pub const PARAM_SWITCH: u32 = 3;
/// 0 .. choice_count - 1
pub const PARAM_CHOICE: u32 = 4;
/// flags: a logarithmic slider
pub const PARAM_LOG: u32 = 256;

#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Param {
    /// stable for ever; not an index; not 0
    pub id: u32,
    /// REEF_PARAM_*
    pub kind: u32,
    pub flags: u32,
    pub choice_count: u32,
    pub minimum: f64,
    pub maximum: f64,
    pub default_value: f64,
    /// in scene files: lower_case_words
    pub key: *const c_char,
    /// in the panel
    pub label: *const c_char,
    /// heading in the panel
    pub group: *const c_char,
    /// "m/s", ""
    pub unit: *const c_char,
    /// one sentence
    pub help: *const c_char,
    /// [opt] choice_count names
    pub choices: *const *const c_char,
    pub spare: [u64; 2],
}

/// Where save_state writes and load_state reads. The host wraps the bytes in an envelope of plugin id, state
/// version, length and hash. The payload is the plugin's own, little-endian and without pointers;
/// reef_state.h writes and reads tagged fields, to which a later version may add.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Writer {
    pub size: u32,
    pub spare: u32,
    pub ctx: *mut c_void,
    pub write: Option<unsafe extern "C" fn(ctx: *mut c_void, bytes: *const c_void, length: u64) -> i32>,
    /// So many bytes are still to come, as far as is known: room for them is made at once. Need not be
    /// called.
    pub expect: Option<unsafe extern "C" fn(ctx: *mut c_void, length: u64) -> i32>,
}

#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Reader {
    pub size: u32,
    /// of the library that wrote the bytes
    pub state_version: u32,
    pub ctx: *mut c_void,
    /// Copies up to `length` bytes, returns how many; 0 at the end. May return fewer than asked before the
    /// end. -1: it cannot read, and load_state returns BAD_STATE.
    pub read: Option<unsafe extern "C" fn(ctx: *mut c_void, bytes: *mut c_void, length: u64) -> i64>,
    /// of the whole payload
    pub length: u64,
}

/// Filled by create(), up to the size that the host put there.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Instance {
    pub size: u32,
    pub spare: u32,
    /// first argument of all functions below
    pub ctx: *mut c_void,
    /// [control]
    pub destroy: Option<unsafe extern "C" fn(ctx: *mut c_void)>,
    /// Back to the state after create(), parameters included. [control]
    pub reset: Option<unsafe extern "C" fn(ctx: *mut c_void) -> i32>,
    /// [step]
    pub step:
        Option<unsafe extern "C" fn(ctx: *mut c_void, input: *const Step, output: *const Output) -> i32>,
    /// [control]
    pub save_state: Option<unsafe extern "C" fn(ctx: *mut c_void, writer: *const Writer) -> i32>,
    /// All or nothing: anything but REEF_OK leaves the instance as it was. A state_version below
    /// state_min_version or above state_version is REEF_BAD_STATE. [control]
    pub load_state: Option<unsafe extern "C" fn(ctx: *mut c_void, reader: *const Reader) -> i32>,
    /// The parameter's present value. Parameters change through the step's events only. [control]
    pub get_param: Option<unsafe extern "C" fn(ctx: *mut c_void, id: u32, out_value: *mut f64) -> i32>,
    /// [opt] The table of an extension, which lives as long as the instance; NULL: it does not have it.
    /// [control]
    pub get_extension: Option<unsafe extern "C" fn(ctx: *mut c_void, id: *const c_char) -> *const c_void>,
}

#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Descriptor {
    pub size: u32,
    pub flags: u32,
    /// "reef.anemone": reverse-domain or vendor.name; stable
    pub id: *const c_char,
    pub name: *const c_char,
    /// of the plugin: "1.2.3"
    pub version: *const c_char,
    pub vendor: *const c_char,
    pub description: *const c_char,
    /// [opt] JSON Schema of the module's table in a scene file: what does not fit never gets to create()
    pub config_schema: *const c_char,
    /// [opt]
    pub params: *const Param,
    pub param_count: u32,
    /// what save_state writes
    pub state_version: u32,
    /// the oldest that load_state reads
    pub state_min_version: u32,
    pub spare: u32,
    /// config: JSON object {"scene": {"name", "seed", "scale", "dt"}, "species": {NAME: {...}}, "config":
    /// {...}}. An error's message begins with the path in "config": `anemones[3].species: ...`. `host` is
    /// this instance's own: valid until destroy() returned, or create() returned a failure. [control]
    pub create: Option<
        unsafe extern "C" fn(
            host: *const Host,
            config: *const c_char,
            length: u64,
            out: *mut Instance,
        ) -> i32,
    >,
    /// [opt] what its traces are of, as recordings name it: "fibre", "fish"; lower_case_words
    pub traces: *const *const c_char,
    /// at most 16
    pub trace_count: u32,
    pub spare_traces: u32,
}

#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// REEF_MAGIC
    pub magic: u64,
    pub size: u32,
    /// REEF_VERSION
    pub version: u32,
    /// REEF_HEADER_HASH
    pub header_hash: u64,
    /// 1..64
    pub descriptor_count: u32,
    pub spare: u32,
    pub descriptors: *const *const Descriptor,
    /// Once, before anything else; `host` stays valid until close() returns. [control]
    pub open: Option<unsafe extern "C" fn(host: *const Host) -> i32>,
    /// Once, after every instance is destroyed. [control]
    pub close: Option<unsafe extern "C" fn()>,
}

/// The name of the one symbol that a plugin exports: a [`Entry`].
pub const ENTRY_SYMBOL: &str = "reef_sim_entry";

// SAFETY: a parameter, a descriptor and an entry point only at constants of the library that defines them.
unsafe impl Sync for Param {}
// SAFETY: as above.
unsafe impl Sync for Descriptor {}
// SAFETY: as above.
unsafe impl Sync for Entry {}
