//! The guarded call on x86-64 (System V).

use std::{arch::naked_asm, ffi::c_void};

use super::frame::Frame;

/// Calls `call(data)` and returns 0; returns 1 when it was left. What a call preserves (rbx, rbp, r12 to r15,
/// MXCSR) is as before in both cases.
///
/// MXCSR is put back whatever it is. To look first whether it changed takes a second STMXCSR and a wait for
/// what both stored: 7.4 ns a call on an AMD EPYC of 2.4 GHz, where one STMXCSR and LDMXCSR take 3.7. Of the
/// 9 ns that a guard costs there (`reef bench contract`), the thread's marker has 2.1, the call through a
/// pointer 1.9, the other registers 0.3; the rest carries the closure and its result.
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
        ".cfi_undefined rip", // Whoever unwinds a plugin's frames finds the end of the stack here: no host frame is unwound.
        "push rbp",
        "mov rbp, rsp",
        "push rbx",
        "push r12",
        "push r13",
        "push r14",
        "push r15",
        "sub rsp, 8", // [rsp]: MXCSR; rsp is a multiple of 16.
        "stmxcsr [rsp]",
        "mov [rdx], rsp", // Frame::sp
        "lea rax, [rip + 2f]",
        "mov [rdx + 8], rax", // Frame::pc
        "mov rax, rdi",
        "mov rdi, rsi",
        "call rax",
        "xor eax, eax",
        "3:",
        "ldmxcsr [rsp]",
        "add rsp, 8",
        "pop r15",
        "pop r14",
        "pop r13",
        "pop r12",
        "pop rbx",
        "pop rbp",
        "ret",
        "2:", // Left: rsp is Frame::sp again.
        "cld",
        "fninit",
        "mov eax, 1",
        "jmp 3b",
        ".cfi_endproc",
    )
}

/// Leaves the guarded call of a frame.
///
/// # Safety
/// The frame is the innermost of this thread, and nothing above it on the stack must be dropped.
#[unsafe(naked)]
pub(super) unsafe extern "C" fn leave(frame: *mut Frame) -> ! {
    naked_asm!("mov rsp, [rdi]", "jmp [rdi + 8]")
}

/// Program counter of an interrupted thread.
///
/// # Safety
/// The context that the kernel gave to a signal handler.
pub(super) unsafe fn program_counter(context: *mut libc::ucontext_t) -> usize {
    // SAFETY: the caller's promise.
    unsafe { (*context).uc_mcontext.gregs[libc::REG_RIP as usize] as usize }
}

/// Stack pointer of an interrupted thread.
///
/// # Safety
/// The context that the kernel gave to a signal handler.
pub(super) unsafe fn stack_pointer(context: *mut libc::ucontext_t) -> usize {
    // SAFETY: the caller's promise.
    unsafe { (*context).uc_mcontext.gregs[libc::REG_RSP as usize] as usize }
}

/// Makes an interrupted thread go on where the frame's call is left.
///
/// # Safety
/// The context that the kernel gave to a signal handler; the frame is the innermost of this thread.
pub(super) unsafe fn redirect(context: *mut libc::ucontext_t, frame: *const Frame) {
    /// Trap, direction and alignment-check flags.
    const FLAGS: i64 = 0x100 | 0x400 | 0x4_0000;
    // SAFETY: the caller's promise.
    unsafe {
        let registers = &mut (*context).uc_mcontext.gregs;
        registers[libc::REG_RSP as usize] = (*frame).sp as i64;
        registers[libc::REG_RIP as usize] = (*frame).pc as i64;
        registers[libc::REG_EFL as usize] &= !FLAGS;
    }
}
