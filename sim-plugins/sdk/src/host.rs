//! The host's services that may be called anywhere, and the growable structs of the contract.

use std::ffi::c_char;

use reef_abi as abi;

/// A struct of the contract that begins with `size: u32` and may be longer or shorter on the other side.
///
/// # Safety
/// `repr(C)`, first field `u32`, valid when all bytes are zero.
pub(crate) unsafe trait Growable: Copy {}
// SAFETY: numbers, raw pointers and optional functions, `size` first.
unsafe impl Growable for abi::Host {}
// SAFETY: as above.
unsafe impl Growable for abi::Step {}
// SAFETY: as above.
unsafe impl Growable for abi::Output {}
// SAFETY: as above.
unsafe impl Growable for abi::Writer {}
// SAFETY: as above.
unsafe impl Growable for abi::Reader {}

/// Reads `min(size, sizeof)` bytes and takes the rest as zero; None for NULL, a misaligned pointer, or no size.
///
/// # Safety
/// A pointer that is neither NULL nor misaligned points to as many bytes as the `u32` there says.
pub(crate) unsafe fn read_sized<T: Growable>(pointer: *const T) -> Option<T> {
    if pointer.is_null() || !pointer.is_aligned() {
        return None;
    }
    // SAFETY: the caller's promise; `size` is the first field.
    let size = unsafe { pointer.cast::<u32>().read() } as usize;
    if size < size_of::<u32>() {
        return None;
    }
    let mut value = std::mem::MaybeUninit::<T>::zeroed();
    // SAFETY: both sides have at least that many bytes and do not overlap; all-zero is a valid value, and what the other
    // side wrote is one, too.
    unsafe {
        std::ptr::copy_nonoverlapping(
            pointer.cast::<u8>(),
            value.as_mut_ptr().cast::<u8>(),
            size.min(size_of::<T>()),
        );
        Some(value.assume_init())
    }
}

/// How loud a message is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Level {
    /// Something failed.
    Error = abi::LOG_ERROR,
    /// Something is odd.
    Warn = abi::LOG_WARN,
    /// Worth knowing once.
    Info = abi::LOG_INFO,
    /// For the plugin's own authors.
    Debug = abi::LOG_DEBUG,
}

/// The host's services that may be called from anywhere: log, watchdog. It may be kept as long as the instance lives.
#[derive(Clone, Copy, Debug)]
pub struct Host {
    raw: abi::Host,
}

// SAFETY: the contract allows these services from any thread of the generation; the pointers belong to the host and stay
// valid until the instance is destroyed.
unsafe impl Send for Host {}
// SAFETY: as above.
unsafe impl Sync for Host {}

impl Host {
    /// Takes over the host's table; None when it is unusable.
    ///
    /// # Safety
    /// The pointer is NULL or one that the host handed out, and outlives the value.
    pub(crate) unsafe fn from_raw(host: *const abi::Host) -> Option<Self> {
        // SAFETY: the caller's promise.
        unsafe { read_sized(host) }.map(|raw| Self { raw })
    }

    /// The table of functions.
    pub(crate) fn raw(&self) -> &abi::Host {
        &self.raw
    }

    /// Writes a line to the host's log.
    pub fn log(&self, level: Level, text: &str) {
        if let Some(log) = self.raw.log {
            // SAFETY: pointer and length of a living string; the host copies what it keeps.
            unsafe { log(self.raw.ctx, level as u32, text.as_ptr().cast::<c_char>(), text.len() as u64) }
        }
    }

    /// Leaves the message of the failure that is about to be returned.
    pub(crate) fn set_error(&self, text: &str) {
        if let Some(set_error) = self.raw.set_error {
            // SAFETY: as in `log`.
            unsafe { set_error(self.raw.ctx, text.as_ptr().cast::<c_char>(), text.len() as u64) }
        }
    }

    /// True: the host asks this call to return soon. Worth a look once per chunk of long work.
    pub fn should_stop(&self) -> bool {
        // SAFETY: a service without arguments but its context.
        self.raw.should_stop.is_some_and(|ask| unsafe { ask(self.raw.ctx) } != 0)
    }

    /// How many workers share the jobs.
    pub fn worker_count(&self) -> usize {
        (self.raw.worker_count as usize).max(1)
    }
}
