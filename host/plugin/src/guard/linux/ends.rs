//! Ends that a plugin asks the C library for: of the program, or of the host's thread that it runs on. The
//! program's own symbols come before the C library's, so a library that calls `exit` comes here. What it asks
//! for is its fault, as a signal would be. Whoever asks the kernel itself is not seen.

use std::{
    ffi::{CStr, c_int, c_void},
    mem, process, ptr,
};

use super::{
    call, ending,
    frame::{Frame, Seen},
    signals,
};
use crate::marker::{self, Place};

/// The linker keeps what is named here, in every program with guards.
pub(super) static KEPT: [unsafe extern "C" fn(c_int) -> !; 4] = [exit, _exit, _Exit, quick_exit];
pub(super) static KEPT_OF_THREADS: (
    unsafe extern "C" fn(*mut c_void) -> !,
    unsafe extern "C" fn(c_int) -> !,
) = (pthread_exit, thrd_exit);

/// Leaves the plugin's call that runs on this thread; returns where there is none.
fn leave_plugin(function: &'static str) {
    let frame = Frame::current();
    // A process that a plugin forked ends as it likes.
    if frame.is_null() || !signals::is_this_process() {
        return;
    }
    match marker::place() {
        // SAFETY: the innermost guarded call of this thread, whose frame lives below ours on the stack; what
        // is between is plugin code, which is never called again.
        Place::Plugin(_) => unsafe {
            (*frame).seen = Some(Seen::ended(function));
            call::leave(frame)
        },
        // SAFETY: the marker of an ending thread leads to its generation's fate.
        Place::Ending(_) => unsafe { ending::strand(marker::frame().cast(), Seen::ended(function)) },
        Place::Host | Place::Service(_) => {}
    }
}

/// The C library's function behind ours.
fn behind(name: &CStr) -> *mut c_void {
    // SAFETY: a name that the C library has.
    unsafe { libc::dlsym(libc::RTLD_NEXT, name.as_ptr()) }
}

/// Ends with a function of the C library that takes a number.
fn end_with(name: &CStr, code: c_int) -> ! {
    let end = behind(name);
    if end.is_null() {
        process::abort();
    }
    // SAFETY: the C library's function of this name, which has this type.
    unsafe { mem::transmute::<*mut c_void, unsafe extern "C" fn(c_int) -> !>(end)(code) }
}

/// Ends the process without another word.
fn end_at_once(code: c_int) -> ! {
    loop {
        // SAFETY: a number.
        unsafe { libc::syscall(libc::SYS_exit_group, code) };
    }
}

/// # Safety
/// As the C library's.
#[unsafe(no_mangle)]
unsafe extern "C" fn exit(code: c_int) -> ! {
    leave_plugin("exit");
    end_with(c"exit", code)
}

/// # Safety
/// As the C library's.
#[unsafe(no_mangle)]
unsafe extern "C" fn _exit(code: c_int) -> ! {
    leave_plugin("_exit");
    end_at_once(code)
}

/// # Safety
/// As the C library's.
#[unsafe(no_mangle)]
unsafe extern "C" fn _Exit(code: c_int) -> ! {
    leave_plugin("_Exit");
    end_at_once(code)
}

/// # Safety
/// As the C library's.
#[unsafe(no_mangle)]
unsafe extern "C" fn quick_exit(code: c_int) -> ! {
    leave_plugin("quick_exit");
    end_with(c"quick_exit", code)
}

/// # Safety
/// As the C library's.
#[unsafe(no_mangle)]
unsafe extern "C" fn thrd_exit(code: c_int) -> ! {
    leave_plugin("thrd_exit");
    end_with(c"thrd_exit", code)
}

/// # Safety
/// As the C library's.
#[unsafe(no_mangle)]
unsafe extern "C" fn pthread_exit(value: *mut c_void) -> ! {
    leave_plugin("pthread_exit");
    let end = behind(c"pthread_exit");
    if ptr::eq(end, ptr::null()) {
        process::abort();
    }
    // SAFETY: the C library's function of this name, which has this type.
    unsafe { mem::transmute::<*mut c_void, unsafe extern "C" fn(*mut c_void) -> !>(end)(value) }
}
