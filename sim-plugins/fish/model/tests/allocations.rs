//! A step allocates nothing once it is warm.

use glam::DVec3;
use reef_fish_model::{
    Plan,
    body::{Body, Profile},
    material::{Beat, Drive, Material},
    tank::{Stepping, Swimmer, Tank},
};
use reef_flow::Level;
use reef_sdk::Workers;

#[global_allocator]
static ALLOCATOR: reef_counting::Counting = reef_counting::Counting;

#[test]
fn a_step_of_bodies_allocates_nothing_once_warm() {
    let body = Body::new(&Profile::default()).expect("a body");
    let plan = Plan::new(&body, &Material::default(), &Beat::default()).expect("a plan");
    let drive = Drive { speed: 2.0, force: 0.2, ..Drive::default() };
    let place = |i: u32| Swimmer { drive, ..Swimmer::at(DVec3::X * f64::from(i)) };
    let mut tank = Tank::new(plan, (0..50).map(place).collect(), &[]);
    let mut counts = 0;
    for step in 0..60 {
        let before = reef_counting::of_this_thread();
        tank.step_all(1.0 / 60.0, &Stepping::default(), Level::best(), Workers::inline());
        if step > 0 {
            counts += reef_counting::of_this_thread() - before;
        }
    }
    assert!(reef_counting::of_this_thread() > 0, "nothing counts");
    assert_eq!(counts, 0);
}
