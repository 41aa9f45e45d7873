//! The C side of a library: its entry and its descriptors.

use std::{
    any::TypeId,
    cell::UnsafeCell,
    collections::HashMap,
    ffi::{CString, c_char},
    ptr,
    sync::{Mutex, PoisonError},
};

use reef_abi as abi;

use crate::{
    Plugin,
    calls::create,
    guard,
    host::Host,
    param::{self, Param},
};

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
