//! One worker or many: the same bytes.

use std::{
    ffi::c_void,
    sync::atomic::{AtomicU32, Ordering},
};

use glam::DVec3;
use reef_fish_model::{
    Plan,
    body::{Body, Profile},
    material::{Beat, Drive, Material},
    tank::{Stepping, Swimmer, Tank},
};
use reef_flow::Level;
use reef_sdk::{Workers, abi};

/// Jobs on threads that take what is next: who runs what differs from call to call.
unsafe extern "C" fn parallel_for(ctx: *mut c_void, count: u32, job: abi::Job, user: *mut c_void) -> i32 {
    let Some(job) = job else { return abi::ERROR };
    let next = AtomicU32::new(0);
    let user = user.expose_provenance();
    std::thread::scope(|scope| {
        // The context is the number of workers.
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
fn with_workers<R>(count: u32, job: impl Fn(Workers<'_>) -> R) -> R {
    // SAFETY: a host of zeros is one without services.
    let mut host: abi::Host = unsafe { std::mem::zeroed() };
    host.worker_count = count;
    host.ctx = std::ptr::without_provenance_mut(count as usize);
    host.parallel_for = Some(parallel_for);
    // SAFETY: `parallel_for` above keeps the contract: every index once, and concurrent jobs by different
    // workers.
    let workers = unsafe { Workers::of_host(&host) };
    assert_eq!(workers.count(), count as usize);
    job(workers)
}

fn bodies(workers: Workers<'_>) -> Vec<u32> {
    let body = Body::new(&Profile::default()).expect("a body");
    let plan = Plan::new(&body, &Material::default(), &Beat::default()).expect("a plan");
    let place = |i: u32| Swimmer {
        drive: Drive { speed: 1.0 + f64::from(i) * 0.02, force: 0.2, ..Drive::default() },
        ..Swimmer::at(DVec3::X * f64::from(i))
    };
    let mut tank = Tank::new(plan, (0..90).map(place).collect(), &[]);
    for _ in 0..30 {
        tank.step_all(1.0 / 60.0, &Stepping::default(), Level::best(), workers);
    }
    (0..90).flat_map(|i| tank.positions(i).to_vec()).flatten().map(f32::to_bits).collect()
}

#[test]
fn bodies_are_the_same_bytes_with_one_worker_or_four() {
    let one = bodies(Workers::inline());
    for count in [1, 2, 4] {
        assert!(with_workers(count, bodies) == one, "{count} workers");
    }
}
