//! A step allocates nothing once it is warm.

mod common;

use std::{
    alloc::{GlobalAlloc, Layout, System},
    cell::Cell,
};

use common::*;
use glam::DVec3;
use reef_flow::Level;
use reef_sdk::Workers;
use reef_seaweed_model::{
    bed::{Bed, JointPose, Plant},
    levels::Levels,
};

thread_local! {
    static COUNT: Cell<u64> = const { Cell::new(0) };
}

struct Counting;

// SAFETY: passes everything on to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.set(COUNT.get() + 1);
        // SAFETY: the caller's promise.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's promise.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        COUNT.set(COUNT.get() + 1);
        // SAFETY: the caller's promise.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn a_step_allocates_nothing_once_warm() {
    let plants = (0..200)
        .map(|i| {
            let at = f64::from(i);
            let place = DVec3::new((at * 0.7548).fract() * 20.0, -10.0, (at * 0.5698).fract() * 30.0);
            Plant { kind: i as usize % 2, ..plant(place) }
        })
        .collect();
    let mut bed = Bed::new(vec![kind(usual_blade()), kind(bush())], plants);
    let mut poses = vec![JointPose::default(); bed.joint_count()];
    let trains = sea(7.0, 12);
    let mut waves = Vec::with_capacity(trains.len());
    let mut flow = Vec::with_capacity(300);
    let mut counts = 0;
    for step in 0..400 {
        let time = f64::from(step) * DT;
        waves.clear();
        waves.extend(trains.iter().map(|train| train.at(time)));
        // A camera that turns, farther than while warming up: plants come into view, and go out of it, all
        // the time.
        let eye = DVec3::new(10.0, -9.0, 15.0);
        let angle = if step < 200 { 0.5 * (2.0 * time).sin() } else { 2.0 * time };
        let camera = camera(eye, eye + DVec3::new(angle.sin(), -0.1, angle.cos()));
        let around = around(&flow, &waves, &camera);
        let before = COUNT.get();
        bed.step(&around, &Levels::default());
        bed.write_poses(Level::best(), Workers::inline(), &mut poses);
        if step >= 200 {
            counts += COUNT.get() - before;
        }
        flow.clear();
        flow.push(current(DVec3::new(0.1, 0.0, 0.02)));
        flow.extend_from_slice(bed.flows());
    }
    assert!(flow.len() > 10, "{}", flow.len());
    assert_eq!(counts, 0);
}
