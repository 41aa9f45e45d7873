//! A step allocates nothing once it is warm.

mod common;

use common::*;
use glam::DVec3;
use reef_flow::Level;
use reef_sdk::Workers;
use reef_seaweed_model::{
    bed::{Bed, JointPose, Plant},
    levels::Levels,
};

#[global_allocator]
static ALLOCATOR: reef_counting::Counting = reef_counting::Counting;

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
        let before = reef_counting::of_this_thread();
        bed.step(&around, &Levels::default());
        bed.write_poses(Level::best(), Workers::inline(), &mut poses);
        if step >= 200 {
            counts += reef_counting::of_this_thread() - before;
        }
        flow.clear();
        flow.push(current(DVec3::new(0.1, 0.0, 0.02)));
        flow.extend_from_slice(bed.flows());
    }
    assert!(flow.len() > 10, "{}", flow.len());
    assert!(reef_counting::of_this_thread() > 0, "nothing counts");
    assert_eq!(counts, 0);
}
