//! The last words of a program that ends by a signal of its own: which plugin's code ran last. It may have
//! written over the program's memory, so this uses none that could be spoilt but a few words.

use std::{
    ptr,
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicBool, AtomicPtr, Ordering},
    },
};

use super::describe;

/// The name of a plugin, or of a library's file, kept for ever.
#[derive(Debug)]
struct Name(String);

/// Each name once: a library that is loaded again brings no other.
static NAMES: Mutex<Vec<&'static Name>> = Mutex::new(Vec::new());
static LAST: AtomicPtr<Name> = AtomicPtr::new(ptr::null_mut());

/// The kept name of a plugin.
#[cold]
fn keep(plugin: &str) -> &'static Name {
    let mut names = NAMES.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(name) = names.iter().find(|name| name.0 == plugin) {
        return name;
    }
    let name: &'static Name = Box::leak(Box::new(Name(plugin.to_owned())));
    names.push(name);
    name
}

/// Whom a generation called last.
#[derive(Debug, Default)]
pub(crate) struct Called(AtomicPtr<Name>);

impl Called {
    /// The code of this plugin is about to run. Costs a comparison where it ran before.
    #[inline]
    pub(crate) fn enters(&self, plugin: &str) {
        let mut name = self.0.load(Ordering::Acquire);
        if !is(name, plugin) {
            name = ptr::from_ref(keep(plugin)).cast_mut();
            self.0.store(name, Ordering::Release);
        }
        LAST.store(name, Ordering::Release);
    }
}

/// Is this the name of that plugin? NULL is none's.
fn is(name: *const Name, plugin: &str) -> bool {
    // SAFETY: NULL, or a name that is kept for ever.
    unsafe { name.as_ref() }.is_some_and(|name| name.0 == plugin)
}

/// What is on the disk of a run's results, by whose they are, and the same as one text that is kept for ever.
static SAVED: Mutex<Vec<(&'static str, String)>> = Mutex::new(Vec::new());
static SAVED_TEXT: AtomicPtr<String> = AtomicPtr::new(ptr::null_mut());

/// Notes what is on the disk of a run that ends in the middle, as a sentence: it is in the last words.
/// `whose` tells apart what replaces one another.
pub fn note_saved(whose: &'static str, sentence: String) {
    let mut all = SAVED.lock().unwrap_or_else(PoisonError::into_inner);
    all.retain(|(known, _)| *known != whose);
    all.push((whose, sentence));
    let text: String = all.iter().map(|(_, sentence)| format!("{sentence} ")).collect();
    // Leaked: a signal handler may be reading the one before.
    SAVED_TEXT.store(Box::into_raw(Box::new(text)), Ordering::Release);
}

/// Says once which plugin ran last, where one did. For a signal handler.
pub(super) fn say(signal: i32) {
    static SAID: AtomicBool = AtomicBool::new(false);
    let last = LAST.load(Ordering::Acquire);
    if last.is_null() || SAID.swap(true, Ordering::Relaxed) {
        return;
    }
    // SAFETY: a name that is kept for ever.
    let name = unsafe { &(*last).0 };
    // SAFETY: NULL, or a text that is kept for ever.
    let saved = unsafe { SAVED_TEXT.load(Ordering::Acquire).as_ref() };
    for part in [
        "reef: ",
        describe::name(signal),
        " in the host's own code; the last plugin that ran is `",
        name,
        "`, which may have written over its memory. ",
        saved.map_or("", String::as_str),
        "Files that were finished before are whole.\n",
    ] {
        // SAFETY: the bytes of a text. If nobody listens, nobody hears.
        unsafe { libc::write(libc::STDERR_FILENO, part.as_ptr().cast(), part.len()) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whoever_is_called_is_named_not_whoever_was_called_first() {
        let called = Called::default();
        for plugin in ["a.first", "a.second", "a.second", "a.first"] {
            called.enters(plugin);
            assert!(is(called.0.load(Ordering::Acquire), plugin), "{plugin}");
        }
        let names = NAMES.lock().unwrap_or_else(PoisonError::into_inner);
        assert_eq!(names.iter().filter(|name| name.0 == "a.second").count(), 1);
    }
}
