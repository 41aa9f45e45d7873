//! One worker or many: the same bytes.

mod common;

use std::{
    ffi::c_void,
    sync::atomic::{AtomicU32, Ordering},
};

use common::*;
use glam::DVec3;
use reef_flow::Level;
use reef_sdk::{Workers, abi};
use reef_seaweed_model::{
    bed::{Bed, JointPose, Plant, State, Surroundings},
    levels::Levels,
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

fn run(workers: Workers<'_>) -> (State, Vec<JointPose>, Vec<abi::Flow>) {
    let plants = (0..150)
        .map(|i| {
            let at = f64::from(i);
            let place = DVec3::new((at * 0.7548).fract() * 20.0, -10.0, (at * 0.5698).fract() * 20.0);
            Plant { kind: i as usize % 2, size: 0.7 + 0.5 * (at * 0.618).fract(), ..plant(place) }
        })
        .collect();
    let mut bed = Bed::new(vec![kind(usual_blade()), kind(bush())], plants);
    let flow = [current(DVec3::new(0.1, 0.0, 0.05))];
    for step in 0..60 {
        let waves: Vec<_> = sea(7.0, 8).iter().map(|train| train.at(f64::from(step) * DT)).collect();
        let camera = camera(DVec3::new(10.0, -9.0, 22.0), DVec3::new(10.0, -10.0, 0.0));
        bed.step(&Surroundings { workers, ..around(&flow, &waves, &camera) }, &Levels::default());
    }
    let mut poses = vec![JointPose::default(); bed.joint_count()];
    bed.write_poses(Level::best(), workers, &mut poses);
    (bed.save(), poses, bed.flows().to_vec())
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
    for _ in 0..3 {
        assert!(run(many) == one);
    }
}
