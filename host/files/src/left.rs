//! What is on its way: it must not stay when the program is told to end in the middle.

use std::{
    io,
    path::{Path, PathBuf},
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicI32, AtomicUsize, Ordering},
    },
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

/// From now on SIGINT, SIGTERM and SIGHUP remove what is on its way before they end the program; where a
/// command [ends in order](in_order), the first one asks for that, and the next one does so. One more ends it
/// at once. A signal that is ignored (`nohup`) stays ignored.
pub fn remove_at_signals() -> io::Result<()> {
    #[cfg(unix)]
    unix::install()?;
    Ok(())
}

/// Commands that end in order when they are asked to.
static IN_ORDER: AtomicUsize = AtomicUsize::new(0);
/// The signal that asked; 0: none did.
static ASKED: AtomicI32 = AtomicI32::new(0);

/// While it lives, a first signal only asks for an end.
#[derive(Debug)]
pub struct InOrder(());

/// A command that looks at [`InOrder::asked`] often, and then ends by itself.
pub fn in_order() -> InOrder {
    IN_ORDER.fetch_add(1, Ordering::SeqCst);
    InOrder(())
}

impl InOrder {
    /// The name of the signal that asked for an end.
    pub fn asked(&self) -> Option<&'static str> {
        match ASKED.load(Ordering::Relaxed) {
            0 => None,
            #[cfg(unix)]
            libc::SIGINT => Some("SIGINT"),
            #[cfg(unix)]
            libc::SIGHUP => Some("SIGHUP"),
            _ => Some("SIGTERM"),
        }
    }
}

impl Drop for InOrder {
    fn drop(&mut self) {
        IN_ORDER.fetch_sub(1, Ordering::SeqCst);
    }
}

/// Ends a program that was asked to end, and has done all in order, as the signal would have; returns where
/// none asked.
pub fn end_as_asked() {
    #[cfg(unix)]
    match ASKED.load(Ordering::Relaxed) {
        0 => {}
        signal => unix::end(signal),
    }
}

#[cfg(unix)]
mod unix {
    use std::{
        fs, io,
        io::Read,
        os::fd::IntoRawFd,
        ptr,
        sync::PoisonError,
        sync::atomic::{AtomicI32, AtomicUsize, Ordering},
        thread,
    };

    use super::{ASKED, IN_ORDER, ON_ITS_WAY};

    /// Where the handler writes to.
    static PIPE: AtomicI32 = AtomicI32::new(-1);
    /// Signals that came.
    static CAME: AtomicUsize = AtomicUsize::new(0);

    /// Tells the thread that waits; one signal too many ends the program.
    extern "C" fn on_signal(signal: i32) {
        let byte = signal as u8;
        let patience = if IN_ORDER.load(Ordering::SeqCst) > 0 { 2 } else { 1 };
        if CAME.fetch_add(1, Ordering::SeqCst) < patience {
            // SAFETY: writes one byte that lives to a pipe that is never closed; a signal handler may do
            // that. Nothing is lost with a full pipe: the first bytes count.
            unsafe { libc::write(PIPE.load(Ordering::Relaxed), (&raw const byte).cast(), 1) };
        } else {
            // SAFETY: a signal handler may do both.
            unsafe { kill(signal) };
        }
    }

    /// Ends the program by a signal's default.
    ///
    /// # Safety
    /// Nobody needs the signal's handler any more.
    unsafe fn kill(signal: i32) {
        // SAFETY: plain calls; the caller vouches for the handler.
        unsafe {
            libc::signal(signal, libc::SIG_DFL);
            libc::kill(libc::getpid(), signal);
        }
    }

    pub(super) fn install() -> io::Result<()> {
        let (mut reader, writer) = io::pipe()?;
        PIPE.store(writer.into_raw_fd(), Ordering::Relaxed);
        thread::Builder::new().name("signals".to_owned()).spawn(move || {
            let mut byte = [0];
            while reader.read_exact(&mut byte).is_ok() {
                let signal = i32::from(byte[0]);
                if IN_ORDER.load(Ordering::SeqCst) == 0 || ASKED.swap(signal, Ordering::SeqCst) != 0 {
                    end(signal);
                }
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
                action.sa_flags = libc::SA_RESTART;
                libc::sigaction(signal, &action, ptr::null_mut());
            }
        }
        Ok(())
    }

    /// Removes what is on its way, and ends as the signal would have.
    pub(super) fn end(signal: i32) -> ! {
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
        // SAFETY: the program ends here.
        unsafe { kill(signal) };
        loop {
            thread::park();
        }
    }
}
