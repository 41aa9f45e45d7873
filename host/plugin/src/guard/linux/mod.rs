//! The guarded call.

#[cfg_attr(target_arch = "x86_64", path = "call_x86_64.rs")]
#[cfg_attr(target_arch = "aarch64", path = "call_aarch64.rs")]
mod call;
mod describe;
mod ending;
// A program with the C library in it cannot have these symbols twice.
#[cfg(all(target_env = "gnu", not(target_feature = "crt-static")))]
mod ends;
mod exit;
mod frame;
mod last;
mod probe;
mod rescue;
mod sealed;
mod signals;
mod stack;
mod taken;
mod text;
mod watchdog;

use std::{
    ffi::c_void,
    mem::{ManuallyDrop, MaybeUninit},
};

pub(crate) use ending::{Stranded, join};
pub(super) use exit::end_without_destructors;
use frame::Frame;
pub(crate) use last::Called;
pub use last::Noted;
pub(crate) use probe::{probe_read, probe_write};
pub use rescue::{KEEPS_STATES, forget_state, keep_state};
pub(crate) use stack::{Resident, Thread, require_stack};
pub use taken::ever_taken;
pub(crate) use taken::{Taken, put_back, put_back_jobs, put_in_place};
pub(crate) use text::Text;
pub(super) use watchdog::{wake as wake_watchdog, watch};

use super::{Fate, Fault, fault::Cause};
use crate::marker::{self, Place};

/// What goes through the guarded call: the closure, then its result.
struct Parcel<F, R> {
    call: ManuallyDrop<F>,
    result: MaybeUninit<R>,
}

unsafe extern "C" fn unpack<F: FnOnce() -> R, R>(parcel: *mut c_void) {
    // SAFETY: `guarded` passes its parcel of these very types, with the closure in it, once.
    unsafe {
        let parcel = &mut *parcel.cast::<Parcel<F, R>>();
        let call = ManuallyDrop::take(&mut parcel.call);
        parcel.result.write(call());
    }
}

/// Runs a plugin's code; a signal that is its own fault comes back as an error. Values that `call` holds are
/// then leaked, so it holds none that matter. The calling thread belongs to the generation: see [`Resident`].
#[inline]
pub(crate) fn guarded<R>(fate: &Fate, call: impl FnOnce() -> R) -> Result<R, Fault> {
    #[inline(always)]
    fn unpack_of<F: FnOnce() -> R, R>(_: &Parcel<F, R>) -> unsafe extern "C" fn(*mut c_void) {
        unpack::<F, R>
    }
    let mut parcel = Parcel { call: ManuallyDrop::new(call), result: MaybeUninit::uninit() };
    let unpack = unpack_of(&parcel);
    let mut frame = Frame::new(fate);
    let frame = &raw mut frame;
    let before = marker::enter(Place::Plugin(fate.generation()), frame.cast());
    // SAFETY: `unpack` is made for this parcel; frame and parcel live until the call returned or was left.
    let left = unsafe { call::enter(unpack, (&raw mut parcel).cast(), frame) };
    marker::restore(before);
    if left == 0 {
        // SAFETY: the call returned, so `unpack` wrote its result.
        return Ok(unsafe { parcel.result.assume_init() });
    }
    // SAFETY: the frame is ours again, and who left the call wrote why.
    Err(unsafe { (*frame).fault(fate) })
}

/// Leaves the plugin's call that runs on this thread: it called a service with a context that is none.
/// Returns where no call of a plugin runs here.
#[cold]
pub(crate) fn leave_foreign(service: &'static str) {
    if matches!(marker::place(), Place::Plugin(_)) && !Frame::current().is_null() {
        leave(Fault { cause: Cause::Foreign(service), place: None, job: None });
    }
}

/// Leaves the guarded call that runs on this thread, as a signal would, because of what happened on another
/// thread on its behalf.
pub(crate) fn leave(fault: Fault) -> ! {
    let frame = Frame::current();
    if frame.is_null() {
        // Only a service that a guarded call reached comes here; without one there is nowhere to go.
        std::process::abort();
    }
    // SAFETY: the innermost guarded call of this thread, whose frame lives below ours on the stack; what is
    // between holds nothing that must be dropped: services and plugin code, which is never called again.
    unsafe {
        (*frame).relay(fault);
        call::leave(frame)
    }
}
