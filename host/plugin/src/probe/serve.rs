//! The process that tries builds, from inside: for each path a child of its own loads the library and says
//! what is in it. A child is bounded in time and memory, and whatever becomes of it is a verdict.

use std::{
    ffi::OsStr,
    fs::File,
    io::{self, BufRead, Read, Write},
    os::{
        fd::{AsRawFd, FromRawFd, OwnedFd},
        unix::ffi::OsStrExt,
    },
    path::Path,
    time::{Duration, Instant},
};

use super::{Verdict, known, server};
use crate::{
    error::Refusal,
    guard::{Limits, limits},
    inspect,
    library::Library,
};

/// How long a child may take, in limits of a call, of which it makes several: its own watchdog stops a
/// library's code long before.
const LIMITS: u32 = 20;
/// The processor time that it may use, in the same.
const PROCESSOR: u32 = 10;
/// A limit, where calls have none.
const LONG: Duration = Duration::from_secs(24 * 3600);
/// The most memory that it may map [bytes].
const MEMORY: u64 = 16 << 30;
/// What an answer ends with.
const END: u8 = b'\n';
/// An answer is no longer than this [bytes].
const LONGEST: u64 = 1 << 20;

/// Answers for each path on standard input, which ends with NUL, until there are no more. Never returns. The
/// process has no other threads.
pub fn serve() -> ! {
    let mut paths = io::stdin().lock();
    let mut answers = io::stdout();
    let mut path = Vec::new();
    while paths.read_until(0, &mut path).is_ok_and(|length| length > 0) {
        path.pop();
        let (what, name) = path.split_first().unwrap_or((&server::LOAD, &[]));
        let mut tell = |verdict: &Verdict| {
            let line = serde_json::to_string(verdict).unwrap_or_default();
            writeln!(answers, "{line}").and_then(|()| answers.flush()).is_ok()
        };
        if !try_apart(*what, Path::new(OsStr::from_bytes(name)), &mut tell) {
            break;
        }
        path.clear();
    }
    // SAFETY: nothing is left to be done.
    unsafe { libc::_exit(0) }
}

/// How long one call of a library may take.
fn limit() -> Duration {
    let limit = limits().other;
    if limit.is_zero() { LONG } else { limit.clamp(Limits::default().other, LONG) }
}

fn refused(reason: String) -> Verdict {
    Verdict { refused: Some(reason), ..Verdict::default() }
}

/// Loads the library in a child, and tells what came of it. False: nobody listens any more.
fn try_apart(what: u8, path: &Path, tell: &mut dyn FnMut(&Verdict) -> bool) -> bool {
    let [answer, told] = match pipe() {
        Ok(ends) => ends,
        Err(error) => return tell(&refused(format!("it cannot be tried: {error}"))),
    };
    // SAFETY: this process has one thread, so the child may do whatever it could do.
    match unsafe { libc::fork() } {
        -1 => tell(&refused(format!("it cannot be tried: {}", io::Error::last_os_error()))),
        0 => {
            drop(answer);
            bound();
            let verdict = if what == server::GLANCE { glance(path) } else { load(path) };
            say(&verdict, File::from(told))
        }
        child => {
            drop(told);
            let said = listen(File::from(answer));
            let verdict = said.as_deref().and_then(|said| serde_json::from_slice(said).ok());
            // Who waits for a verdict does not wait for the child's end, too.
            let heard = verdict.as_ref().is_none_or(&mut *tell);
            let status = end(child);
            match verdict {
                Some(_) => heard,
                None => {
                    let fault = said.is_some() && is_fault(status);
                    tell(&Verdict { fault, ..refused(unanswered(said.is_some(), status)) })
                }
            }
        }
    }
}

/// Why a child gave no answer.
fn unanswered(in_time: bool, status: i32) -> String {
    if !in_time {
        return format!(
            "its load did not end within {} s, in a process of its own",
            (LIMITS * limit()).as_secs()
        );
    }
    let how = match libc::WIFSIGNALED(status) {
        true => format!("was ended by signal {}", libc::WTERMSIG(status)),
        false => format!("ended itself with exit code {}", libc::WEXITSTATUS(status)),
    };
    format!("the process that loaded it first {how}: the file is damaged, or its code at fault")
}

/// Was it a fault of the code, one of those that guards see in the child, too? Whoever is ended by somebody
/// else, or by the limits that the child has as a whole, may do better another day.
fn is_fault(status: i32) -> bool {
    libc::WIFSIGNALED(status) && crate::guard::FAULTS.contains(&libc::WTERMSIG(status))
}

/// In the child: lets the system's loader open the library.
fn glance(path: &Path) -> Verdict {
    use libloading::os::unix::{Library, RTLD_LOCAL, RTLD_NOW};
    // SAFETY: whatever runs here runs in a process that is there for it, and never ends otherwise than by
    // `say`.
    match unsafe { Library::open(Some(path), RTLD_NOW | RTLD_LOCAL) } {
        Ok(library) => {
            std::mem::forget(library);
            Verdict::default()
        }
        // This process's loader says it once more, and better.
        Err(_) => Verdict::default(),
    }
}

/// In the child: loads the library and asks what is in it.
fn load(path: &Path) -> Verdict {
    let found = inspect::read(path).and_then(|image| {
        let (_, plugins) = Library::load_image(path, &image, 1)?;
        let ids = plugins.iter().map(|plugin| plugin.info().id.clone()).collect();
        // What comes at the library's end is not waited for here.
        std::mem::forget(plugins);
        Ok(Verdict { hash: known::hash(&image), plugins: ids, ..Verdict::default() })
    });
    found.unwrap_or_else(|refusal| Verdict {
        fault: matches!(refusal, Refusal::Fault(_)),
        ..refused(refusal.to_string())
    })
}

/// In the child: says what came of it, and ends.
fn say(verdict: &Verdict, mut answer: File) -> ! {
    let _ = serde_json::to_vec(verdict).map(|answered| answer.write_all(&[&*answered, &[END]].concat()));
    // SAFETY: no destructor of the library runs.
    unsafe { libc::_exit(0) }
}

/// Bounds the child, which says nothing to anybody but its parent.
fn bound() {
    let at_most = |resource, most: u64| {
        let most = libc::rlimit { rlim_cur: most, rlim_max: most };
        // SAFETY: a limit of this process. Where the system refuses, the process goes on without.
        unsafe { libc::setrlimit(resource, &most) };
    };
    at_most(libc::RLIMIT_CORE, 0);
    at_most(libc::RLIMIT_AS, MEMORY);
    at_most(libc::RLIMIT_CPU, (PROCESSOR * limit()).as_secs());
    // SAFETY: the process leads a group of its own, which ends with its parent; its files are this process's
    // own.
    unsafe {
        libc::prctl(libc::PR_SET_PDEATHSIG, libc::SIGKILL);
        libc::setpgid(0, 0);
        let nowhere = libc::open(c"/dev/null".as_ptr(), libc::O_RDWR);
        for file in 0..3 {
            libc::dup2(nowhere, file);
        }
    }
}

fn pipe() -> io::Result<[OwnedFd; 2]> {
    let mut ends = [0; 2];
    // SAFETY: room for two numbers, which belong to nobody else.
    unsafe {
        if libc::pipe2(ends.as_mut_ptr(), libc::O_CLOEXEC) != 0 {
            return Err(io::Error::last_os_error());
        }
        Ok(ends.map(|end| OwnedFd::from_raw_fd(end)))
    }
}

/// All that is said until its end, or until nobody can say more; None: that takes too long.
fn listen(mut answer: File) -> Option<Vec<u8>> {
    let end = Instant::now() + LIMITS * limit();
    let mut said = Vec::new();
    loop {
        let rest = end.saturating_duration_since(Instant::now());
        let mut poll = libc::pollfd { fd: answer.as_raw_fd(), events: libc::POLLIN, revents: 0 };
        // SAFETY: one file, which is open.
        match unsafe { libc::poll(&mut poll, 1, i32::try_from(rest.as_millis()).unwrap_or(i32::MAX)) } {
            0 => return None,
            1 => {}
            _ => continue,
        }
        let mut part = [0; 4096];
        match answer.read(&mut part) {
            Ok(0) | Err(_) => return Some(said),
            Ok(length) if said.len() as u64 <= LONGEST => {
                said.extend_from_slice(&part[..length]);
                if said.pop_if(|last| *last == END).is_some() {
                    return Some(said);
                }
            }
            Ok(_) => return Some(said),
        }
    }
}

/// Ends a child with all that it started; how it ended.
fn end(child: i32) -> i32 {
    let mut status = 0;
    // SAFETY: a child of this process, and the group that it leads; both are there until it is waited for.
    unsafe {
        // One that has said all ends by itself; one that crashed did.
        let mut info = std::mem::zeroed::<libc::siginfo_t>();
        let flags = libc::WEXITED | libc::WNOWAIT | libc::WNOHANG;
        for _ in 0..2000 {
            let asked = libc::waitid(libc::P_PID, child as u32, &mut info, flags);
            if asked != 0 || info.si_pid() != 0 {
                break;
            }
            libc::usleep(100);
        }
        libc::kill(-child, libc::SIGKILL);
        libc::kill(child, libc::SIGKILL);
        libc::waitpid(child, &mut status, 0);
    }
    status
}
