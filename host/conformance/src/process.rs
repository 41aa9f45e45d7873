//! One check in a process of its own. Whatever happens there — a crash, a hang, children, garbage on its
//! outputs — becomes a verdict here.

use std::{
    collections::HashSet,
    ffi::OsString,
    fs,
    os::unix::process::{CommandExt, ExitStatusExt},
    path::{Path, PathBuf},
    process::{Command, ExitStatus, Stdio},
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicU64, Ordering},
        mpsc::RecvTimeoutError,
    },
    thread,
    time::{Duration, Instant},
};

use reef_command::Common;
use reef_files::InOrder;
use reef_report::{
    failure::Failure,
    listen::{last_lines, listen},
};
use tempfile::TempDir;

use super::{Args, group, limit, verdict::Verdict};

/// Without each thread's store of freed memory, the C library knows how much of its heap is in use, to the
/// byte.
const EXACT_HEAP: &str = "glibc.malloc.tcache_count=0";

/// How checks are run.
pub(super) struct Conduct {
    program: PathBuf,
    path: PathBuf,
    arguments: Vec<OsString>,
    limit: Duration,
    /// Verdicts go here.
    folder: TempDir,
    runs: AtomicU64,
    /// Processes of checks that run. Locked while one is started.
    running: Mutex<HashSet<u32>>,
    /// Asked for an end, no check goes on, and those that were made are told.
    in_order: InOrder,
}

impl Conduct {
    /// For this library and these options.
    pub(super) fn new(common: &Common, args: &Args, path: &Path) -> Result<Self, Failure> {
        let lacks = |what: &str, error: &std::io::Error| Failure::machine(miette::miette!("{what}: {error}"));
        let program = reef_files::program().map_err(|error| lacks("this program cannot be found", &error))?;
        let path = fs::canonicalize(path)
            .map_err(|error| Failure::input(miette::miette!("{}: {error}", path.display())))?;
        let folder =
            tempfile::tempdir().map_err(|error| lacks("no folder for verdicts (set TMPDIR)", &error))?;
        let mut arguments: Vec<OsString> = ["--timeout".into(), args.timeout.to_string().into()].into();
        if let Some(config) = &args.config {
            arguments.extend(["--config".into(), config.into()]);
        }
        if let Some(assets) = &common.assets {
            arguments.extend(["--assets".into(), assets.into()]);
        }
        group::adopt_orphans();
        Ok(Self {
            program,
            path,
            arguments,
            limit: limit(args),
            folder,
            runs: AtomicU64::new(0),
            running: Mutex::default(),
            in_order: reef_files::in_order(),
        })
    }

    /// What becomes of a check when the program is asked to end.
    fn ended(&self) -> Option<Verdict> {
        Some(Verdict::Skipped(format!("ended by {}", self.in_order.asked()?)))
    }

    /// Runs one check.
    pub(super) fn run(&self, check: &str, plugin: Option<&str>) -> Verdict {
        if let Some(ended) = self.ended() {
            return ended;
        }
        let number = self.runs.fetch_add(1, Ordering::Relaxed);
        let verdict = self.folder.path().join(format!("{number}-{check}"));
        let mut command = Command::new(&self.program);
        command.args(["plugin", "check"]).arg(&self.path).args(["--only", check]).args(&self.arguments);
        if let Some(plugin) = plugin {
            command.args(["--plugin", plugin]);
        }
        command.arg("--verdict").arg(&verdict).env("GLIBC_TUNABLES", EXACT_HEAP);
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped()).process_group(0);
        let mut running = self.running.lock().unwrap_or_else(PoisonError::into_inner);
        let mut child = match command.spawn() {
            Ok(child) => child,
            Err(error) => return Verdict::Failed(format!("its process could not be started: {error}")),
        };
        running.insert(child.id());
        drop(running);
        let (said, mut open) = child.stderr.take().map(listen).unzip();
        let end = Instant::now() + self.limit;
        let mut pause = Duration::from_micros(500);
        let in_time = loop {
            if group::has_ended(child.id()) {
                break true;
            }
            if Instant::now() > end || self.in_order.asked().is_some() {
                break false;
            }
            // Who ends closes what it says: that is heard at once.
            match &open {
                Some(stream) if stream.recv_timeout(pause) == Err(RecvTimeoutError::Disconnected) => {
                    open = None;
                    pause = Duration::from_micros(50);
                }
                Some(_) => {}
                None => thread::sleep(pause),
            }
            pause = (pause * 2).min(Duration::from_millis(10));
        };
        // Before it is reaped, lest its number be somebody else's by then.
        group::kill(child.id());
        let status = child.wait();
        let mut running = self.running.lock().unwrap_or_else(PoisonError::into_inner);
        running.remove(&child.id());
        group::kill_orphans(&running);
        drop(running);
        if !in_time {
            if let Some(ended) = self.ended() {
                return ended;
            }
            return Verdict::Failed(format!(
                "it did not end within {} s, and was killed",
                self.limit.as_secs_f64()
            ));
        }
        let written = fs::read(&verdict).ok().and_then(|bytes| serde_json::from_slice(&bytes).ok());
        written.unwrap_or_else(|| {
            let how = status.map_or_else(|error| error.to_string(), how);
            Verdict::Failed(format!(
                "its process {how} before the check was over{}",
                last_words(&said.unwrap_or_default())
            ))
        })
    }
}

/// How a process ended.
fn how(status: ExitStatus) -> String {
    match (status.signal(), status.code()) {
        (Some(signal), _) => format!("was ended by signal {signal}"),
        (None, Some(code)) => format!("ended itself with exit code {code}"),
        (None, None) => "ended".to_owned(),
    }
}

/// The last line that was said.
fn last_words(said: &Mutex<Vec<u8>>) -> String {
    // What was written before the end may be on its way still.
    thread::sleep(Duration::from_millis(5));
    let line = last_lines(&said.lock().unwrap_or_else(PoisonError::into_inner), 1);
    if line.is_empty() { line } else { format!("; it said: {line}") }
}
