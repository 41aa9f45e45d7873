//! Threads that run a plugin's code: each has a stack of its own for the signal handler, since a fault may be
//! that the thread's own is full.

use std::{
    cell::Cell,
    ffi::c_void,
    fs::File,
    io::{Read, Write},
    mem::MaybeUninit,
    ptr,
    sync::Arc,
};

use super::{ending, signals};
use crate::guard::Fate;

/// Room for the handler, and for those that it passes signals on to [bytes]. The kernel's own frame comes on
/// top.
const ROOM: usize = 64 << 10;

/// A thread of a generation, as the watchdog sees it. It may be over, and joined: all that is kept of it are
/// numbers, of which the kernel says that there is no such thread any more.
#[derive(Debug)]
pub(crate) struct Thread {
    /// The kernel's number of it.
    task: libc::c_long,
    clock: Option<libc::clockid_t>,
}

impl Thread {
    /// Does it wait in the system, where a signal reaches it? One that could go on, and has no processor,
    /// does not. Also where the system does not say, or it is over. Allocates nothing: whoever holds the lock
    /// of the memory may be what is asked about.
    pub(super) fn is_asleep(&self) -> bool {
        let (mut path, mut text) = ([0; 64], [0; 512]);
        let mut rest = &mut path[..];
        let written = write!(rest, "/proc/self/task/{}/stat", self.task).map(|()| 64 - rest.len());
        let read = written.ok().and_then(|length| {
            let path = str::from_utf8(&path[..length]).ok()?;
            File::open(path).and_then(|mut file| file.read(&mut text)).ok()
        });
        // The state follows the name, which stands in brackets and may have brackets in it.
        let text = &text[..read.unwrap_or(0)];
        let state = text.iter().rposition(|byte| *byte == b')').and_then(|at| text.get(at + 2));
        state.is_none_or(|state| !matches!(state, b'R' | b'D'))
    }

    /// Processor time that it used so far [ns]; None where the system does not say, or it is over.
    pub(super) fn processor_time(&self) -> Option<u64> {
        let mut time = MaybeUninit::<libc::timespec>::zeroed();
        // SAFETY: a number, for which the kernel looks for a thread; the answer is plain data.
        let time = unsafe {
            if libc::clock_gettime(self.clock?, time.as_mut_ptr()) != 0 {
                return None;
            }
            time.assume_init()
        };
        Some(time.tv_sec as u64 * 1_000_000_000 + time.tv_nsec as u64)
    }

    /// Interrupts it where it waits in the system. Nothing happens where it is over: `pthread_kill` would
    /// read its memory, which is gone once it is joined.
    pub(super) fn nudge(&self) {
        // SAFETY: numbers; a thread of this process alone can get the signal, whose handler is in place.
        unsafe { libc::syscall(libc::SYS_tgkill, libc::getpid(), self.task, signals::NUDGE) };
    }
}

thread_local! {
    /// Lowest address of this thread's stack.
    static STACK: Cell<usize> = const { Cell::new(0) };
    /// Address behind this thread's stack.
    static STACK_END: Cell<usize> = const { Cell::new(0) };
    /// Where the stack of this thread's signal handlers begins, and its size; 0: there is none of ours.
    static HANDLERS_STACK: Cell<(usize, usize)> = const { Cell::new((0, 0)) };
}

/// Is an address of this thread's stack above another, in frames that were there first? May be called from a
/// signal handler.
pub(super) fn is_above(address: usize, other: usize) -> bool {
    address > other && address < STACK_END.get()
}

/// Is the handlers' stack the one that [`Resident`] put there? If not, it is now.
pub(super) fn handlers_stack_is_in_place() -> bool {
    let (start, size) = HANDLERS_STACK.get();
    if start == 0 {
        return true;
    }
    // SAFETY: asks for this thread's stack of handlers, and puts back memory that `Resident` keeps for it.
    unsafe {
        let mut now: libc::stack_t = std::mem::zeroed();
        libc::sigaltstack(ptr::null(), &mut now);
        if now.ss_sp as usize == start && now.ss_size == size && now.ss_flags & libc::SS_DISABLE == 0 {
            return true;
        }
        let ours = libc::stack_t { ss_sp: start as *mut c_void, ss_flags: 0, ss_size: size };
        libc::sigaltstack(&ours, ptr::null_mut());
    }
    false
}

/// The guard is one page, of up to 64 KiB, at the stack's lower end or just below it.
const NEAR: usize = 64 << 10;

/// Did an access below this thread's stack fail?
pub(super) fn overflowed(signal: i32, address: usize) -> bool {
    let stack = STACK.get();
    signal == libc::SIGSEGV && stack != 0 && address.abs_diff(stack) < NEAR
}

/// A service needs this much of its caller's stack [bytes].
const SERVICE: usize = 64 << 10;

/// Faults here, still in the plugin's code by the marker, when the plugin left too little stack for a service
/// of the host: one that overflowed within the service would be the host's fault.
pub(crate) fn require_stack() {
    let here = 0_u8;
    let here = (&raw const here) as usize;
    let lowest = STACK.get();
    if lowest != 0 && here.wrapping_sub(lowest) < SERVICE {
        full(here, lowest);
    }
}

/// Walks down the stack into its guard page.
#[cold]
fn full(here: usize, lowest: usize) {
    const PAGE: usize = 4096;
    let mut at = here;
    while at > lowest.saturating_sub(NEAR) {
        // SAFETY: no memory is changed or trusted: this thread's own stack, then the guard page, which ends
        // the call.
        unsafe { (at as *const u8).read_volatile() };
        at -= PAGE;
    }
}

/// A thread that is prepared for guarded calls, as long as this value lives on it.
#[derive(Debug)]
pub(crate) struct Resident {
    fate: Arc<Fate>,
    /// Memory of the handler's stack and what was there before; None: the system had none to give, and what
    /// was there stays.
    stack: Option<(*mut c_void, usize, libc::stack_t)>,
}

impl Resident {
    /// Prepares the calling thread.
    pub(crate) fn new(fate: &Arc<Fate>) -> Self {
        signals::install();
        let (lowest, size) = own_stack();
        STACK.set(lowest);
        STACK_END.set(lowest + size);
        let mut clock = 0;
        // SAFETY: asks for the calling thread only; the answer is a number.
        let asked = unsafe { libc::pthread_getcpuclockid(libc::pthread_self(), &mut clock) };
        let clock = (asked == 0).then_some(clock);
        // SAFETY: as above.
        let task = unsafe { libc::syscall(libc::SYS_gettid) };
        fate.threads().push(Thread { task, clock });
        // SAFETY: nobody but a plugin would cancel a thread of the host's.
        unsafe { pthread_setcancelstate(CANCEL_DISABLE, ptr::null_mut()) };
        Self { fate: fate.clone(), stack: handler_stack() }
    }
}

/// The same number in all C libraries of Linux.
const CANCEL_DISABLE: i32 = 1;

unsafe extern "C" {
    fn pthread_setcancelstate(state: i32, old: *mut i32) -> i32;
}

impl Drop for Resident {
    fn drop(&mut self) {
        HANDLERS_STACK.set((0, 0));
        if let Some((memory, size, before)) = self.stack {
            // SAFETY: restores what was there before, then unmaps what nobody uses any more.
            unsafe {
                libc::sigaltstack(&before, ptr::null_mut());
                libc::munmap(memory, size);
            }
        }
        // The thread stays in the generation's list until all are joined: the watchdog looks at its end, too.
        ending::begin(&self.fate);
    }
}

/// Maps a stack for signal handlers, with a page below it that stops an overflow, and puts it in place.
fn handler_stack() -> Option<(*mut c_void, usize, libc::stack_t)> {
    // SAFETY: a number.
    let (page, frame) =
        unsafe { (libc::sysconf(libc::_SC_PAGESIZE), libc::getauxval(libc::AT_MINSIGSTKSZ) as usize) };
    let page = usize::try_from(page).ok().filter(|page| *page > 0)?;
    let size = (ROOM + frame).next_multiple_of(page) + page;
    // SAFETY: fresh memory of our own; the lowest page becomes the guard; the rest is the stack until `drop`.
    unsafe {
        let flags = libc::MAP_PRIVATE | libc::MAP_ANONYMOUS | libc::MAP_NORESERVE;
        let memory = libc::mmap(ptr::null_mut(), size, libc::PROT_READ | libc::PROT_WRITE, flags, -1, 0);
        if memory == libc::MAP_FAILED {
            return None;
        }
        let stack = libc::stack_t { ss_sp: memory.byte_add(page), ss_flags: 0, ss_size: size - page };
        let mut before: libc::stack_t = std::mem::zeroed();
        let placed =
            libc::mprotect(memory, page, libc::PROT_NONE) == 0 && libc::sigaltstack(&stack, &mut before) == 0;
        if !placed {
            libc::munmap(memory, size);
            return None;
        }
        HANDLERS_STACK.set((stack.ss_sp as usize, stack.ss_size));
        Some((memory, size, before))
    }
}

/// Lowest address of the calling thread's stack, and its size; 0: unknown.
fn own_stack() -> (usize, usize) {
    let mut attributes = MaybeUninit::<libc::pthread_attr_t>::zeroed();
    let (mut start, mut size) = (ptr::null_mut(), 0);
    // SAFETY: the calling thread's attributes, which are destroyed again.
    unsafe {
        if libc::pthread_getattr_np(libc::pthread_self(), attributes.as_mut_ptr()) != 0 {
            return (0, 0);
        }
        libc::pthread_attr_getstack(attributes.as_ptr(), &mut start, &mut size);
        libc::pthread_attr_destroy(attributes.as_mut_ptr());
    }
    (start as usize, size)
}
