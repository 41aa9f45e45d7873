//! The last words of a program that ends by a signal of its own: which plugin's code ran last, and what is on
//! the disk. That plugin may have written over the program's memory: what is said lies in pages that nobody
//! can write to.

use std::{
    ptr,
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicBool, AtomicPtr, Ordering},
    },
};

use super::{
    describe, rescue,
    sealed::{Head, Sealed, Shown},
};

/// The names of plugins, or of libraries' files, each once and kept for ever: a library that is loaded again
/// brings no other.
static NAMES: Mutex<Vec<Sealed>> = Mutex::new(Vec::new());
static LAST: AtomicPtr<Head> = AtomicPtr::new(ptr::null_mut());

/// The kept name of a plugin; none where the system has no memory for it.
#[cold]
fn keep(plugin: &str) -> Option<Sealed> {
    let mut names = NAMES.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(name) = names.iter().find(|name| name.part(0) == plugin.as_bytes()) {
        return Some(*name);
    }
    let name = Sealed::new(&[plugin.as_bytes()])?;
    names.push(name);
    Some(name)
}

/// Whom a generation called last.
#[derive(Debug, Default)]
pub(crate) struct Called(AtomicPtr<Head>);

impl Called {
    /// The code of this plugin is about to run. Costs a comparison where it ran before.
    #[inline]
    pub(crate) fn enters(&self, plugin: &str) {
        let mut name = self.0.load(Ordering::Acquire);
        if !is(name, plugin) {
            let Some(kept) = keep(plugin) else { return };
            name = kept.as_ptr();
            self.0.store(name, Ordering::Release);
        }
        LAST.store(name, Ordering::Release);
    }
}

/// Is this the name of that plugin? NULL is none's.
fn is(name: *mut Head, plugin: &str) -> bool {
    // SAFETY: NULL, or a name that is kept for ever.
    unsafe { Sealed::from_ptr(name) }.is_some_and(|name| name.part(0) == plugin.as_bytes())
}

/// What is on the disk of a run's results, a sentence each with its number, and how many there were.
static SAVED: Mutex<(u64, Vec<(u64, String)>)> = Mutex::new((0, Vec::new()));
/// The same as one text.
static SAVED_TEXT: Shown = Shown::new();

/// A sentence in the last words of a program that ends in the middle: what it leaves on the disk. It is there
/// as long as this value.
#[derive(Debug)]
pub struct Noted(u64);

impl Noted {
    /// Adds a sentence.
    pub fn new(sentence: String) -> Self {
        let mut saved = SAVED.lock().unwrap_or_else(PoisonError::into_inner);
        saved.0 += 1;
        let number = saved.0;
        saved.1.push((number, sentence));
        show(&saved.1);
        Self(number)
    }
}

impl Drop for Noted {
    fn drop(&mut self) {
        let mut saved = SAVED.lock().unwrap_or_else(PoisonError::into_inner);
        saved.1.retain(|(number, _)| *number != self.0);
        show(&saved.1);
    }
}

fn show(sentences: &[(u64, String)]) {
    let text: String = sentences.iter().map(|(_, sentence)| format!("{sentence} ")).collect();
    SAVED_TEXT.replace(Sealed::new(&[text.as_bytes()]));
}

/// Naps of a thread whose fault came second, until the first has had its words, at most.
const NAPS: u32 = 500;
/// How long one is [ms].
const NAP: i32 = 10;

/// Writes the last state, and says once which plugin ran last, where one did. For a signal handler.
pub(super) fn say(signal: i32) {
    static BEGUN: AtomicBool = AtomicBool::new(false);
    static SAID: AtomicBool = AtomicBool::new(false);
    // SAFETY: NULL, or a name that is kept for ever.
    let Some(last) = (unsafe { Sealed::from_ptr(LAST.load(Ordering::Acquire)) }) else { return };
    if BEGUN.swap(true, Ordering::SeqCst) {
        for _ in (0..NAPS).take_while(|_| !SAID.load(Ordering::SeqCst)) {
            // SAFETY: waits for no file.
            unsafe { libc::poll(ptr::null_mut(), 0, NAP) };
        }
        return;
    }
    let write = |part: &[u8]| {
        // SAFETY: the bytes of a text. If nobody listens, nobody hears.
        unsafe { libc::write(libc::STDERR_FILENO, part.as_ptr().cast(), part.len()) };
    };
    for part in [
        b"reef: ",
        describe::name(signal).as_bytes(),
        b" in the host's own code; the last plugin that ran is `",
    ] {
        write(part);
    }
    write(last.part(0));
    write(b"`, which may have written over its memory. ");
    if let Some(saved) = SAVED_TEXT.look() {
        write(saved.part(0));
    }
    rescue::write(write);
    write(b"Files that were finished before are whole.\n");
    SAID.store(true, Ordering::SeqCst);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_saved_is_told_as_long_as_it_is_there() {
        // Nothing else in this program's tests notes anything.
        let told = || {
            let saved = SAVED.lock().unwrap_or_else(PoisonError::into_inner);
            saved.1.iter().map(|(_, sentence)| sentence.clone()).collect::<Vec<_>>()
        };
        let first = Noted::new("One.".to_owned());
        let second = Noted::new("Two.".to_owned());
        assert_eq!(told(), ["One.", "Two."]);
        drop(first);
        assert_eq!(told(), ["Two."]);
        drop(second);
        assert!(told().is_empty());
    }

    #[test]
    fn whoever_is_called_is_named_not_whoever_was_called_first() {
        let called = Called::default();
        for plugin in ["a.first", "a.second", "a.second", "a.first"] {
            called.enters(plugin);
            assert!(is(called.0.load(Ordering::Acquire), plugin), "{plugin}");
        }
        let names = NAMES.lock().unwrap_or_else(PoisonError::into_inner);
        assert_eq!(names.iter().filter(|name| name.part(0) == b"a.second").count(), 1);
    }
}
