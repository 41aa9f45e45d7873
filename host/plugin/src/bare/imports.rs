//! Watches what a loaded library calls of others: memory, threads, functions of the C library whose results
//! differ from system to system. Its table of imported functions is led to counters, which go on to what
//! stood there.

use std::{
    ffi::{CStr, c_char, c_void},
    mem,
    sync::atomic::{AtomicBool, AtomicPtr, AtomicU64, Ordering},
};

use crate::library::Library;

/// What is counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Memory from the system.
    Memory,
    /// Threads and processes that are started.
    Thread,
    /// sin, exp, pow and their like.
    Inexact,
}

const KINDS: usize = 3;

static ASKED: AtomicBool = AtomicBool::new(false);
static COUNTS: [AtomicU64; KINDS] = [const { AtomicU64::new(0) }; KINDS];
/// The last function of each kind that was called, as its number in `WATCHED`, from 1.
static LAST: [AtomicU64; KINDS] = [const { AtomicU64::new(0) }; KINDS];

/// An imported function, the counter in its place, and what stood there.
struct Watched {
    name: &'static CStr,
    counter: *const c_void,
    before: &'static AtomicPtr<c_void>,
}

// SAFETY: addresses of functions of this program.
unsafe impl Sync for Watched {}

/// Notes a call of the function with this name.
fn note(kind: Kind, name: &'static CStr) {
    if !ASKED.load(Ordering::Relaxed) {
        return;
    }
    COUNTS[kind as usize].fetch_add(1, Ordering::Relaxed);
    let number = WATCHED.iter().position(|watched| watched.name == name).map_or(0, |at| at as u64 + 1);
    LAST[kind as usize].store(number, Ordering::Relaxed);
}

macro_rules! watched {
    ($($kind:ident { $($function:ident($($argument:ident: $of:ty),*) $(-> $result:ty)?;)* })*) => {
        mod counters {
            #![allow(non_snake_case, reason = "names of C++")]
            use super::*;
            $($(
                pub(super) mod $function {
                    use super::*;
                    pub(in super::super) static BEFORE: AtomicPtr<c_void> = AtomicPtr::new(std::ptr::null_mut());

                    pub(in super::super) unsafe extern "C" fn counter($($argument: $of),*) $(-> $result)? {
                        const NAME: &CStr = match CStr::from_bytes_with_nul(
                            concat!(stringify!($function), "\0").as_bytes(),
                        ) {
                            Ok(name) => name,
                            Err(_) => c"",
                        };
                        note(Kind::$kind, NAME);
                        // SAFETY: `watch` stored the function of this name and type there before it led
                        // anybody here.
                        unsafe {
                            let before = mem::transmute::<
                                *mut c_void,
                                unsafe extern "C" fn($($of),*) $(-> $result)?,
                            >(BEFORE.load(Ordering::Relaxed));
                            before($($argument),*)
                        }
                    }
                }
            )*)*
        }

        static WATCHED: &[Watched] = &[$($(
            Watched {
                name: match CStr::from_bytes_with_nul(concat!(stringify!($function), "\0").as_bytes()) {
                    Ok(name) => name,
                    Err(_) => c"",
                },
                counter: counters::$function::counter as *const c_void,
                before: &counters::$function::BEFORE,
            },
        )*)*];
    };
}

watched! {
    Memory {
        malloc(size: usize) -> *mut c_void;
        calloc(count: usize, size: usize) -> *mut c_void;
        realloc(memory: *mut c_void, size: usize) -> *mut c_void;
        aligned_alloc(align: usize, size: usize) -> *mut c_void;
        memalign(align: usize, size: usize) -> *mut c_void;
        posix_memalign(out: *mut *mut c_void, align: usize, size: usize) -> i32;
        _Znwm(size: usize) -> *mut c_void;
        _Znam(size: usize) -> *mut c_void;
        _ZnwmSt11align_val_t(size: usize, align: usize) -> *mut c_void;
        mmap(at: *mut c_void, size: usize, protection: i32, flags: i32, file: i32, offset: i64) -> *mut c_void;
    }
    Thread {
        pthread_create(out: *mut c_void, how: *const c_void, start: *const c_void, user: *mut c_void) -> i32;
        thrd_create(out: *mut c_void, start: *const c_void, user: *mut c_void) -> i32;
        fork() -> i32;
    }
    Inexact {
        sin(x: f64) -> f64; cos(x: f64) -> f64; tan(x: f64) -> f64;
        asin(x: f64) -> f64; acos(x: f64) -> f64; atan(x: f64) -> f64; atan2(y: f64, x: f64) -> f64;
        sinh(x: f64) -> f64; cosh(x: f64) -> f64; tanh(x: f64) -> f64;
        exp(x: f64) -> f64; exp2(x: f64) -> f64; expm1(x: f64) -> f64;
        log(x: f64) -> f64; log2(x: f64) -> f64; log10(x: f64) -> f64; log1p(x: f64) -> f64;
        pow(x: f64, y: f64) -> f64; cbrt(x: f64) -> f64; hypot(x: f64, y: f64) -> f64;
        sincos(x: f64, sine: *mut f64, cosine: *mut f64);
        sinf(x: f32) -> f32; cosf(x: f32) -> f32; tanf(x: f32) -> f32;
        asinf(x: f32) -> f32; acosf(x: f32) -> f32; atanf(x: f32) -> f32; atan2f(y: f32, x: f32) -> f32;
        sinhf(x: f32) -> f32; coshf(x: f32) -> f32; tanhf(x: f32) -> f32;
        expf(x: f32) -> f32; exp2f(x: f32) -> f32; expm1f(x: f32) -> f32;
        logf(x: f32) -> f32; log2f(x: f32) -> f32; log10f(x: f32) -> f32; log1pf(x: f32) -> f32;
        powf(x: f32, y: f32) -> f32; cbrtf(x: f32) -> f32; hypotf(x: f32, y: f32) -> f32;
        sincosf(x: f32, sine: *mut f32, cosine: *mut f32);
    }
}

/// A library whose imports are watched.
#[derive(Clone, Copy, Debug)]
pub struct Imports(());

impl Imports {
    /// Calls of this kind, from any thread, while `work` runs, and the name of the last function among them.
    pub fn count(&self, kind: Kind, work: impl FnOnce()) -> (u64, &'static str) {
        let at = kind as usize;
        COUNTS[at].store(0, Ordering::Relaxed);
        ASKED.store(true, Ordering::SeqCst);
        work();
        ASKED.store(false, Ordering::SeqCst);
        let last = LAST[at].load(Ordering::Relaxed) as usize;
        let name = last.checked_sub(1).and_then(|at| WATCHED.get(at)).map(|watched| watched.name);
        (COUNTS[at].load(Ordering::Relaxed), name.and_then(|name| name.to_str().ok()).unwrap_or(""))
    }
}

impl Library {
    /// Watches its imports from now on. Err: the library's table of imports is not understood.
    pub fn watch_imports(&self) -> Result<Imports, String> {
        let Some(open) = self.raw_entry().open else { return Err("it is closed".into()) };
        let mut search = Search { address: open as usize, found: 0, dynamic: None };
        // SAFETY: `find` takes a `Search`, which lives during the call.
        unsafe { libc::dl_iterate_phdr(Some(find), (&raw mut search).cast()) };
        let (base, dynamic) =
            search.dynamic.ok_or("the system's loader does not tell where its imports are")?;
        // SAFETY: the loader's own description of a library that stays loaded as long as `self` lives.
        unsafe { patch(base, dynamic) };
        Ok(Imports(()))
    }
}

struct Search {
    address: usize,
    found: usize,
    /// Where the library was loaded, and its dynamic section.
    dynamic: Option<(usize, *const Dyn)>,
}

/// An entry of the dynamic section.
#[repr(C)]
#[derive(Clone, Copy)]
struct Dyn {
    tag: i64,
    value: usize,
}

/// A relocation with addend.
#[repr(C)]
#[derive(Clone, Copy)]
struct Rela {
    offset: usize,
    info: u64,
    addend: i64,
}

unsafe extern "C" fn find(info: *mut libc::dl_phdr_info, _: usize, search: *mut c_void) -> i32 {
    // SAFETY: `watch_imports` passes its search; the loader's description of a loaded library.
    let (search, base, headers) = unsafe {
        let info = &*info;
        if info.dlpi_phnum == 0 {
            return 0;
        }
        let headers = std::slice::from_raw_parts(info.dlpi_phdr, usize::from(info.dlpi_phnum));
        (&mut *search.cast::<Search>(), info.dlpi_addr as usize, headers)
    };
    let inside = |header: &libc::Elf64_Phdr| {
        let start = base.wrapping_add(header.p_vaddr as usize);
        header.p_type == libc::PT_LOAD && search.address.wrapping_sub(start) < header.p_memsz as usize
    };
    if !headers.iter().any(inside) {
        return 0;
    }
    search.found += 1;
    let dynamic = headers.iter().find(|header| header.p_type == libc::PT_DYNAMIC);
    search.dynamic = dynamic.map(|header| (base, base.wrapping_add(header.p_vaddr as usize) as *const Dyn));
    1
}

/// Relocations that put a function's address into a word.
const fn puts_an_address(kind: u32) -> bool {
    const ABSOLUTE_X86_64: u32 = 1;
    const GLOBAL_X86_64: u32 = 6;
    const JUMP_X86_64: u32 = 7;
    const ABSOLUTE_AARCH64: u32 = 257;
    const GLOBAL_AARCH64: u32 = 1025;
    const JUMP_AARCH64: u32 = 1026;
    if cfg!(target_arch = "x86_64") {
        matches!(kind, ABSOLUTE_X86_64 | GLOBAL_X86_64 | JUMP_X86_64)
    } else {
        matches!(kind, ABSOLUTE_AARCH64 | GLOBAL_AARCH64 | JUMP_AARCH64)
    }
}

/// Leads the watched ones of a library's imports to their counters.
///
/// # Safety
/// The dynamic section of a loaded library at this base.
unsafe fn patch(base: usize, dynamic: *const Dyn) {
    const JUMPS_SIZE: i64 = 2;
    const STRINGS: i64 = 5;
    const SYMBOLS: i64 = 6;
    const RELOCATIONS: i64 = 7;
    const RELOCATIONS_SIZE: i64 = 8;
    const JUMPS: i64 = 23;
    let value = |tag: i64| {
        let mut at = dynamic;
        loop {
            // SAFETY: the section ends with a tag of 0.
            let entry = unsafe { *at };
            match entry.tag {
                0 => return None,
                found if found == tag => return Some(entry.value),
                // SAFETY: not the last one.
                _ => at = unsafe { at.add(1) },
            }
        }
    };
    // The GNU loader turns offsets into addresses here, others do not.
    let address = |tag: i64| value(tag).map(|at| if at < base { base + at } else { at });
    let (Some(strings), Some(symbols)) = (address(STRINGS), address(SYMBOLS)) else { return };
    for (table, size) in [(RELOCATIONS, RELOCATIONS_SIZE), (JUMPS, JUMPS_SIZE)] {
        let (Some(start), Some(size)) = (address(table), value(size)) else { continue };
        for i in 0..size / size_of::<Rela>() {
            // SAFETY: inside the table.
            let relocation = unsafe { *(start as *const Rela).add(i) };
            if !puts_an_address(relocation.info as u32) {
                continue;
            }
            // SAFETY: the relocation names a symbol of the table, and that a string.
            let name = unsafe {
                let symbol = &*(symbols as *const libc::Elf64_Sym).add((relocation.info >> 32) as usize);
                CStr::from_ptr((strings + symbol.st_name as usize) as *const c_char)
            };
            if let Some(watched) = WATCHED.iter().find(|watched| watched.name == name) {
                // SAFETY: the word that this relocation is about.
                unsafe { lead((base + relocation.offset) as *mut *mut c_void, watched) };
            }
        }
    }
}

/// # Safety
/// A word of a loaded library with the address of the watched function in it.
unsafe fn lead(word: *mut *mut c_void, watched: &Watched) {
    const PAGE: usize = 4096;
    // SAFETY: the caller's promise; the page holds nothing but data of the library.
    unsafe {
        let counter = watched.counter.cast_mut();
        let before = word.read();
        if before == counter || before.is_null() {
            return;
        }
        let page = (word as usize & !(PAGE - 1)) as *mut c_void;
        if libc::mprotect(page, PAGE, libc::PROT_READ | libc::PROT_WRITE) != 0 {
            return;
        }
        watched.before.store(before, Ordering::Relaxed);
        word.write(counter);
    }
}
