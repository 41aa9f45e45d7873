//! Builds that were tried, by the hash of what a program can see of them: a file each, with the ids of its
//! plugins, or with the fault that was seen.

use std::{
    fs,
    path::Path,
    sync::atomic::{AtomicU32, Ordering},
    time::SystemTime,
};

use reef_abi as abi;
use reef_files::{bounded, cache};

use crate::image::Image;

/// Builds that are noted; of more the oldest are forgotten.
const MOST: usize = 512;
/// A note is no longer than this [bytes].
const LONGEST: u64 = 1 << 16;
/// Of a reason as much is noted [bytes].
const REASON: usize = 1 << 12;

/// The hash of a build, as this version of the host sees it.
pub(super) fn hash(image: &Image<'_>) -> String {
    let mut hasher = blake3::Hasher::new();
    hasher.update(env!("CARGO_PKG_VERSION").as_bytes());
    hasher.update(&abi::HEADER_HASH.to_le_bytes());
    hasher.update(&image.length().to_le_bytes());
    for (start, bytes) in image.parts() {
        hasher.update(&start.to_le_bytes());
        hasher.update(&(bytes.len() as u64).to_le_bytes());
        hasher.update(bytes);
    }
    hasher.finalize().to_hex().to_string()
}

/// What a note says of a build.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Note {
    /// It was loaded without a fault: the ids of its plugins.
    Sound(Vec<String>),
    /// Its code was at fault in the process that loaded it: how.
    Bad(String),
}

/// What a line of a bad build begins with; no id does.
const BAD: &str = "! ";

/// What is known of a build.
pub(super) fn recall(folder: &Path, hash: &str) -> Option<Note> {
    let text = bounded::read_text(&folder.join(hash), LONGEST).ok()?;
    let mut lines = text.lines();
    // A note that was cut has no end.
    if lines.next_back()? != "end" {
        return None;
    }
    Some(match text.lines().next().and_then(|first| first.strip_prefix(BAD)) {
        Some(reason) => Note::Bad(reason.to_owned()),
        None => Note::Sound(lines.map(str::to_owned).collect()),
    })
}

/// Notes a build. One that cannot be noted is tried again.
pub(super) fn remember(folder: &Path, hash: &str, note: &Note) {
    let text = match note {
        Note::Sound(plugins) => plugins.iter().map(|id| format!("{id}\n")).collect(),
        Note::Bad(reason) => {
            let reason = &reason[..reason.floor_char_boundary(REASON)];
            format!("{BAD}{}\n", reason.replace(['\n', '\r'], " "))
        }
    } + "end\n";
    if text.len() as u64 > LONGEST {
        return; // More ids than anybody gives: it is tried again.
    }
    match cache::keep(&folder.join(hash), text.as_bytes()) {
        Ok(()) => forget(folder),
        Err(error) => tracing::debug!("{}: known builds are not noted: {error}", folder.display()),
    }
}

/// Forgets the oldest where there are many; looks for that now and then.
fn forget(folder: &Path) {
    const EACH: u32 = 64;
    static NOTED: AtomicU32 = AtomicU32::new(0);
    if !NOTED.fetch_add(1, Ordering::Relaxed).is_multiple_of(EACH) {
        return;
    }
    forget_now(folder);
}

fn forget_now(folder: &Path) {
    let entries: Vec<_> = fs::read_dir(folder).into_iter().flatten().flatten().collect();
    if entries.len() <= MOST {
        return;
    }
    let time = |entry: &fs::DirEntry| entry.metadata().and_then(|data| data.modified());
    let mut entries: Vec<(SystemTime, _)> =
        entries.iter().filter_map(|entry| Some((time(entry).ok()?, entry.path()))).collect();
    entries.sort();
    for (_, path) in entries.iter().take(entries.len().saturating_sub(MOST / 2)) {
        // Another run may have done it.
        let _ = fs::remove_file(path);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_noted_is_recalled_and_half_a_note_is_none() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path().join("plugins");
        assert_eq!(recall(&folder, "a"), None);
        for note in [
            Note::Sound(vec!["x.y".to_owned(), "x.z".to_owned()]),
            Note::Sound(Vec::new()),
            Note::Bad("it was ended by signal 11".to_owned()),
        ] {
            remember(&folder, "a", &note);
            assert_eq!(recall(&folder, "a"), Some(note));
        }
        let reason = format!("{}é of {}", "x".repeat(REASON - 1), "y".repeat(LONGEST as usize));
        remember(&folder, "a", &Note::Bad(reason));
        assert_eq!(recall(&folder, "a"), Some(Note::Bad("x".repeat(REASON - 1))));
        fs::write(folder.join("b"), "x.y\nx").unwrap();
        assert_eq!(recall(&folder, "b"), None);
    }

    #[test]
    fn the_oldest_of_many_are_forgotten() {
        let folder = tempfile::tempdir().unwrap();
        for number in 0..MOST {
            fs::write(folder.path().join(number.to_string()), "end\n").unwrap();
        }
        remember(folder.path(), "new", &Note::Sound(Vec::new()));
        forget_now(folder.path());
        assert!(fs::read_dir(folder.path()).unwrap().count() <= MOST / 2);
        assert_eq!(recall(folder.path(), "new"), Some(Note::Sound(Vec::new())));
    }

    #[test]
    fn a_hash_is_of_the_whole_content() {
        let hash = |bytes: &[u8]| hash(&Image::whole(bytes));
        assert_eq!(hash(b"abc"), hash(b"abc"));
        assert!(hash(b"abc") != hash(b"abd") && hash(b"abc") != hash(b"abc\0"));
    }
}
