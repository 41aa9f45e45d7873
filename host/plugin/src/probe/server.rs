//! The process that tries builds, as this one sees it: it waits for paths, and answers each with a verdict.

use std::{
    io::{self, BufRead, BufReader, Write},
    os::unix::{ffi::OsStrExt, process::CommandExt},
    path::Path,
    process::{Child, ChildStdin, ChildStdout, Command, Stdio},
    sync::{Mutex, MutexGuard, OnceLock, PoisonError},
};

use super::{Probe, Verdict};

/// What a request begins with: the library is loaded, opened and described; or the system's loader opens it,
/// and no more.
pub(super) const LOAD: u8 = b'l';
pub(super) const GLANCE: u8 = b'g';

static OFFERED: OnceLock<Probe> = OnceLock::new();
static SERVER: Mutex<Option<Server>> = Mutex::new(None);

/// The process, as long as this value lives.
struct Server {
    child: Child,
    /// None only while it ends.
    paths: Option<ChildStdin>,
    answers: BufReader<ChildStdout>,
}

pub(super) fn offer(probe: Probe) {
    // The first word counts.
    let _ = OFFERED.set(probe);
}

pub(super) fn offered() -> Option<&'static Probe> {
    OFFERED.get()
}

fn server() -> MutexGuard<'static, Option<Server>> {
    SERVER.lock().unwrap_or_else(PoisonError::into_inner)
}

pub(super) fn prepare() {
    if let Some(probe) = offered() {
        let mut server = server();
        if server.is_none() {
            *server = Server::start(probe).ok();
        }
    }
}

pub(super) fn rest() {
    *server() = None;
}

/// What the process says of a build; None: there is none, and nobody can be asked.
pub(super) fn ask(probe: &Probe, what: u8, path: &Path) -> Option<Verdict> {
    let mut server = server();
    let asked = match &mut *server {
        Some(running) => running.ask(what, path),
        None => Server::start(probe).and_then(|started| server.insert(started).ask(what, path)),
    };
    asked
        .inspect_err(|error| {
            tracing::debug!("{}: nobody tries it before it is loaded: {error}", path.display());
            *server = None;
        })
        .ok()
}

impl Server {
    fn start(probe: &Probe) -> io::Result<Self> {
        let patience = probe.patience.map(|patience| patience.as_secs_f64().to_string());
        let mut child = Command::new(&probe.program)
            .args(["plugin", "probe"])
            .args(patience.iter().flat_map(|seconds| ["--patience", seconds]))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            // A key that ends this program is no word to that one, which ends when nobody asks any more.
            .process_group(0)
            .spawn()?;
        let (paths, answers) = (child.stdin.take(), child.stdout.take());
        let answers = answers.ok_or(io::ErrorKind::BrokenPipe)?;
        Ok(Self { child, paths, answers: BufReader::new(answers) })
    }

    fn ask(&mut self, what: u8, path: &Path) -> io::Result<Verdict> {
        let paths = self.paths.as_mut().ok_or(io::ErrorKind::BrokenPipe)?;
        let path = std::path::absolute(path)?;
        paths.write_all(&[&[what], path.as_os_str().as_bytes(), &[0]].concat())?;
        paths.flush()?;
        let mut line = String::new();
        self.answers.read_line(&mut line)?;
        Ok(serde_json::from_str(&line)?)
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // Nobody asks any more: it ends by itself.
        self.paths = None;
        let _ = self.child.wait();
    }
}
