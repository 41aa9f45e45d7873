//! The signal handler: leaves guarded calls, and passes on what is not a plugin's fault.

use std::{
    cell::UnsafeCell,
    mem::MaybeUninit,
    ptr,
    sync::{
        Once,
        atomic::{AtomicI32, Ordering},
    },
};

use super::{
    call, ending,
    frame::{Frame, Seen},
    last, stack,
};
use crate::{
    guard::{FAULTS, Fate, fate::stage},
    marker::{self, Place},
};

/// Wakes a runaway that waits in the system. Nobody else's default: ignored.
pub(super) const NUDGE: i32 = libc::SIGURG;

/// All signals that are handled, faults first.
pub(super) const HANDLED: [i32; 8] =
    [FAULTS[0], FAULTS[1], FAULTS[2], FAULTS[3], FAULTS[4], FAULTS[5], FAULTS[6], NUDGE];

/// The process that the handlers are for.
static PROCESS: AtomicI32 = AtomicI32::new(0);

/// Is this the process that loaded the plugin, and not one that the plugin forked? May be called from a
/// signal handler.
pub(super) fn is_this_process() -> bool {
    // SAFETY: a number.
    PROCESS.load(Ordering::Relaxed) == unsafe { libc::getpid() }
}

/// What the handlers replaced.
struct Before([UnsafeCell<MaybeUninit<libc::sigaction>>; HANDLED.len()]);

// SAFETY: written once in `install`, each before its signal's handler is there; read by handlers only.
unsafe impl Sync for Before {}

static BEFORE: Before = Before([const { UnsafeCell::new(MaybeUninit::zeroed()) }; HANDLED.len()]);

/// Puts the handlers in place, once a process.
pub(super) fn install() {
    static INSTALLED: Once = Once::new();
    INSTALLED.call_once(|| {
        #[cfg(all(target_env = "gnu", not(target_feature = "crt-static")))]
        std::hint::black_box((&super::ends::KEPT, &super::ends::KEPT_OF_THREADS));
        PROCESS.store(std::process::id().cast_signed(), Ordering::Relaxed);
        for (signal, before) in HANDLED.iter().zip(&BEFORE.0) {
            // SAFETY: the action is plain data; nobody reads `before` meanwhile; the signal exists: the call
            // cannot fail.
            unsafe { libc::sigaction(*signal, ptr::null(), (*before.get()).as_mut_ptr()) };
            put(*signal);
        }
    });
}

/// Puts our handler of a signal in place.
pub(super) fn put(signal: i32) {
    // SAFETY: the action is plain data, filled as the system wants it; the signal exists: the call cannot
    // fail.
    unsafe {
        let mut action: libc::sigaction = std::mem::zeroed();
        action.sa_sigaction = on_signal as *const () as usize;
        // Without SA_RESTART: a runaway that waits in the system has to come back from there.
        action.sa_flags = libc::SA_SIGINFO | libc::SA_ONSTACK;
        libc::sigemptyset(&mut action.sa_mask);
        libc::sigaction(signal, &action, ptr::null_mut());
    }
}

/// Is our handler of a signal in place?
pub(super) fn is_ours(signal: i32) -> bool {
    // SAFETY: only asks, into plain data of ours.
    let action = unsafe {
        let mut action: libc::sigaction = std::mem::zeroed();
        libc::sigaction(signal, ptr::null(), &mut action);
        action
    };
    action.sa_sigaction == on_signal as *const () as usize && action.sa_flags & libc::SA_ONSTACK != 0
}

/// Uses nothing that a signal handler must not: thread-locals without initialiser, atomics, system calls.
unsafe extern "C" fn on_signal(signal: i32, info: *mut libc::siginfo_t, context: *mut libc::c_void) {
    let frame = Frame::current();
    if let Place::Ending(_) = marker::place() {
        // SAFETY: the kernel's arguments; the marker leads to the fate of the generation whose thread ends
        // here.
        return unsafe { on_signal_at_the_end(signal, info, context) };
    }
    let in_plugin = !frame.is_null() && matches!(marker::place(), Place::Plugin(_));
    // SAFETY: the kernel's arguments; the frame is of the guarded call that this thread is in, and its fate
    // outlives it.
    unsafe {
        let ours = in_plugin && comes_from_here(info) && can_be_left(frame, context.cast());
        let stage = if ours { (*(*frame).fate).stage.load(Ordering::Relaxed) } else { stage::NONE };
        if signal == NUDGE {
            if stage != stage::NONE {
                if stage == stage::LEAVE {
                    leave(signal, info, context.cast(), frame, true);
                }
                return;
            }
        } else if ours {
            return leave(signal, info, context.cast(), frame, stage != stage::NONE);
        }
        pass_on(signal, info, context);
    }
}

/// A signal of a thread that ends: a fault of the library's destructors leads back to nowhere.
///
/// # Safety
/// The kernel's arguments, on a thread whose marker says that it ends.
unsafe fn on_signal_at_the_end(signal: i32, info: *mut libc::siginfo_t, context: *mut libc::c_void) {
    // SAFETY: the caller's promise; the fate lives until the thread is joined.
    unsafe {
        let fate: *const Fate = marker::frame().cast();
        let stage = (*fate).stage.load(Ordering::Relaxed);
        if signal == NUDGE {
            if stage == stage::LEAVE {
                ending::strand(fate, seen(signal, info, context.cast(), true));
            }
        } else if comes_from_here(info) && is_this_process() {
            ending::strand(fate, seen(signal, info, context.cast(), stage != stage::NONE));
        } else {
            pass_on(signal, info, context);
        }
    }
}

/// Is the guarded call of this frame still there, and not left yet? Nothing is led back twice to one frame,
/// nor to one that was unwound, nor in a process that a plugin forked.
///
/// # Safety
/// The kernel's context, and the innermost frame of this thread.
unsafe fn can_be_left(frame: *const Frame, context: *mut libc::ucontext_t) -> bool {
    // SAFETY: the caller's promise.
    unsafe {
        let at = call::stack_pointer(context);
        (*frame).seen.is_none() && !stack::is_above(at, (*frame).sp) && is_this_process()
    }
}

/// Did the kernel send it because of what this thread did, or this process itself? Somebody else's `kill` is
/// no fault.
///
/// # Safety
/// The kernel's own information.
unsafe fn comes_from_here(info: *mut libc::siginfo_t) -> bool {
    // SAFETY: the caller's promise; a signal that was sent (code not above 0) names its sender.
    unsafe { (*info).si_code > 0 || (*info).si_pid() == libc::getpid() }
}

/// The thread goes on where its guarded call is left.
///
/// # Safety
/// The kernel's arguments, and the innermost frame of this thread.
unsafe fn leave(
    signal: i32,
    info: *mut libc::siginfo_t,
    context: *mut libc::ucontext_t,
    frame: *mut Frame,
    runaway: bool,
) {
    // SAFETY: the caller's promise.
    unsafe {
        (*frame).seen = Some(seen(signal, info, context, runaway));
        call::redirect(context, frame);
        // The kernel restores the mask that was there; nobody blocks these for long, least of all the host.
        for signal in HANDLED {
            libc::sigdelset(&mut (*context).uc_sigmask, signal);
        }
    }
}

/// What the kernel says of a signal.
///
/// # Safety
/// The kernel's arguments.
unsafe fn seen(
    signal: i32,
    info: *mut libc::siginfo_t,
    context: *mut libc::ucontext_t,
    runaway: bool,
) -> Seen {
    // SAFETY: the caller's promise.
    unsafe {
        let code = (*info).si_code;
        let address = if code > 0 { (*info).si_addr() as usize } else { 0 };
        Seen { signal, code, address, pc: call::program_counter(context), runaway, ended: None }
    }
}

/// Does what would have been done without these handlers.
///
/// # Safety
/// The kernel's arguments.
unsafe fn pass_on(signal: i32, info: *mut libc::siginfo_t, context: *mut libc::c_void) {
    let Some(index) = HANDLED.iter().position(|handled| *handled == signal) else { return };
    // SAFETY: the caller's promise.
    if signal != NUDGE && unsafe { comes_from_here(info) } && is_this_process() {
        last::say(signal);
    }
    // SAFETY: `install` wrote it before the first signal came here; a handler of one argument or of three is
    // called as it was registered.
    unsafe {
        let before = (*BEFORE.0[index].get()).assume_init_ref();
        match before.sa_sigaction {
            libc::SIG_IGN if signal == NUDGE || (*info).si_code <= 0 => {}
            libc::SIG_DFL if signal == NUDGE => {}
            libc::SIG_DFL | libc::SIG_IGN => {
                let mut default: libc::sigaction = std::mem::zeroed();
                default.sa_sigaction = libc::SIG_DFL;
                libc::sigaction(signal, &default, ptr::null_mut());
                // A fault happens again on return, with its own address in the core; one that was sent does
                // not.
                if (*info).si_code <= 0 {
                    libc::raise(signal);
                }
            }
            handler if before.sa_flags & libc::SA_SIGINFO != 0 => {
                let handler = std::mem::transmute::<
                    usize,
                    unsafe extern "C" fn(i32, *mut libc::siginfo_t, *mut libc::c_void),
                >(handler);
                handler(signal, info, context);
            }
            handler => {
                let handler = std::mem::transmute::<usize, unsafe extern "C" fn(i32)>(handler);
                handler(signal);
            }
        }
    }
}
