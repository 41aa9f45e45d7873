//! Touching a plugin's memory before a service uses it: a bad pointer faults here, while the thread is still
//! in the plugin's code by its marker, before the service holds anything.

/// Reads one byte of each page of `length` bytes; nothing for NULL.
pub(crate) fn probe_read(start: *const u8, length: usize) {
    touch(start, length, |byte| {
        // SAFETY: a plugin's word; if it lied, the guard around its call takes the fault.
        unsafe { byte.read_volatile() };
    });
}

/// Writes one byte of each page of `length` bytes, without changing it; nothing for NULL.
pub(crate) fn probe_write(start: *mut u8, length: usize) {
    touch(start, length, |byte| {
        let byte = byte.cast_mut();
        // SAFETY: as above; the memory is the calling job's own for the length of the call.
        unsafe { byte.write_volatile(byte.read_volatile()) };
    });
}

/// Pages are at least this large.
const PAGE: usize = 4096;

fn touch(start: *const u8, length: usize, touch: impl Fn(*const u8)) {
    if start.is_null() || length == 0 {
        return;
    }
    for at in (0..length).step_by(PAGE) {
        touch(start.wrapping_add(at));
    }
    touch(start.wrapping_add(length - 1));
}
