//! A state on its way between a plugin and the host: what its writer and its reader lead to.

use std::ffi::c_void;

use reef_abi as abi;

use super::{
    guard, marker,
    tag::{self, Tag, Tagged},
};

/// Largest state of one instance [bytes].
pub(super) const LARGEST_STATE: usize = 1 << 32;

/// Where a state is written.
#[derive(Default)]
pub(super) struct Sink {
    pub(super) generation: u64,
    pub(super) bytes: Vec<u8>,
    /// Most bytes that it takes.
    pub(super) room: usize,
    pub(super) overflow: bool,
    pub(super) tag: Tag,
}

impl Tagged for Sink {
    const AT: usize = std::mem::offset_of!(Self, tag);
}

impl Sink {
    /// Whether there is room for so many more bytes; where there is not, this is remembered.
    fn has_room(&mut self, length: u64) -> bool {
        let fits =
            usize::try_from(length).is_ok_and(|length| self.bytes.len().saturating_add(length) <= self.room);
        self.overflow |= !fits;
        fits
    }
}

/// The sink behind a context, unless it is none.
///
/// # Safety
/// `ctx` is whatever a plugin passed; where it is the context of a save's sink, nobody else uses that.
unsafe fn sink<'a>(ctx: *mut c_void, service: &'static str) -> Option<&'a mut Sink> {
    guard::require_stack();
    let sink = ctx.cast::<Sink>();
    // SAFETY: a context of ours, or a fault of the plugin's code, by the marker.
    if unsafe { !tag::is_ours(sink) } {
        guard::leave_foreign(service);
        return None;
    }
    // SAFETY: the mark says that it is the sink of the save that runs.
    unsafe { sink.as_mut() }
}

/// Longest room that is made before it is written to [bytes]: what is only announced may never come.
const MOST_EXPECTED: u64 = 1 << 28;

pub(super) unsafe extern "C" fn expect(ctx: *mut c_void, length: u64) -> i32 {
    // SAFETY: the contract's pointer.
    let Some(sink) = (unsafe { sink(ctx, "expect") }) else { return abi::BAD_INPUT };
    if !sink.has_room(length) {
        return abi::NO_SPACE;
    }
    let generation = sink.generation;
    marker::in_service(generation, || {
        // Without room now there may be some by the time that it is written.
        let _ = sink.bytes.try_reserve(length.min(MOST_EXPECTED) as usize);
    });
    abi::OK
}

pub(super) unsafe extern "C" fn write(ctx: *mut c_void, bytes: *const c_void, length: u64) -> i32 {
    // SAFETY: the contract's pointer.
    let Some(sink) = (unsafe { sink(ctx, "write") }) else { return abi::BAD_INPUT };
    if !sink.has_room(length) {
        return abi::NO_SPACE;
    }
    if length > 0 && bytes.is_null() {
        return abi::BAD_INPUT;
    }
    if length > 0 {
        guard::probe_read(bytes.cast(), length as usize);
        marker::in_service(sink.generation, || {
            // SAFETY: pointer and length of the plugin's bytes, which were just touched.
            let bytes = unsafe { std::slice::from_raw_parts(bytes.cast::<u8>(), length as usize) };
            sink.bytes.extend_from_slice(bytes);
        });
    }
    abi::OK
}

/// What [`read`] returns where it cannot read.
const UNREADABLE: i64 = -1;

/// Where a state is read from.
pub(super) struct Source<'a> {
    pub(super) rest: &'a [u8],
    /// Most bytes that it gives at once.
    pub(super) most: usize,
    pub(super) tag: Tag,
}

impl Tagged for Source<'_> {
    const AT: usize = std::mem::offset_of!(Self, tag);
}

pub(super) unsafe extern "C" fn read(ctx: *mut c_void, bytes: *mut c_void, length: u64) -> i64 {
    let source = ctx.cast::<Source<'_>>();
    // SAFETY: a context of ours, or a fault of the plugin's code, by the marker.
    if unsafe { !tag::is_ours(source) } {
        guard::leave_foreign("read");
        return UNREADABLE;
    }
    // SAFETY: the context of `load`'s source, which nobody else uses during the call.
    let source = unsafe { &mut *source };
    if length == 0 {
        return 0;
    }
    if bytes.is_null() {
        return UNREADABLE;
    }
    let count = source.rest.len().min(usize::try_from(length).unwrap_or(usize::MAX)).min(source.most);
    let (part, rest) = source.rest.split_at(count);
    // SAFETY: the plugin has room for `length` bytes, and `count` is not above that.
    unsafe { std::ptr::copy_nonoverlapping(part.as_ptr(), bytes.cast::<u8>(), count) };
    source.rest = rest;
    count as i64
}
