//! A check's process and all that it started: bounded from inside, ended from outside as a whole.

#![allow(unsafe_code, reason = "calls of the system without a safe counterpart in std")]

use std::{collections::HashSet, fs, mem::MaybeUninit};

/// Most memory that a check's process may map [bytes]: a runaway must not take the machine's.
const MEMORY: u64 = 16 << 30;

/// In the check's process, before anything else: it ends with its parent, leaves no core, and takes no more
/// memory than it may.
pub(super) fn bound() {
    let limit = |resource, most: u64| {
        let limit = libc::rlimit { rlim_cur: most, rlim_max: most };
        // SAFETY: a limit of this process. Where the system refuses, the process goes on without.
        unsafe { libc::setrlimit(resource, &limit) };
    };
    limit(libc::RLIMIT_CORE, 0);
    limit(libc::RLIMIT_AS, MEMORY);
    // SAFETY: asks for a signal to this process.
    unsafe { libc::prctl(libc::PR_SET_PDEATHSIG, libc::SIGKILL) };
}

/// Ends this process at once: no destructor of any library runs.
pub(super) fn leave() -> ! {
    // SAFETY: the verdict is in its file; nothing else is left to be done.
    unsafe { libc::_exit(0) }
}

/// Has the process ended? It is not reaped yet, so its number and that of its group still belong to it.
pub(super) fn has_ended(process: u32) -> bool {
    let mut info = MaybeUninit::<libc::siginfo_t>::zeroed();
    let flags = libc::WEXITED | libc::WNOHANG | libc::WNOWAIT;
    // SAFETY: only asks about a child of ours; the answer is plain data.
    unsafe {
        let asked = libc::waitid(libc::P_PID, process, info.as_mut_ptr(), flags);
        asked != 0 || info.assume_init().si_pid() != 0
    }
}

/// Kills the process's whole group.
pub(super) fn kill(process: u32) {
    let Ok(group) = i32::try_from(process) else { return };
    // SAFETY: the group was made for this check, and its leader is not reaped yet.
    unsafe { libc::kill(-group, libc::SIGKILL) };
}

/// From now on, processes whose parent has ended become this one's children.
pub(super) fn adopt_orphans() {
    // SAFETY: a property of this process. Where the system refuses, what left its group may live on.
    unsafe { libc::prctl(libc::PR_SET_CHILD_SUBREAPER, 1) };
}

/// Kills all children of this process but those that are known: orphans that left the group of a check that
/// has ended. Nobody may start a process meanwhile.
pub(super) fn kill_orphans(known: &HashSet<u32>) {
    // Each round may make orphans of others.
    for _ in 0..100 {
        let orphans: Vec<u32> = children().into_iter().filter(|child| !known.contains(child)).collect();
        if orphans.is_empty() {
            return;
        }
        for orphan in orphans.into_iter().filter_map(|orphan| i32::try_from(orphan).ok()) {
            // SAFETY: a child of this process, which nobody else waits for.
            unsafe {
                libc::kill(orphan, libc::SIGKILL);
                libc::waitpid(orphan, std::ptr::null_mut(), 0);
            }
        }
    }
}

/// All children of this process.
fn children() -> Vec<u32> {
    let tasks = fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let lists = tasks.filter_map(|task| fs::read_to_string(task.path().join("children")).ok());
    lists
        .flat_map(|list| list.split_whitespace().filter_map(|n| n.parse().ok()).collect::<Vec<_>>())
        .collect()
}
