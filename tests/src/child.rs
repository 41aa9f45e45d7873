//! Processes that tests start: this very program again, with one ignored test, and any other that has to end.

use std::{
    env,
    io::Read,
    process::{Child, Command, ExitStatus, Output, Stdio},
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

/// Waits for a process to end by itself.
///
/// # Panics
/// When it is still running after `limit`; then it is killed.
pub fn wait(mut child: Child, limit: Duration, what: &str) -> Output {
    let end = Instant::now() + limit;
    loop {
        match child.try_wait() {
            Ok(Some(_)) => break,
            Ok(None) if Instant::now() < end => thread::sleep(Duration::from_millis(10)),
            _ => {
                let _ = child.kill();
                let output = child.wait_with_output();
                panic!("{what} did not end within {limit:?}: {output:?}");
            }
        }
    }
    child.wait_with_output().unwrap_or_else(|error| panic!("{what}: {error}"))
}
