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
///
/// # Panics
/// When this program cannot be started once more.
pub fn run(test: &str, task: &str, limit: Duration) -> Ended {
    let mut child = Command::new(env::current_exe().expect("this program"))
        .args([test, "--exact", "--ignored", "--nocapture", "--test-threads", "1"])
        .env("REEF_TEST_TASK", task)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("this program starts once more");
    let (mut out, mut err) = (child.stdout.take().expect("a pipe"), child.stderr.take().expect("a pipe"));
    let read = |stream: &mut dyn Read| {
        let mut bytes = Vec::new();
        stream.read_to_end(&mut bytes).expect("the child's words");
        String::from_utf8_lossy(&bytes).into_owned()
    };
    let (out, err) = (thread::spawn(move || read(&mut out)), thread::spawn(move || read(&mut err)));
    let end = Instant::now() + limit;
    let status = loop {
        match child.try_wait().expect("the child") {
            Some(status) => break Some(status),
            None if Instant::now() > end => {
                child.kill().expect("the child is killed");
                child.wait().expect("the child");
                break None;
            }
            None => thread::sleep(Duration::from_millis(5)),
        }
    };
    Ended { status, text: out.join().expect("a reader") + &err.join().expect("a reader") }
}
