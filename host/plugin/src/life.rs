//! A library's own code at its beginning and its end: constructors and destructors. The system's loader would
//! run them with its lock held, which no guard may leave; so the copy that is loaded does not tell it of
//! them, and the host runs them itself.

use std::{ptr, sync::atomic::AtomicPtr};

use object::{
    NativeEndian, elf,
    read::elf::{Dyn, FileHeader, ProgramHeader},
};

use super::image::Image;

/// Where the library's code for its beginning and its end is, relative to where it is loaded.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Life {
    /// Places in the file where the loader would read of it.
    tags: Vec<u64>,
    init: u64,
    /// Start and bytes of the list of functions.
    init_array: (u64, u64),
    fini: u64,
    fini_array: (u64, u64),
}

/// What stands in the place of a tag: no loader knows it, and passes over it.
pub(super) const PASSED_OVER: u64 = 0x6052_4545;

/// How the C library calls a constructor.
type Init = unsafe extern "C" fn(argc: i32, argv: *const *const u8, environment: *const *const u8);
/// How it calls a destructor.
type Fini = unsafe extern "C" fn();

unsafe extern "C" {
    #[cfg(unix)]
    static environ: *const *const u8;
}

/// The environment, as the C library hands it to constructors.
fn environment() -> *const *const u8 {
    // SAFETY: a pointer, which is copied.
    #[cfg(unix)]
    let environment = unsafe { environ };
    #[cfg(not(unix))]
    let environment = ptr::null();
    environment
}

/// No arguments, as the C library hands them to constructors: whoever keeps them finds them there for ever.
fn arguments() -> *const *const u8 {
    static END: AtomicPtr<u8> = AtomicPtr::new(ptr::null_mut());
    END.as_ptr().cast_const().cast()
}

impl Life {
    /// As a file tells it. One that cannot be read so is left to the loader.
    pub(super) fn of(image: &Image<'_>) -> Self {
        match cfg!(target_os = "linux") {
            true => Self::read(image).unwrap_or_default(),
            false => Self::default(),
        }
    }

    fn read(image: &Image<'_>) -> Option<Self> {
        let header = elf::FileHeader64::<NativeEndian>::parse(image).ok()?;
        let endian = header.endian().ok()?;
        let segments = header.program_headers(endian, image).ok()?;
        let segment = segments.iter().find(|segment| segment.p_type(endian) == elf::PT_DYNAMIC)?;
        let entries = segment.dynamic(endian, image).ok()??;
        let mut life = Self::default();
        for (number, entry) in entries.iter().enumerate() {
            let (tag, value) = (entry.d_tag(endian), entry.d_val(endian));
            let place = match tag {
                elf::DT_NULL => break,
                elf::DT_INIT => &mut life.init,
                elf::DT_INIT_ARRAY => &mut life.init_array.0,
                elf::DT_INIT_ARRAYSZ => &mut life.init_array.1,
                elf::DT_FINI => &mut life.fini,
                elf::DT_FINI_ARRAY => &mut life.fini_array.0,
                elf::DT_FINI_ARRAYSZ => &mut life.fini_array.1,
                _ => continue,
            };
            *place = value;
            let within = (number * size_of::<elf::Dyn64<NativeEndian>>()) as u64;
            life.tags.push(segment.p_offset(endian).checked_add(within)?);
        }
        Some(life)
    }

    /// Where [`PASSED_OVER`] has to stand in the file that is loaded.
    pub(super) fn tags(&self) -> &[u64] {
        &self.tags
    }

    /// Runs the constructors, as the loader would have.
    ///
    /// # Safety
    /// The library of which this was read is loaded at `base`, without its tags, and its constructors did not
    /// run.
    pub(super) unsafe fn begin(&self, base: usize) {
        let run = |function: usize| {
            // SAFETY: the caller's promise: a constructor of the library, which is called as the C library
            // calls it. If the file lied, the guard around this takes the fault.
            unsafe { std::mem::transmute::<usize, Init>(function)(0, arguments(), environment()) };
        };
        if self.init != 0 {
            run(base.wrapping_add(self.init as usize));
        }
        // SAFETY: the caller's promise.
        unsafe { functions(base, self.init_array) }.for_each(run);
    }

    /// Runs the destructors.
    ///
    /// # Safety
    /// As [`Life::begin`]'s, which ran; nobody uses the library any more.
    pub(super) unsafe fn end(&self, base: usize) {
        let run = |function: usize| {
            // SAFETY: as above.
            unsafe { std::mem::transmute::<usize, Fini>(function)() };
        };
        // SAFETY: the caller's promise.
        unsafe { functions(base, self.fini_array) }.rev().for_each(run);
        if self.fini != 0 {
            run(base.wrapping_add(self.fini as usize));
        }
    }
}

/// The functions of a list, but for places that are empty.
///
/// # Safety
/// The list is in the library that is loaded at `base`. If the file lied, reading it is a fault, within the
/// guard.
unsafe fn functions(base: usize, (start, bytes): (u64, u64)) -> impl DoubleEndedIterator<Item = usize> {
    let list = base.wrapping_add(start as usize) as *const usize;
    let count = bytes as usize / size_of::<usize>();
    // SAFETY: the caller's promise.
    (0..count).map(move |at| unsafe { list.wrapping_add(at).read() }).filter(|function| *function != 0)
}

/// Where a library is loaded; None: the loader does not say.
///
/// # Safety
/// A handle of the system's loader that is open.
#[cfg(target_os = "linux")]
pub(super) unsafe fn base(handle: *mut libc::c_void) -> Option<usize> {
    /// The head of the loader's description of a library, as `<link.h>` has it.
    #[repr(C)]
    struct LinkMap {
        base: usize,
    }
    let mut map: *const LinkMap = ptr::null();
    // SAFETY: the caller's promise; the answer is a pointer to the loader's own description, which lives as
    // long as the handle.
    unsafe {
        let asked = libc::dlinfo(handle, libc::RTLD_DI_LINKMAP, (&raw mut map).cast());
        (asked == 0 && !map.is_null()).then(|| (*map).base)
    }
}

/// Other systems' loaders run what a library has for its beginning and its end.
///
/// # Safety
/// None.
#[cfg(all(unix, not(target_os = "linux")))]
pub(super) unsafe fn base(_: *mut libc::c_void) -> Option<usize> {
    Some(0)
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    #[test]
    fn a_programs_constructors_are_found_and_a_text_has_none() {
        let bytes = std::fs::read(std::env::current_exe().unwrap()).unwrap();
        let life = Life::of(&Image::whole(&bytes));
        assert!(life.init_array.1 >= 8 && life.fini_array.1 >= 8, "{life:?}");
        assert!(life.tags.len() >= 4);
        for tag in &life.tags {
            let tag = u64::from_ne_bytes(bytes[*tag as usize..*tag as usize + 8].try_into().unwrap());
            assert!([12, 13, 25, 26, 27, 28].contains(&tag), "{tag}");
        }
        assert_eq!(Life::of(&Image::whole(b"a letter")), Life::default());
    }
}
