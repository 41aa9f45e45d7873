//! The host's services that may be called anywhere, and the growable structs of the contract.

use std::ffi::{CStr, CString, c_char, c_void};

use reef_abi as abi;

use crate::error::{AssetError, TextureError};

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
// SAFETY: as above.
unsafe impl Growable for abi::Limits {}

/// Reads `min(size, sizeof)` bytes and takes the rest as zero; None for NULL, a misaligned pointer, or no
/// size.
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
    // SAFETY: both sides have at least that many bytes and do not overlap; all-zero is a valid value, and
    // what the other side wrote is one, too.
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

/// How the bytes of a texture are meant: red, green, blue, alpha, each 8 bits; alpha is straight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum TextureFormat {
    /// Red, green and blue are sRGB, as in PNG files.
    Srgb = abi::TEXTURE_RGBA8_SRGB,
    /// Red, green and blue are linear.
    Linear = abi::TEXTURE_RGBA8,
}

/// What one instance may have at most.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    streams: &'static [u64],
    /// Of a saved state [bytes].
    pub state_bytes: u64,
    /// That a step borrows as scratch memory, all together [bytes].
    pub scratch_bytes: u64,
    /// At a time.
    pub textures: u32,
    /// At a time.
    pub meshes: u32,
}

impl Limits {
    /// Most elements of a stream (`abi::STREAM_*`) in a step; 0: the host does not take it.
    pub fn of_stream(&self, stream: u32) -> u64 {
        self.streams.get(stream as usize).copied().unwrap_or(0)
    }
}

/// The host's services that belong to no step: log, watchdog, textures. It may be kept as long as the
/// instance lives.
#[derive(Clone, Copy, Debug)]
pub struct Host {
    raw: abi::Host,
}

// SAFETY: the contract allows these services from any thread of the generation; the pointers belong to the
// host and stay valid until the instance is destroyed.
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

    /// The version of the contract that the host has, as [`abi::VERSION`] is this library's. Flags, kinds,
    /// patterns, formats and streams of a later version than the host's are left alone.
    pub fn version(&self) -> u32 {
        self.raw.version
    }

    /// Writes a line to the host's log.
    pub fn log(&self, level: Level, text: &str) {
        if let Some(log) = self.raw.log {
            // SAFETY: pointer and length of a living string; the host copies what it keeps.
            unsafe { log(self.raw.ctx, level as u32, text.as_ptr().cast::<c_char>(), text.len() as u64) }
        }
    }

    /// A figure for people who look at the module in the panel; the last value of each name is shown. Names
    /// are few and short (32 of 64 bytes), and the same in every step.
    pub fn figure(&self, name: &str, value: f64) {
        if let Some(figure) = self.raw.figure {
            // SAFETY: as in `log`.
            unsafe { figure(self.raw.ctx, name.as_ptr().cast::<c_char>(), name.len() as u64, value) }
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

    /// Makes a texture of `width * height` texels of four bytes each, row after row. In `create` and in a
    /// step, not in its jobs.
    ///
    /// `Err`: sizes and their number have limits. Turned into the error of a create or a step, it leaves the
    /// word to the host, which says them.
    pub fn texture(
        &self,
        name: &str,
        format: TextureFormat,
        [width, height]: [u32; 2],
        texels: &[u8],
    ) -> Result<Texture, TextureError> {
        if texels.len() as u64 != u64::from(width) * u64::from(height) * 4 {
            return Err(TextureError::Size { name: name.to_owned(), width, height, bytes: texels.len() });
        }
        let refused = || TextureError::Refused { name: name.to_owned() };
        let create = self.raw.texture_create.ok_or_else(refused)?;
        // A NUL would end the name early: it is left out.
        let c_name = CString::new(name.replace('\0', "")).unwrap_or_default();
        let texture = abi::Texture {
            texels: texels.as_ptr().cast(),
            format: format as u32,
            width,
            height,
            spare: [0; 3],
            name: c_name.as_ptr(),
        };
        let mut id = 0;
        // SAFETY: the texture's pointers lead to living memory of the size that it says; the host copies what
        // it keeps.
        match unsafe { create(self.raw.ctx, &texture, &mut id) } {
            abi::OK => Ok(Texture { host: *self, id }),
            _ => Err(refused()),
        }
    }

    /// One of the module's own files, by its path within the module's folder of assets. In `create` and
    /// `load`, not in a step. `Err`: there is none, or it may not be read; turned into the error of a create,
    /// it leaves the word to the host, which says them.
    pub fn asset(&self, name: &str) -> Result<Vec<u8>, AssetError> {
        let refused = || AssetError { name: name.to_owned() };
        let read = self.raw.asset_read.ok_or_else(refused)?;
        let (mut bytes, mut length) = (std::ptr::null(), 0);
        // SAFETY: pointer and length of a living string, and places for the results.
        let status = unsafe {
            read(self.raw.ctx, name.as_ptr().cast::<c_char>(), name.len() as u64, &mut bytes, &mut length)
        };
        match (status, usize::try_from(length)) {
            (abi::OK, Ok(0)) => Ok(Vec::new()),
            (abi::OK, Ok(length)) => {
                // SAFETY: so many bytes of the host's, which stay until this call of the plugin returned.
                Ok(unsafe { std::slice::from_raw_parts(bytes.cast::<u8>(), length) }.to_vec())
            }
            _ => Err(refused()),
        }
    }

    /// What one instance may have at most; None: the host does not tell.
    pub fn limits(&self) -> Option<Limits> {
        let table = self.extension(abi::EXTENSION_LIMITS)?.cast::<abi::Limits>();
        // SAFETY: the table of this extension, as the contract has it.
        let table = unsafe { read_sized(table) }?;
        let streams = match table.streams.is_null() {
            true => &[],
            // SAFETY: so many constants of the host's.
            false => unsafe { std::slice::from_raw_parts(table.streams, table.stream_count as usize) },
        };
        Some(Limits {
            streams,
            state_bytes: table.state_bytes,
            scratch_bytes: table.scratch_bytes,
            textures: table.textures,
            meshes: table.meshes,
        })
    }

    /// The host's table of an extension, of the layout that the extension's documentation gives it; None: the
    /// host does not have it.
    pub fn extension(&self, id: &CStr) -> Option<*const c_void> {
        let ask = self.raw.get_extension?;
        // SAFETY: a text that lives during the call.
        let table = unsafe { ask(self.raw.ctx, id.as_ptr()) };
        (!table.is_null()).then_some(table)
    }

    /// How many workers share the jobs.
    pub fn worker_count(&self) -> usize {
        (self.raw.worker_count as usize).max(1)
    }
}

/// A texture that the host keeps for this instance. Dropped, it is gone: nothing that is emitted from then on
/// may name it.
#[derive(Debug)]
pub struct Texture {
    host: Host,
    id: u32,
}

impl Texture {
    /// What billboards and materials name it by.
    pub fn id(&self) -> u32 {
        self.id
    }
}

impl Drop for Texture {
    fn drop(&mut self) {
        if let Some(destroy) = self.host.raw.texture_destroy {
            // SAFETY: a service with a number; like the instance that holds this value, it ends before the
            // host's table does. A refusal leaves a texture that nothing names.
            let _ = unsafe { destroy(self.host.raw.ctx, self.id) };
        }
    }
}
