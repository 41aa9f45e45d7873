//! One worker or many: the same bytes.

mod common;

use common::*;
use glam::DVec3;
use reef_flow::Level;
use reef_model_tests::threads::with_workers;
use reef_sdk::{Workers, abi};
use reef_seaweed_model::{
    bed::{Bed, JointPose, Plant, State, Surroundings},
    levels::Levels,
};

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
fn one_two_or_four_workers_give_the_same_bytes() {
    let one = run(Workers::inline());
    for workers in [2, 4, 4] {
        assert!(with_workers(workers, run) == one, "{workers} workers");
    }
}
