//! What a library says of itself, copied out of its memory and checked.

use std::{
    ffi::{CStr, c_char},
    path::PathBuf,
};

use reef_abi as abi;
use serde::{Serialize, Serializer};

/// Longest string that a descriptor may hold [bytes], but for the schema.
const LONGEST: usize = 4096;
/// Most parameters of a plugin.
pub const MOST_PARAMS: u32 = 1024;
/// Most names of one choice.
pub const MOST_CHOICES: u32 = 256;
/// Most kinds of traces of a plugin.
pub const MOST_TRACES: u32 = 16;

/// Whether recordings can write this name of traces: a word of a-z, 0-9 and `_`.
pub fn is_trace_name(name: &str) -> bool {
    !name.is_empty() && name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_')
}

/// What values a parameter takes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ParamKind {
    /// Any number in the range.
    #[default]
    Float,
    /// Whole numbers in the range.
    Int,
    /// 0 or 1.
    Switch,
    /// An index into the names.
    Choice,
}

/// One parameter of a plugin.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ParamInfo {
    /// Stable id.
    pub id: u32,
    /// What values it takes.
    pub kind: ParamKind,
    /// Shown with a logarithmic slider.
    pub logarithmic: bool,
    /// Least value.
    pub minimum: f64,
    /// Greatest value.
    pub maximum: f64,
    /// Value of a fresh instance.
    pub default: f64,
    /// In scene files.
    pub key: String,
    /// In the panel.
    pub label: String,
    /// Heading in the panel.
    pub group: String,
    /// Unit; empty without one.
    pub unit: String,
    /// One sentence.
    pub help: String,
    /// Names of a choice.
    pub choices: Vec<String>,
}

/// One plugin of a library.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct PluginInfo {
    /// Stable id, `vendor.name`.
    pub id: String,
    /// Name for people.
    pub name: String,
    /// Its version.
    pub version: String,
    /// Who made it.
    pub vendor: String,
    /// One sentence.
    pub description: String,
    /// The library's file; None: linked into the program.
    #[serde(serialize_with = "shown")]
    pub path: Option<PathBuf>,
    /// The version of `reef_sim.h` that it was built with.
    pub contract: String,
    /// JSON Schema of the module's table in a scene file; None: anything goes.
    pub config_schema: Option<serde_json::Value>,
    /// Its parameters.
    pub params: Vec<ParamInfo>,
    /// Version of the states that it writes.
    pub state_version: u32,
    /// The oldest that it reads.
    pub state_min_version: u32,
    /// What its traces are of, by their kind.
    pub traces: Vec<String>,
}

fn shown<S: Serializer>(path: &Option<PathBuf>, serializer: S) -> Result<S::Ok, S::Error> {
    path.as_deref().map(reef_report::say::shown).serialize(serializer)
}

impl PluginInfo {
    /// The parameter with this key in scene files.
    pub fn param(&self, key: &str) -> Option<&ParamInfo> {
        self.params.iter().find(|param| param.key == key)
    }
}

/// A growable struct of the contract.
///
/// # Safety
/// `repr(C)`, first field `size: u32`, valid when all bytes are zero.
pub(crate) unsafe trait Growable: Copy {}
// SAFETY: numbers, raw pointers and optional functions, `size` first.
unsafe impl Growable for abi::Descriptor {}

/// Reads `min(size, sizeof)` bytes and takes the rest as zero.
///
/// # Safety
/// The pointer, if neither NULL nor misaligned, leads to as many bytes as the `u32` there says.
pub(crate) unsafe fn read_sized<T: Growable>(pointer: *const T) -> Option<T> {
    if pointer.is_null() || !pointer.is_aligned() {
        return None;
    }
    // SAFETY: the caller's promise; `size` is the first field.
    let size = unsafe { pointer.cast::<u32>().read() } as usize;
    let mut value = std::mem::MaybeUninit::<T>::zeroed();
    // SAFETY: both sides have that many bytes; what a plugin wrote there is a value of the contract.
    unsafe {
        let bytes = size.min(size_of::<T>());
        std::ptr::copy_nonoverlapping(pointer.cast::<u8>(), value.as_mut_ptr().cast::<u8>(), bytes);
        Some(value.assume_init())
    }
}

/// A string of the contract.
///
/// # Safety
/// The pointer is NULL or leads to a NUL-terminated string.
unsafe fn string(what: &str, pointer: *const c_char, longest: usize) -> Result<String, String> {
    if pointer.is_null() {
        return Err(format!("its {what} is NULL"));
    }
    // SAFETY: the caller's promise.
    let bytes = unsafe { CStr::from_ptr(pointer) }.to_bytes();
    if bytes.len() > longest {
        return Err(format!("its {what} has {} bytes; the limit is {longest}", bytes.len()));
    }
    String::from_utf8(bytes.to_vec()).map_err(|_| format!("its {what} is not UTF-8"))
}

/// Takes over a descriptor. `notes` gets what it has of a later contract, which is left out.
///
/// # Safety
/// The descriptor's pointers are as the contract says.
pub(crate) unsafe fn read(
    descriptor: &abi::Descriptor,
    path: Option<PathBuf>,
    contract: String,
    notes: &mut Vec<String>,
) -> Result<PluginInfo, String> {
    // SAFETY: the caller's promise.
    let text = |what, pointer| unsafe { string(what, pointer, LONGEST) };
    let id = text("id", descriptor.id)?;
    let good = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || matches!(c, '.' | '_' | '-');
    if id.is_empty() || !id.chars().all(good) {
        return Err(format!("its id {id:?} must be like `vendor.name`, of a-z, 0-9, `.`, `_` and `-`"));
    }
    let of = |problem: String| format!("plugin `{id}`: {problem}");
    if descriptor.state_min_version > descriptor.state_version {
        return Err(of("its state_min_version is above its state_version".into()));
    }
    if descriptor.create.is_none() {
        return Err(of("its create is NULL".into()));
    }
    let spare = [descriptor.flags, descriptor.spare, descriptor.spare_traces];
    if spare != [0; 3] {
        return Err(of(format!("its flags and spare fields are {spare:?}, allowed is 0")));
    }
    let config_schema = match descriptor.config_schema.is_null() {
        true => None,
        false => {
            // SAFETY: the caller's promise.
            let schema = unsafe { string("config_schema", descriptor.config_schema, 1 << 24) }.map_err(of)?;
            Some(
                serde_json::from_str(&schema)
                    .map_err(|e| of(format!("its config_schema is no JSON: {e}")))?,
            )
        }
    };
    if descriptor.param_count > MOST_PARAMS {
        let count = descriptor.param_count;
        return Err(of(format!("it declares {count} parameters; the limit is {MOST_PARAMS}")));
    }
    let params: &[abi::Param] = match descriptor.param_count {
        0 => &[],
        _ if descriptor.params.is_null() || !descriptor.params.is_aligned() => {
            return Err(of("its params are NULL or misaligned".into()));
        }
        count => {
            // SAFETY: the caller's promise.
            unsafe { std::slice::from_raw_parts(descriptor.params, count as usize) }
        }
    };
    let mut read: Vec<ParamInfo> = Vec::with_capacity(params.len());
    for raw in params {
        // SAFETY: the caller's promise.
        let Some(param) = unsafe { read_param(raw) }.map_err(of)? else {
            let kind = raw.kind;
            notes.push(of(format!("parameter {}: its kind {kind} is not known here, and left out", raw.id)));
            continue;
        };
        if raw.flags & !abi::PARAM_LOG != 0 {
            let (key, flags) = (&param.key, raw.flags & !abi::PARAM_LOG);
            notes.push(of(format!("parameter `{key}`: its flags {flags:#x} are not known here")));
        }
        if let Some(other) = read.iter().find(|p| p.id == param.id || p.key == param.key) {
            return Err(of(format!("parameters `{}` and `{}` share an id or a key", other.key, param.key)));
        }
        read.push(param);
    }
    // SAFETY: the caller's promise.
    let traces =
        unsafe { names(descriptor.traces, descriptor.trace_count, MOST_TRACES, "trace") }.map_err(of)?;
    if let Some(wrong) = traces.iter().find(|name| !is_trace_name(name)) {
        return Err(of(format!("its trace {wrong:?} must be of a-z, 0-9 and `_`")));
    }
    if let Some(at) = (1..traces.len()).find(|at| traces[..*at].contains(&traces[*at])) {
        return Err(of(format!("two of its traces are called {:?}", traces[at])));
    }
    Ok(PluginInfo {
        traces,
        name: text("name", descriptor.name)?,
        version: text("version", descriptor.version)?,
        vendor: text("vendor", descriptor.vendor)?,
        description: text("description", descriptor.description)?,
        path,
        contract,
        config_schema,
        params: read,
        state_version: descriptor.state_version,
        state_min_version: descriptor.state_min_version,
        id,
    })
}

/// A list of names.
///
/// # Safety
/// `list` is NULL, misaligned, or leads to `count` NUL-terminated strings.
unsafe fn names(
    list: *const *const c_char,
    count: u32,
    most: u32,
    what: &'static str,
) -> Result<Vec<String>, String> {
    if count == 0 {
        return Ok(Vec::new());
    }
    if count > most {
        return Err(format!("it has {count} {what} names; the limit is {most}"));
    }
    if list.is_null() || !list.is_aligned() {
        return Err(format!("its {what} names are NULL or misaligned"));
    }
    // SAFETY: the caller's promise.
    unsafe { std::slice::from_raw_parts(list, count as usize).iter() }
        // SAFETY: as above.
        .map(|name| unsafe { string(what, *name, LONGEST) })
        .collect()
}

/// None: its kind is of a later contract.
///
/// # Safety
/// As [`read`].
unsafe fn read_param(raw: &abi::Param) -> Result<Option<ParamInfo>, String> {
    // SAFETY: the caller's promise.
    let text = |what, pointer| unsafe { string(what, pointer, LONGEST) };
    let key = text("parameter key", raw.key)?;
    let of = |problem: &str| format!("parameter `{key}`: {problem}");
    let kind = match raw.kind {
        abi::PARAM_FLOAT => ParamKind::Float,
        abi::PARAM_INT => ParamKind::Int,
        abi::PARAM_SWITCH => ParamKind::Switch,
        abi::PARAM_CHOICE => ParamKind::Choice,
        _ => return Ok(None),
    };
    if raw.spare != [0; 2] {
        return Err(of(&format!("its spare fields are {:?}, allowed is 0", raw.spare)));
    }
    if raw.id == 0 {
        return Err(of("its id is 0"));
    }
    let finite = [raw.minimum, raw.maximum, raw.default_value].iter().all(|v| v.is_finite());
    if !finite || !(raw.minimum..=raw.maximum).contains(&raw.default_value) {
        return Err(of(&format!(
            "its default {} is outside of its range {} to {}",
            raw.default_value, raw.minimum, raw.maximum
        )));
    }
    let logarithmic = raw.flags & abi::PARAM_LOG != 0;
    if logarithmic && raw.minimum <= 0.0 {
        return Err(of("a logarithmic slider needs a range above 0"));
    }
    let choices = match kind {
        ParamKind::Choice => {
            let count = raw.choice_count;
            if count == 0 || raw.minimum != 0.0 || raw.maximum != f64::from(count - 1) {
                return Err(of("a choice needs its names, and a range of 0 to their number less 1"));
            }
            // SAFETY: the caller's promise.
            unsafe { names(raw.choices, count, MOST_CHOICES, "choice") }.map_err(|problem| of(&problem))?
        }
        _ => Vec::new(),
    };
    Ok(Some(ParamInfo {
        id: raw.id,
        kind,
        logarithmic,
        minimum: raw.minimum,
        maximum: raw.maximum,
        default: raw.default_value,
        label: text("parameter label", raw.label)?,
        group: text("parameter group", raw.group)?,
        unit: text("parameter unit", raw.unit)?,
        help: text("parameter help", raw.help)?,
        choices,
        key,
    }))
}
