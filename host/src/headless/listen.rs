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

/// Reads a stream to its end, however long that may be, and keeps its last bytes; then the channel is closed.
pub(super) fn listen(mut stream: impl Read + Send + 'static) -> (Arc<Mutex<Vec<u8>>>, Receiver<()>) {
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
