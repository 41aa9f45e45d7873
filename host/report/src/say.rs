//! Answers on standard output, and how far a command has come on standard error.

use std::{
    io::Write,
    path::Path,
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
};

use crate::{
    failure::{Failure, Outcome},
    plain::Plain,
};

/// What standard output did not take.
static UNSAID: Mutex<Option<std::io::Error>> = Mutex::new(None);

/// The reader of standard output went away.
static IS_ALONE: AtomicBool = AtomicBool::new(false);

/// One line on standard output, without the control characters of others. A reader that went away is no
/// error: whoever wanted more would have stayed. Anything else (a full disk) is told by [`all_said`].
pub fn say(line: impl std::fmt::Display) {
    match writeln!(std::io::stdout().lock(), "{}", Plain(line)) {
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => {
            IS_ALONE.store(true, Ordering::Relaxed);
        }
        Err(error) => {
            *UNSAID.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
        }
        Ok(()) => {}
    }
}

/// Is anybody there to read what is said? Without a reader, work that is done for its words alone ends.
pub fn is_heard() -> bool {
    !IS_ALONE.load(Ordering::Relaxed)
}

/// Fails when something that a command said got lost.
pub fn all_said() -> Outcome {
    match UNSAID.lock().unwrap_or_else(PoisonError::into_inner).take() {
        None => Ok(()),
        Some(error) => Err(Failure::machine(miette::miette!("standard output cannot be written: {error}"))),
    }
}

/// A path in an answer that is JSON, which has no bytes but those of UTF-8: what is none is shown as a
/// replacement character.
pub fn shown(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}

/// A progress bar on standard error; nothing where that is no terminal, or nobody would have to wait for it.
pub fn progress(length: u64, what: &'static str, wanted: bool) -> indicatif::ProgressBar {
    if !wanted {
        return indicatif::ProgressBar::hidden();
    }
    let bar = indicatif::ProgressBar::new(length);
    let style = indicatif::ProgressStyle::with_template("{prefix} {bar:32} {pos}/{len} {eta} left");
    if let Ok(style) = style {
        bar.set_style(style);
    }
    bar.set_prefix(what);
    bar
}
