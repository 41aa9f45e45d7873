//! A state of the whole sea that a program puts on the disk when it ends by a signal of its own. It is made
//! up beforehand: nothing is left to do but to write it.

use std::{ffi::CString, os::unix::ffi::OsStrExt, path::Path};

use super::sealed::{Sealed, Shown};

static STATE: Shown = Shown::new();
/// Its parts: the path of the file on its way, that of the whole one, what the state is, the state.
const PART: usize = 0;
const PLACE: usize = 1;
const WHAT: usize = 2;
const BYTES: usize = 3;

/// Last words write the state that is kept.
pub const KEEPS_STATES: bool = true;

/// Keeps the bytes of a state, which the file `path` gets should the program end by a fault that no guard
/// contains; its last words then say that `what` is there. The next state takes this one's place.
pub fn keep_state(path: &Path, what: &str, bytes: &[u8]) {
    let path = path.as_os_str().as_bytes();
    let part = [path, format!(".{}.part", std::process::id()).as_bytes()].concat();
    // A path with a zero leads nowhere.
    let (Ok(part), Ok(place)) = (CString::new(part), CString::new(path)) else { return };
    let parts = [part.as_bytes_with_nul(), place.as_bytes_with_nul(), what.as_bytes(), bytes];
    STATE.replace(Sealed::new(&parts));
}

/// Nothing is kept any more.
pub fn forget_state() {
    STATE.replace(None);
}

/// Writes the state, whole or not at all, and says what became of it. For a signal handler.
pub(super) fn write(say: impl Fn(&[u8])) {
    let Some(state) = STATE.look() else { return };
    let written = put(&state);
    say(state.part(WHAT));
    say(if written { b" is in " } else { b" could not be written to " });
    let place = state.part(PLACE);
    say(&place[..place.len() - 1]);
    say(b". ");
}

fn put(state: &Sealed) -> bool {
    let [part, place] = [PART, PLACE].map(|at| state.part(at).as_ptr().cast::<libc::c_char>());
    let flags = libc::O_WRONLY | libc::O_CREAT | libc::O_TRUNC | libc::O_CLOEXEC;
    // SAFETY: both paths end with a zero; the bytes are there; a signal handler may do all of this.
    unsafe {
        let file = libc::open(part, flags | libc::O_NOFOLLOW, 0o600);
        if file < 0 {
            return false;
        }
        let mut rest = state.part(BYTES);
        while !rest.is_empty() {
            let written = libc::write(file, rest.as_ptr().cast(), rest.len());
            if written < 0 && *libc::__errno_location() == libc::EINTR {
                continue;
            }
            match usize::try_from(written) {
                Ok(written) if written > 0 => rest = &rest[written..],
                _ => break,
            }
        }
        let whole = rest.is_empty() && libc::fsync(file) == 0;
        let put = libc::close(file) == 0 && whole && libc::rename(part, place) == 0;
        if !put {
            libc::unlink(part);
        }
        put
    }
}

#[cfg(test)]
mod tests {
    use std::{cell::RefCell, fs};

    use super::*;

    fn told() -> String {
        let said = RefCell::new(Vec::new());
        write(|part| said.borrow_mut().extend_from_slice(part));
        String::from_utf8(said.into_inner()).expect("text")
    }

    #[test]
    fn the_last_state_is_written_whole_and_told_or_leaves_nothing() {
        let folder = tempfile::tempdir().expect("a folder");
        let names = || fs::read_dir(folder.path()).expect("listed").count();
        let path = folder.path().join("run.last");
        let bytes: Vec<u8> = (0..300_000).map(|number| number as u8).collect();
        assert_eq!(told(), "");
        keep_state(&path, "The sea at step 1", &bytes[..7]);
        keep_state(&path, "The sea at step 2", &bytes);
        assert_eq!(told(), format!("The sea at step 2 is in {}. ", path.display()));
        assert!(fs::read(&path).expect("written") == bytes && names() == 1);
        let nowhere = folder.path().join("none/run.last");
        keep_state(&nowhere, "The sea at step 3", &bytes);
        assert_eq!(told(), format!("The sea at step 3 could not be written to {}. ", nowhere.display()));
        // A folder that is in the way stays, and no part does.
        fs::create_dir(folder.path().join("taken")).expect("made");
        keep_state(&folder.path().join("taken"), "It", b"1");
        assert!(told().starts_with("It could not be written"));
        assert_eq!(names(), 2);
        forget_state();
        assert_eq!(told(), "");
    }
}
