//! The guarded call on AArch64 (AAPCS64).

use std::{arch::naked_asm, ffi::c_void};

use super::frame::Frame;

/// Calls `call(data)` and returns 0; returns 1 when it was left. What a call preserves (x19 to x30, d8 to
/// d15, FPCR) is as before in both cases.
///
/// # Safety
/// `call` may be called with `data`; `frame` lives until this returns.
#[unsafe(naked)]
pub(super) unsafe extern "C" fn enter(
    call: unsafe extern "C" fn(*mut c_void),
    data: *mut c_void,
    frame: *mut Frame,
) -> u32 {
    naked_asm!(
        ".cfi_startproc",
        ".cfi_undefined x30", // Whoever unwinds a plugin's frames finds the end of the stack here: no host frame is unwound.
        "stp x29, x30, [sp, #-176]!",
        "mov x29, sp",
        "stp x19, x20, [sp, #16]",
        "stp x21, x22, [sp, #32]",
        "stp x23, x24, [sp, #48]",
        "stp x25, x26, [sp, #64]",
        "stp x27, x28, [sp, #80]",
        "stp d8, d9, [sp, #96]",
        "stp d10, d11, [sp, #112]",
        "stp d12, d13, [sp, #128]",
        "stp d14, d15, [sp, #144]",
        "mrs x9, fpcr",
        "str x9, [sp, #160]",
        "mov x9, sp",
        "adr x10, 2f",
        "stp x9, x10, [x2]", // Frame::sp, Frame::pc
        "mov x9, x0",
        "mov x0, x1",
        "blr x9",
        "mov w0, #0",
        "3:",
        "ldr x9, [sp, #160]",
        "mrs x10, fpcr",
        "cmp x9, x10",
        "b.eq 4f",
        "msr fpcr, x9",
        "4:",
        "ldp d14, d15, [sp, #144]",
        "ldp d12, d13, [sp, #128]",
        "ldp d10, d11, [sp, #112]",
        "ldp d8, d9, [sp, #96]",
        "ldp x27, x28, [sp, #80]",
        "ldp x25, x26, [sp, #64]",
        "ldp x23, x24, [sp, #48]",
        "ldp x21, x22, [sp, #32]",
        "ldp x19, x20, [sp, #16]",
        "ldp x29, x30, [sp], #176",
        "ret",
        "2:", // Left: sp is Frame::sp again.
        "mov x29, sp",
        "mov w0, #1",
        "b 3b",
        ".cfi_endproc",
    )
}

/// Leaves the guarded call of a frame.
///
/// # Safety
/// The frame is the innermost of this thread, and nothing above it on the stack must be dropped.
#[unsafe(naked)]
pub(super) unsafe extern "C" fn leave(frame: *mut Frame) -> ! {
    // `ret` needs no landing pad where branches do.
    naked_asm!("ldp x9, x10, [x0]", "mov sp, x9", "ret x10")
}

/// Program counter of an interrupted thread.
///
/// # Safety
/// The context that the kernel gave to a signal handler.
pub(super) unsafe fn program_counter(context: *mut libc::ucontext_t) -> usize {
    // SAFETY: the caller's promise.
    unsafe { (*context).uc_mcontext.pc as usize }
}

/// Stack pointer of an interrupted thread.
///
/// # Safety
/// The context that the kernel gave to a signal handler.
pub(super) unsafe fn stack_pointer(context: *mut libc::ucontext_t) -> usize {
    // SAFETY: the caller's promise.
    unsafe { (*context).uc_mcontext.sp as usize }
}

/// Makes an interrupted thread go on where the frame's call is left.
///
/// # Safety
/// The context that the kernel gave to a signal handler; the frame is the innermost of this thread.
pub(super) unsafe fn redirect(context: *mut libc::ucontext_t, frame: *const Frame) {
    /// The kind of branch that was just taken, which a landing pad would have to match.
    const BRANCH_TYPE: u64 = 3 << 10;
    // SAFETY: the caller's promise.
    unsafe {
        let registers = &mut (*context).uc_mcontext;
        registers.sp = (*frame).sp as u64;
        registers.pc = (*frame).pc as u64;
        registers.pstate &= !BRANCH_TYPE;
    }
}
