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

/// A plugin's name, kept for ever.
#[derive(Debug)]
pub(crate) struct Name(String);

/// Each name once: a library that is loaded again brings no other.
static NAMES: Mutex<Vec<&'static Name>> = Mutex::new(Vec::new());
static LAST: AtomicPtr<Name> = AtomicPtr::new(ptr::null_mut());

/// The kept name of a plugin.
pub(crate) fn keep(plugin: &str) -> &'static Name {
    let mut names = NAMES.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(name) = names.iter().find(|name| name.0 == plugin) {
        return name;
    }
    let name: &'static Name = Box::leak(Box::new(Name(plugin.to_owned())));
    names.push(name);
    name
}

/// This plugin's code is about to run.
#[inline]
pub(crate) fn enters(name: &'static Name) {
    LAST.store(ptr::from_ref(name).cast_mut(), Ordering::Relaxed);
}

/// Says once which plugin ran last, where one did. For a signal handler.
pub(super) fn say(signal: i32) {
    static SAID: AtomicBool = AtomicBool::new(false);
    let last = LAST.load(Ordering::Relaxed);
    if last.is_null() || SAID.swap(true, Ordering::Relaxed) {
        return;
    }
    // SAFETY: a name that is kept for ever.
    let name = unsafe { &(*last).0 };
    for part in [
        "reef: ",
        describe::name(signal),
        " in the host's own code; the last plugin that ran is `",
        name,
        "`, which may have written over its memory. Files that were finished before are whole.\n",
    ] {
        // SAFETY: the bytes of a text. If nobody listens, nobody hears.
        unsafe { libc::write(libc::STDERR_FILENO, part.as_ptr().cast(), part.len()) };
    }
}
