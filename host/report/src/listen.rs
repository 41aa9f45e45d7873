//! Hearing what another process says, while it runs: one whose pipe is full waits for ever.

use std::{
    io::Read,
    sync::{
        Arc, Mutex, PoisonError,
        mpsc::{Receiver, Sender, channel},
    },
    thread,
};

/// How much is kept, of the end [bytes].
const KEPT: usize = 4096;
/// Characters of a line that are shown.
const SHOWN: usize = 300;

/// Reads a stream to its end, however long that may be, and keeps its last bytes; then the channel is closed.
pub fn listen(mut stream: impl Read + Send + 'static) -> (Arc<Mutex<Vec<u8>>>, Receiver<()>) {
    let kept: Arc<Mutex<Vec<u8>>> = Arc::default();
    let ours = kept.clone();
    let (open, end) = channel();
    // Nobody waits for this thread: something that escaped may hold the stream open.
    thread::spawn(move || {
        let _open: Sender<()> = open;
        let mut buffer = [0; KEPT];
        while let Ok(count @ 1..) = stream.read(&mut buffer) {
            let mut kept = ours.lock().unwrap_or_else(PoisonError::into_inner);
            kept.extend_from_slice(&buffer[..count]);
            let too_many = kept.len().saturating_sub(KEPT);
            kept.drain(..too_many);
        }
    });
    (kept, end)
}

/// The last lines that were said, `most` at most, fit to be shown.
pub fn last_lines(said: &[u8], most: usize) -> String {
    let text = String::from_utf8_lossy(said);
    let lines = text.lines().map(|line| {
        line.chars().filter(|c| !c.is_control()).take(SHOWN).collect::<String>().trim().to_owned()
    });
    let lines: Vec<String> = lines.filter(|line| !line.is_empty()).collect();
    lines[lines.len().saturating_sub(most)..].join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_words_are_told_without_controls_and_at_no_length() {
        assert_eq!(last_lines(b"  \r\n", 5), "");
        assert_eq!(last_lines(b"\x1b[31mred\x1b[0m\n", 5), "[31mred[0m");
        assert_eq!(last_lines(b"1\n2\n3\n4\n5\n6\n7\n", 5), "3\n4\n5\n6\n7");
        assert_eq!(last_lines(&[b'x'; 4096], 5).len(), SHOWN);
    }
}
