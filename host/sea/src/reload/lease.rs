//! Whether somebody still writes a file, and nobody while it is read: a read lease of the kernel.

use std::fs::File;

/// What the kernel says of a file's writers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Writers {
    /// None, and whoever wants to write waits until the lease is over.
    None,
    /// Somebody has it open for writing, or mapped.
    Some,
    /// This system or file system does not tell.
    Unknown,
}

/// A lease on an open file; over when this value is dropped. Whoever opens the file for writing meanwhile
/// waits.
#[derive(Debug)]
pub(super) struct Lease<'a> {
    #[cfg_attr(not(target_os = "linux"), allow(dead_code, reason = "leases are Linux's"))]
    file: &'a File,
    pub(super) writers: Writers,
}

/// `F_SETSIG` of fcntl(2), which the crate libc does not name.
#[cfg(target_os = "linux")]
const F_SETSIG: i32 = 10;

#[cfg(target_os = "linux")]
impl<'a> Lease<'a> {
    /// Asks for a lease.
    pub(super) fn new(file: &'a File) -> Self {
        use std::os::fd::AsRawFd;
        let fd = file.as_raw_fd();
        // SAFETY: plain calls on a descriptor that is open. A writer that comes sends SIGURG, which does
        // nothing by default; the signal of a lease without this, SIGIO, would end the process.
        let taken = unsafe {
            libc::fcntl(fd, F_SETSIG, libc::SIGURG) == 0
                && libc::fcntl(fd, libc::F_SETLEASE, libc::F_RDLCK) == 0
        };
        let busy = || std::io::Error::last_os_error().raw_os_error() == Some(libc::EAGAIN);
        let writers = match taken {
            true => Writers::None,
            false if busy() => Writers::Some,
            false => Writers::Unknown,
        };
        Self { file, writers }
    }
}

#[cfg(target_os = "linux")]
impl Drop for Lease<'_> {
    fn drop(&mut self) {
        use std::os::fd::AsRawFd;
        if self.writers == Writers::None {
            // SAFETY: gives back what `new` took on the same descriptor.
            unsafe { libc::fcntl(self.file.as_raw_fd(), libc::F_SETLEASE, libc::F_UNLCK) };
        }
    }
}

#[cfg(not(target_os = "linux"))]
impl<'a> Lease<'a> {
    /// Asks for a lease: not here.
    pub(super) fn new(file: &'a File) -> Self {
        Self { file, writers: Writers::Unknown }
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_being_written_is_told_from_one_that_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        let writer = File::create(&path).unwrap();
        let reader = File::open(&path).unwrap();
        assert_eq!(Lease::new(&reader).writers, Writers::Some);
        drop(writer);
        let lease = Lease::new(&reader);
        assert_eq!(lease.writers, Writers::None);
        // A writer that comes meanwhile waits for the lease's end, and nobody dies of it.
        let late = std::thread::spawn(move || std::fs::write(path, "late").unwrap());
        std::thread::sleep(std::time::Duration::from_millis(20));
        assert!(!late.is_finished());
        drop(lease);
        late.join().unwrap();
    }
}
