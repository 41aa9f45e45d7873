//! Tests that need a process of their own: this very program again, with one ignored test.

use std::{
    env,
    io::Read,
    process::{Command, ExitStatus, Stdio},
    thread,
    time::{Duration, Instant},
};

/// How a child ended.
#[derive(Debug)]
pub struct Ended {
    /// None: it was still running at the time limit, and was killed.
    pub status: Option<ExitStatus>,
    /// What it printed, on both streams.
    pub text: String,
}

/// What the parent told this child to do; None: somebody asked for ignored tests by hand.
pub fn task() -> Option<String> {
    env::var("REEF_TEST_TASK").ok()
}

/// Runs the ignored test with this path in a process of its own.
pub fn run(test: &str, task: &str, limit: Duration) -> Ended {
    let mut child = Command::new(env::current_exe().unwrap())
        .args([test, "--exact", "--ignored", "--nocapture", "--test-threads", "1"])
        .env("REEF_TEST_TASK", task)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let (mut out, mut err) = (child.stdout.take().unwrap(), child.stderr.take().unwrap());
    let read = |stream: &mut dyn Read| {
        let mut bytes = Vec::new();
        stream.read_to_end(&mut bytes).unwrap();
        String::from_utf8_lossy(&bytes).into_owned()
    };
    let (out, err) = (thread::spawn(move || read(&mut out)), thread::spawn(move || read(&mut err)));
    let end = Instant::now() + limit;
    let status = loop {
        match child.try_wait().unwrap() {
            Some(status) => break Some(status),
            None if Instant::now() > end => {
                child.kill().unwrap();
                child.wait().unwrap();
                break None;
            }
            None => thread::sleep(Duration::from_millis(5)),
        }
    };
    Ended { status, text: out.join().unwrap() + &err.join().unwrap() }
}
