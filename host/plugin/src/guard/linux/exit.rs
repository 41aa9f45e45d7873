//! The program's end after a quarantine: no code of a quarantined library runs, its destructors included.

/// From now on the program ends without destructors of libraries.
#[cfg(target_env = "gnu")]
pub(crate) fn end_without_destructors() {
    use std::{ffi::c_void, ptr, sync::Once};

    unsafe extern "C" {
        fn on_exit(call: unsafe extern "C" fn(i32, *mut c_void), argument: *mut c_void) -> i32;
    }

    /// Runs before what was registered earlier: constructors of libraries, and the loader itself.
    unsafe extern "C" fn end(code: i32, _: *mut c_void) {
        // SAFETY: ends the process; Rust's own output was flushed before handlers run.
        unsafe { libc::_exit(code) };
    }

    static REGISTERED: Once = Once::new();
    REGISTERED.call_once(|| {
        // SAFETY: registers a function of this program. Where there is no memory for it, the system's own end
        // remains.
        unsafe { on_exit(end, ptr::null_mut()) };
    });
}

/// Other C libraries do not tell handlers the exit code: destructors run.
#[cfg(not(target_env = "gnu"))]
pub(crate) fn end_without_destructors() {}
