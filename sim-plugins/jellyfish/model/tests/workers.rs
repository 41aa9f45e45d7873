//! One worker or many: the same bytes.

use std::{
    ffi::c_void,
    sync::atomic::{AtomicU32, Ordering},
};

use glam::DVec3;
use reef_flow::Level;
use reef_jellyfish_model::{
    bloom::{Birth, Bloom, BloomState, Surroundings},
    species::Species,
};
use reef_sdk::{
    Workers,
    abi::{self, DrawVertex, Flow},
};

/// The most workers of the test.
const WORKERS: u32 = 4;

/// Jobs on threads that take what is next: who runs what differs from call to call.
unsafe extern "C" fn parallel_for(_: *mut c_void, count: u32, job: abi::Job, user: *mut c_void) -> i32 {
    let Some(job) = job else { return abi::ERROR };
    let next = AtomicU32::new(0);
    let user = user.expose_provenance();
    std::thread::scope(|scope| {
        for worker in 0..WORKERS {
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

fn run(workers: Workers<'_>) -> (BloomState, Vec<Flow>, Vec<DrawVertex>) {
    let mut species = Species::default();
    (species.grid.cells, species.grid.bells) = (32, 5.0);
    let birth = |i: u64| Birth {
        species: 0,
        place: DVec3::new(0.2 * i as f64, -3.0, 0.0),
        yaw: i as f64,
        size: 1.0,
        seed: i,
        id: i + 1,
    };
    let births: Vec<Birth> = (0..7).map(birth).collect();
    let mut bloom = Bloom::new(&[species], &births, 1025.0, 1.2e-6).expect("a bloom");
    let mut flow = Vec::new();
    for _ in 0..40 {
        let around = Surroundings {
            flow: &flow,
            waves: &[],
            depth: 9.0,
            dt: 1.0 / 60.0,
            level: Level::best(),
            workers,
        };
        bloom.step(&around);
        flow = bloom.flows().to_vec();
    }
    let mut vertices = vec![DrawVertex::default(); bloom.vertex_count()];
    bloom.write(Level::best(), workers, 1.0, &mut vertices);
    (bloom.save(), flow, vertices)
}

#[test]
fn one_worker_or_four_give_the_same_bytes() {
    // SAFETY: a host of zeros is one without services.
    let mut host: abi::Host = unsafe { std::mem::zeroed() };
    host.worker_count = WORKERS;
    host.parallel_for = Some(parallel_for);
    // SAFETY: `parallel_for` above keeps the contract: every index once, and concurrent jobs by different
    // workers.
    let many = unsafe { Workers::of_host(&host) };
    assert_eq!(many.count(), 4);
    let one = run(Workers::inline());
    for _ in 0..2 {
        assert!(run(many) == one);
    }
}
