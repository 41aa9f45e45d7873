//! Signals and code addresses in words.

use std::{ffi::CStr, mem::MaybeUninit, path::Path};

/// What a signal says.
pub(super) fn signal(signal: i32, code: i32, address: usize) -> String {
    // `si_code` of the kernel, where it says more than the name: the same numbers on all machines that have
    // guards.
    const FROM_KERNEL: i32 = 0x80;
    let (name, more) = match (signal, code) {
        (libc::SIGSEGV, 1) => ("SIGSEGV", format!("address {address:#x} is not mapped")),
        (libc::SIGSEGV, 2) => ("SIGSEGV", format!("address {address:#x} may not be used in this way")),
        (libc::SIGSEGV, FROM_KERNEL) => ("SIGSEGV", "an address that no machine has".to_owned()),
        (libc::SIGSEGV, _) => ("SIGSEGV", format!("address {address:#x}")),
        (libc::SIGBUS, 1) => ("SIGBUS", format!("address {address:#x} is misaligned")),
        (libc::SIGBUS, _) => ("SIGBUS", format!("there is no memory behind address {address:#x}")),
        (libc::SIGILL, _) => ("SIGILL", format!("no instruction at address {address:#x}")),
        (libc::SIGFPE, 1) => ("SIGFPE", format!("an integer divided by zero at address {address:#x}")),
        (libc::SIGFPE, 2) => ("SIGFPE", format!("an integer overflow at address {address:#x}")),
        (libc::SIGFPE, _) => ("SIGFPE", format!("arithmetic at address {address:#x}")),
        (libc::SIGTRAP, _) => ("SIGTRAP", format!("a breakpoint at address {address:#x}")),
        (libc::SIGSYS, _) => {
            ("SIGSYS", format!("a call of the system that is not allowed, at address {address:#x}"))
        }
        (libc::SIGABRT, _) => {
            ("SIGABRT", "it aborted (an assertion, a double free): the heap may be damaged".to_owned())
        }
        (signal, _) => return format!("signal {signal}"),
    };
    // A signal that the code sent itself has no address.
    if code <= 0 && signal != libc::SIGABRT {
        return format!("{name}: it raised the signal itself");
    }
    format!("{name}: {more}")
}

/// The name of a signal of a fault.
pub(super) fn name(signal: i32) -> &'static str {
    match signal {
        libc::SIGSEGV => "SIGSEGV",
        libc::SIGBUS => "SIGBUS",
        libc::SIGILL => "SIGILL",
        libc::SIGFPE => "SIGFPE",
        libc::SIGABRT => "SIGABRT",
        libc::SIGTRAP => "SIGTRAP",
        libc::SIGSYS => "SIGSYS",
        libc::SIGURG => "SIGURG",
        _ => "a signal",
    }
}

/// Where an address is, as `libsea.so+0x1c20`, with the exported function before it; None: in no library.
pub(super) fn place(address: usize) -> Option<String> {
    let mut info = MaybeUninit::<libc::Dl_info>::zeroed();
    // SAFETY: any number may be asked about; the answer is plain data.
    let info = unsafe {
        if libc::dladdr(address as *const libc::c_void, info.as_mut_ptr()) == 0 {
            return None;
        }
        info.assume_init()
    };
    if info.dli_fname.is_null() {
        return None;
    }
    // SAFETY: the loader's own name of a library that is loaded.
    let file = unsafe { CStr::from_ptr(info.dli_fname) }.to_string_lossy().into_owned();
    let name = Path::new(&file).file_name()?.to_string_lossy().into_owned();
    Some(format!("{name}+{:#x}", address.wrapping_sub(info.dli_fbase as usize)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signals_are_told_with_their_address_where_they_have_one() {
        assert_eq!(signal(libc::SIGSEGV, 1, 0x10), "SIGSEGV: address 0x10 is not mapped");
        assert!(signal(libc::SIGFPE, 1, 0x99).contains("divided by zero at address 0x99"));
        assert_eq!(signal(libc::SIGILL, -6, 0), "SIGILL: it raised the signal itself");
        assert!(signal(libc::SIGABRT, -6, 0).contains("the heap may be damaged"));
    }

    #[test]
    fn code_is_found_in_its_file() {
        let own = std::env::current_exe().unwrap();
        let own = own.file_name().unwrap().to_string_lossy().into_owned();
        let found = place(place as *const () as usize).unwrap();
        assert!(found.starts_with(&format!("{own}+0x")), "{found}");
        assert_eq!(place(8), None);
    }
}
