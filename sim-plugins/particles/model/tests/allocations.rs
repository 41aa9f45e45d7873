//! A step allocates nothing once it is warm.

mod common;

use common::*;
use glam::DVec3;
use reef_particles_model::{Cloud, Levels, Surroundings};
use reef_sdk::abi::{self, Billboard};

#[global_allocator]
static ALLOCATOR: reef_counting::Counting = reef_counting::Counting;

#[test]
fn a_step_allocates_nothing_once_warm() {
    let mut cloud = cloud("[[boxes]]\nlow = [-5.0, -1.5, -5.0]\nhigh = [5.0, -0.5, 5.0]\ncount = 4000\n");
    let camera = camera(DVec3::new(0.0, -1.2, 9.0), DVec3::new(0.0, -1.0, 0.0));
    let waves = sea(6.0, 50.0, 1.0);
    let flow =
        [current(DVec3::new(0.3, 0.05, 0.1)), local(abi::FLOW_SOURCE, DVec3::new(4.0, -1.0, 0.0), 0.2, 0.8)];
    let mut sprites = vec![Billboard::default(); 8000];
    let mut go = |cloud: &mut Cloud, steps: core::ops::Range<u64>| {
        for step in steps {
            let around = Surroundings { step, ..around(&flow, &waves, &camera) };
            let counts = cloud.advance(&around, &Levels::default());
            cloud.emit(&around, &mut sprites[..counts.sprites], &mut []);
        }
    };
    assert!(reef_counting::of_this_thread() > 0, "nothing counts");
    go(&mut cloud, 1..100);
    let before = reef_counting::of_this_thread();
    go(&mut cloud, 100..500);
    assert_eq!(reef_counting::of_this_thread() - before, 0);
}
