//! Workers on threads of their own, as a host has them: for tests that one worker or many give the same
//! bytes.

use std::{
    ffi::c_void,
    sync::atomic::{AtomicU32, Ordering},
};

use reef_sdk::{Workers, abi};

/// Jobs on threads that take what is next: who runs what differs from call to call. The context is the number
/// of workers.
unsafe extern "C" fn parallel_for(ctx: *mut c_void, count: u32, job: abi::Job, user: *mut c_void) -> i32 {
    let Some(job) = job else { return abi::ERROR };
    let next = AtomicU32::new(0);
    let user = user.expose_provenance();
    std::thread::scope(|scope| {
        for worker in 0..ctx.addr() as u32 {
            let next = &next;
            scope.spawn(move || {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    if index >= count {
                        break;
                    }
                    // SAFETY: each index once, each thread its own worker; `user` is what came with the job.
                    unsafe { job(std::ptr::with_exposed_provenance_mut(user), index, worker) };
                }
            });
        }
    });
    abi::OK
}

/// Runs `job` with so many workers.
pub fn with_workers<R>(count: u32, job: impl Fn(Workers<'_>) -> R) -> R {
    // SAFETY: a host of zeros is one without services.
    let mut host: abi::Host = unsafe { std::mem::zeroed() };
    host.worker_count = count;
    host.ctx = std::ptr::without_provenance_mut(count as usize);
    host.parallel_for = Some(parallel_for);
    // SAFETY: `parallel_for` above keeps the contract: every index once, and concurrent jobs by different
    // workers.
    let workers = unsafe { Workers::of_host(&host) };
    assert_eq!(workers.count(), count as usize, "as many as were asked for");
    job(workers)
}
