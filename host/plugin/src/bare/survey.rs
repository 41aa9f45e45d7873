//! The descriptors of an open library, field by field, before anybody judges them.

use std::ffi::{CStr, c_char};

use reef_abi as abi;

use crate::{
    info::{MOST_CHOICES, MOST_PARAMS, MOST_TRACES, read_sized},
    library::Library,
};

/// A string of a descriptor.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Text {
    /// The pointer is NULL.
    Null,
    /// Its bytes are not UTF-8.
    NotUtf8(String),
    /// As it stands.
    Good(String),
}

/// A descriptor: the contract's `reef_descriptor`, whose comments explain the fields.
#[allow(missing_docs)]
#[derive(Clone, Debug, PartialEq)]
pub struct Descriptor {
    pub size: u32,
    pub flags: u32,
    pub spare: [u32; 2],
    pub id: Text,
    pub name: Text,
    pub version: Text,
    pub vendor: Text,
    pub description: Text,
    pub config_schema: Text,
    pub param_count: u32,
    /// NULL where parameters should be.
    pub params_missing: bool,
    pub params: Vec<Param>,
    pub state_version: u32,
    pub state_min_version: u32,
    pub has_create: bool,
    pub trace_count: u32,
    /// None: NULL where they should be.
    pub traces: Option<Vec<Text>>,
}

/// A parameter: the contract's `reef_param`.
#[allow(missing_docs)]
#[derive(Clone, Debug, PartialEq)]
pub struct Param {
    pub id: u32,
    pub kind: u32,
    pub flags: u32,
    pub choice_count: u32,
    pub minimum: f64,
    pub maximum: f64,
    pub default: f64,
    pub key: Text,
    pub label: Text,
    pub group: Text,
    pub unit: Text,
    pub help: Text,
    /// None: NULL.
    pub choices: Option<Vec<Text>>,
    pub spare: [u64; 2],
}

impl Text {
    /// The text, if it is one.
    pub fn good(&self) -> Option<&str> {
        match self {
            Self::Good(text) => Some(text),
            _ => None,
        }
    }
}

/// Most descriptors that are looked at.
const MOST: u32 = 64;

/// The library's list of descriptors, on its way to the control thread.
struct List(*const *const abi::Descriptor);

// SAFETY: a constant of the library, which is read on the control thread.
unsafe impl Send for List {}

impl Library {
    /// How many descriptors the entry says that there are.
    pub fn descriptor_count(&self) -> u32 {
        self.raw_entry().descriptor_count
    }

    /// All descriptors; None in place of one that is NULL or misaligned. Err: a pointer leads nowhere.
    pub fn survey(&self) -> Result<Vec<Option<Descriptor>>, String> {
        let entry = self.raw_entry();
        if entry.descriptors.is_null() || !entry.descriptors.is_aligned() {
            return Err("the entry's list of descriptors is NULL or misaligned".into());
        }
        let list = List(entry.descriptors);
        self.enter("descriptor", move || {
            let List(list) = { list };
            // SAFETY: the entry says that so many pointers are there, each to a descriptor as long as it
            // says. Where that is not so, the guard around this call takes the fault.
            let one = |i: u32| unsafe { Some(look(&read_sized(*list.add(i as usize))?)) };
            (0..entry.descriptor_count.min(MOST)).map(one).collect()
        })
    }
}

/// # Safety
/// The descriptor's pointers are as the contract says.
unsafe fn look(raw: &abi::Descriptor) -> Descriptor {
    let usable = !raw.params.is_null() && raw.params.is_aligned();
    let count = if usable { raw.param_count.min(MOST_PARAMS) } else { 0 };
    let named = !raw.traces.is_null() && raw.traces.is_aligned();
    // SAFETY: the caller's promise, for each of them.
    unsafe {
        let trace = |i: u32| text(*raw.traces.add(i as usize));
        Descriptor {
            size: raw.size,
            flags: raw.flags,
            spare: [raw.spare, raw.spare_traces],
            id: text(raw.id),
            name: text(raw.name),
            version: text(raw.version),
            vendor: text(raw.vendor),
            description: text(raw.description),
            config_schema: text(raw.config_schema),
            param_count: raw.param_count,
            params_missing: !usable && raw.param_count > 0,
            params: (0..count as usize).map(|i| param(&*raw.params.add(i))).collect(),
            state_version: raw.state_version,
            state_min_version: raw.state_min_version,
            has_create: raw.create.is_some(),
            trace_count: raw.trace_count,
            traces: (named || raw.trace_count == 0)
                .then(|| (0..raw.trace_count.min(MOST_TRACES)).map(trace).collect()),
        }
    }
}

/// # Safety
/// As [`look`].
unsafe fn param(raw: &abi::Param) -> Param {
    let usable = !raw.choices.is_null() && raw.choices.is_aligned();
    // SAFETY: the caller's promise, for each of them.
    unsafe {
        let choice = |i: u32| text(*raw.choices.add(i as usize));
        Param {
            id: raw.id,
            kind: raw.kind,
            flags: raw.flags,
            choice_count: raw.choice_count,
            minimum: raw.minimum,
            maximum: raw.maximum,
            default: raw.default_value,
            key: text(raw.key),
            label: text(raw.label),
            group: text(raw.group),
            unit: text(raw.unit),
            help: text(raw.help),
            choices: usable.then(|| (0..raw.choice_count.min(MOST_CHOICES)).map(choice).collect()),
            spare: raw.spare,
        }
    }
}

/// # Safety
/// The pointer is NULL or leads to a NUL-terminated string.
unsafe fn text(pointer: *const c_char) -> Text {
    if pointer.is_null() {
        return Text::Null;
    }
    // SAFETY: the caller's promise.
    let bytes = unsafe { CStr::from_ptr(pointer) }.to_bytes();
    match std::str::from_utf8(bytes) {
        Ok(text) => Text::Good(text.to_owned()),
        Err(_) => Text::NotUtf8(String::from_utf8_lossy(bytes).into_owned()),
    }
}
