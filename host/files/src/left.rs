//! What is on its way: it must not stay when the program is told to end in the middle.

use std::{
    io,
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
};

static ON_ITS_WAY: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// While it lives, a signal removes this file or folder.
#[derive(Debug)]
pub(super) struct Mark(PathBuf);

impl Drop for Mark {
    fn drop(&mut self) {
        ON_ITS_WAY.lock().unwrap_or_else(PoisonError::into_inner).retain(|path| *path != self.0);
    }
}

/// Makes something that a signal removes; no signal comes between.
pub(super) fn marked<T: AsRef<Path>>(make: impl FnOnce() -> io::Result<T>) -> io::Result<(T, Mark)> {
    let mut all = ON_ITS_WAY.lock().unwrap_or_else(PoisonError::into_inner);
    let made = make()?;
    let path = made.as_ref().to_owned();
    all.push(path.clone());
    Ok((made, Mark(path)))
}

/// Does something that a first signal waits for.
pub(super) fn undisturbed<T>(act: impl FnOnce() -> T) -> T {
    let _all = ON_ITS_WAY.lock().unwrap_or_else(PoisonError::into_inner);
    act()
}

/// From now on SIGINT, SIGTERM and SIGHUP remove what is on its way before they end the program; the same one
/// again ends it at once. A signal that is ignored (`nohup`) stays ignored.
#[cfg(unix)]
pub fn remove_at_signals() -> io::Result<()> {
    unix::install()
}

/// Other systems have no such signals.
#[cfg(not(unix))]
pub fn remove_at_signals() -> io::Result<()> {
    Ok(())
}

#[cfg(unix)]
mod unix {
    use std::{
        fs, io,
        io::Read,
        os::fd::IntoRawFd,
        ptr,
        sync::PoisonError,
        sync::atomic::{AtomicI32, Ordering},
        thread,
    };

    use super::ON_ITS_WAY;

    /// Where the handler writes to.
    static PIPE: AtomicI32 = AtomicI32::new(-1);

    /// Tells the thread that waits. The system has put the default back: the next signal ends the program.
    extern "C" fn on_signal(signal: i32) {
        let byte = signal as u8;
        // SAFETY: writes one byte that lives to a pipe that is never closed; a signal handler may do that.
        // Nothing is lost with a full pipe: the first byte counts.
        unsafe { libc::write(PIPE.load(Ordering::Relaxed), (&raw const byte).cast(), 1) };
    }

    pub(super) fn install() -> io::Result<()> {
        let (mut reader, writer) = io::pipe()?;
        PIPE.store(writer.into_raw_fd(), Ordering::Relaxed);
        thread::Builder::new().name("signals".to_owned()).spawn(move || {
            let mut signal = [0];
            if reader.read_exact(&mut signal).is_ok() {
                end(i32::from(signal[0]));
            }
        })?;
        for signal in [libc::SIGINT, libc::SIGTERM, libc::SIGHUP] {
            // SAFETY: both records are whole; the handler does what a handler may do.
            unsafe {
                let mut before: libc::sigaction = std::mem::zeroed();
                libc::sigaction(signal, ptr::null(), &mut before);
                if before.sa_sigaction != libc::SIG_DFL {
                    continue;
                }
                let mut action: libc::sigaction = std::mem::zeroed();
                action.sa_sigaction = on_signal as *const () as usize;
                action.sa_flags = libc::SA_RESTART | libc::SA_RESETHAND;
                libc::sigaction(signal, &action, ptr::null_mut());
            }
        }
        Ok(())
    }

    /// Removes what is on its way, and ends as the signal would have.
    fn end(signal: i32) {
        // Held to the end: nothing new begins.
        let all = ON_ITS_WAY.lock().unwrap_or_else(PoisonError::into_inner);
        for path in all.iter() {
            // A folder is filled while it is removed, perhaps.
            let gone = |_: &i32| {
                let _ = fs::remove_file(path).or_else(|_| fs::remove_dir_all(path));
                fs::symlink_metadata(path).is_err()
            };
            (0..100).find(gone);
        }
        // SAFETY: sends a signal, whose default is in place again, to this process.
        unsafe { libc::kill(libc::getpid(), signal) };
        loop {
            thread::park();
        }
    }
}
