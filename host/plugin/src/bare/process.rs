//! What a plugin may leave behind in the process.

use std::{
    fs, io,
    os::fd::{AsRawFd, FromRawFd, OwnedFd},
    ptr, thread,
    time::{Duration, Instant},
};

/// What the process holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Held {
    /// Threads.
    pub threads: usize,
    /// Open files.
    pub files: usize,
    /// Processes that this one started and that still run.
    pub children: usize,
    /// The lowest key of `pthread_key_create` that nobody has.
    pub key: u32,
    /// Each signal's handler.
    pub handlers: [usize; SIGNALS],
    /// Bytes of the C library's heap in use, its large blocks included.
    pub heap: u64,
    /// Mapped regions.
    pub mappings: usize,
    /// Memory in use, in pages of the system.
    pub resident: usize,
}

/// Signals from 0 on that are looked at.
const SIGNALS: usize = 32;

impl Held {
    /// Now.
    pub fn now() -> Self {
        let entries = |folder: &str| fs::read_dir(folder).map_or(0, Iterator::count);
        let statm = fs::read_to_string("/proc/self/statm").unwrap_or_default();
        Self {
            threads: entries("/proc/self/task"),
            files: entries("/proc/self/fd"),
            children: children(),
            key: key(),
            handlers: handlers(),
            heap: heap(),
            mappings: fs::read_to_string("/proc/self/maps").map_or(0, |text| text.lines().count()),
            resident: statm.split(' ').nth(1).and_then(|pages| pages.parse().ok()).unwrap_or(0),
        }
    }
}

impl Held {
    /// What it holds after something that began with `before`. A thread that was joined is there for a moment
    /// still.
    pub fn after(before: &Self) -> Self {
        let end = Instant::now() + Duration::from_millis(300);
        loop {
            let now = Self::now();
            if now.threads <= before.threads || Instant::now() > end {
                return now;
            }
            thread::sleep(Duration::from_millis(2));
        }
    }
}

fn children() -> usize {
    let tasks = fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let lists = tasks.filter_map(|task| fs::read_to_string(task.path().join("children")).ok());
    lists.map(|list| list.split_whitespace().count()).sum()
}

fn key() -> u32 {
    let mut key = 0;
    // SAFETY: a key without a destructor, deleted again at once.
    unsafe {
        if libc::pthread_key_create(&mut key, None) != 0 {
            return u32::MAX;
        }
        libc::pthread_key_delete(key);
    }
    key
}

fn handlers() -> [usize; SIGNALS] {
    std::array::from_fn(|signal| {
        // SAFETY: only asks; a signal that the system keeps for itself is an error, and has none.
        unsafe {
            let mut action: libc::sigaction = std::mem::zeroed();
            libc::sigaction(signal as i32, ptr::null(), &mut action);
            action.sa_sigaction
        }
    })
}

/// Bytes of the C library's heap in use.
#[cfg(target_env = "gnu")]
pub fn heap() -> u64 {
    // SAFETY: only asks.
    let info = unsafe { libc::mallinfo2() };
    (info.uordblks + info.hblkhd) as u64
}

/// Other C libraries do not tell.
#[cfg(not(target_env = "gnu"))]
pub fn heap() -> u64 {
    0
}

/// How this thread rounds, and what it does with the smallest numbers: the control bits of its floating-point
/// unit.
#[cfg(target_arch = "x86_64")]
pub fn float_control() -> u64 {
    let mut control = 0_u32;
    // SAFETY: stores a register in a variable of ours.
    unsafe { std::arch::asm!("stmxcsr [{}]", in(reg) &mut control, options(nostack)) };
    u64::from(control & !0x3f) // Without the flags of what has happened.
}

/// How this thread rounds, and what it does with the smallest numbers: the control bits of its floating-point
/// unit.
#[cfg(target_arch = "aarch64")]
pub fn float_control() -> u64 {
    let control: u64;
    // SAFETY: reads a register.
    unsafe { std::arch::asm!("mrs {}, fpcr", out(reg) control, options(nostack, nomem)) };
    control
}

/// Other machines are not asked.
#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
pub fn float_control() -> u64 {
    0
}

/// Processor time of the calling thread [ns].
pub fn processor_time() -> u64 {
    clock(libc::CLOCK_THREAD_CPUTIME_ID)
}

/// Processor time of all threads of the process [ns].
pub fn processor_time_of_all() -> u64 {
    clock(libc::CLOCK_PROCESS_CPUTIME_ID)
}

fn clock(which: libc::clockid_t) -> u64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: writes into a variable of ours.
    unsafe { libc::clock_gettime(which, &mut time) };
    time.tv_sec as u64 * 1_000_000_000 + time.tv_nsec as u64
}

/// The calling thread's priority: nice, as the system calls it.
pub fn priority() -> i32 {
    // SAFETY: only asks.
    unsafe { libc::getpriority(libc::PRIO_PROCESS, 0) }
}

/// Standard output goes to a file without a name, as long as this lives.
#[derive(Debug)]
pub struct Caught {
    file: fs::File,
    before: OwnedFd,
}

impl Caught {
    /// From now on.
    pub fn begin() -> io::Result<Self> {
        let checked = |file: i32| if file < 0 { Err(io::Error::last_os_error()) } else { Ok(file) };
        // SAFETY: files that nobody else has; standard output is replaced and comes back in `drop`.
        unsafe {
            let file =
                fs::File::from_raw_fd(checked(libc::memfd_create(c"output".as_ptr(), libc::MFD_CLOEXEC))?);
            let before = OwnedFd::from_raw_fd(checked(libc::dup(libc::STDOUT_FILENO))?);
            checked(libc::dup2(file.as_raw_fd(), libc::STDOUT_FILENO))?;
            Ok(Self { file, before })
        }
    }

    /// How much was printed so far.
    pub fn bytes(&self) -> u64 {
        // SAFETY: all files of the C library are written out.
        unsafe { libc::fflush(ptr::null_mut()) };
        self.file.metadata().map_or(0, |metadata| metadata.len())
    }
}

impl Drop for Caught {
    fn drop(&mut self) {
        // SAFETY: the file that was standard output before.
        unsafe { libc::dup2(self.before.as_raw_fd(), libc::STDOUT_FILENO) };
    }
}
