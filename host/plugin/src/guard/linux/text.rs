//! A library's executable memory, and taking it away from a runaway: whoever runs it faults on the next
//! instruction, at a place where nothing of the C library is half done.

use std::{ffi::c_void, ptr};

/// Executable memory of a library.
#[derive(Debug)]
pub(crate) struct Text {
    /// Start and length, in whole pages.
    ranges: Vec<(usize, usize)>,
}

/// What [`find`] looks for, and what it found.
struct Search {
    address: usize,
    page: usize,
    ranges: Vec<(usize, usize)>,
}

impl Text {
    /// Of the library that an address belongs to. The library stays loaded as long as this value is used.
    pub(crate) fn of(address: usize) -> Option<Self> {
        // SAFETY: a number.
        let page =
            usize::try_from(unsafe { libc::sysconf(libc::_SC_PAGESIZE) }).ok().filter(|page| *page > 0)?;
        let mut search = Search { address, page, ranges: Vec::new() };
        // SAFETY: `find` takes a `Search`, which lives during the call.
        unsafe { libc::dl_iterate_phdr(Some(find), (&raw mut search).cast()) };
        (!search.ranges.is_empty()).then_some(Self { ranges: search.ranges })
    }

    /// Takes execution away. False where the system refuses.
    pub(super) fn deny(&self) -> bool {
        self.protect(libc::PROT_READ)
    }

    /// Gives it back.
    pub(crate) fn allow(&self) {
        self.protect(libc::PROT_READ | libc::PROT_EXEC);
    }

    fn protect(&self, protection: i32) -> bool {
        self.ranges.iter().fold(true, |all, &(start, length)| {
            // SAFETY: text of a plugin's library, which no host code runs or writes; who runs it is in a
            // guarded call.
            all & (unsafe { libc::mprotect(start as *mut c_void, length, protection) } == 0)
        })
    }
}

/// Remembers the executable segments of the library with the address in it.
unsafe extern "C" fn find(info: *mut libc::dl_phdr_info, _: usize, search: *mut c_void) -> i32 {
    // SAFETY: `of` passes its search; the loader's description of a loaded library.
    let (search, base, headers) = unsafe {
        let info = &*info;
        let headers = match info.dlpi_phnum {
            0 => ptr::slice_from_raw_parts(ptr::dangling(), 0),
            count => ptr::slice_from_raw_parts(info.dlpi_phdr, usize::from(count)),
        };
        (&mut *search.cast::<Search>(), info.dlpi_addr as usize, &*headers)
    };
    let loaded = || headers.iter().filter(|header| header.p_type == libc::PT_LOAD);
    let start = |header: &libc::Elf64_Phdr| base.wrapping_add(header.p_vaddr as usize);
    if !loaded().any(|header| search.address.wrapping_sub(start(header)) < header.p_memsz as usize) {
        return 0;
    }
    for header in loaded().filter(|header| header.p_flags & libc::PF_X != 0) {
        let from = start(header) & !(search.page - 1);
        let to = (start(header) + header.p_memsz as usize).next_multiple_of(search.page);
        search.ranges.push((from, to - from));
    }
    1
}
