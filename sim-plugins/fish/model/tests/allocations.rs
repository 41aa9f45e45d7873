//! A step allocates nothing once it is warm.

use glam::DVec3;
use reef_fish_model::{
    Plan,
    body::{Body, Profile},
    material::{Beat, Drive, Material},
    shoal::{Habitat, Host, Kind, Shoal, Start, Surroundings, Waves},
    species::{Singularity, Species},
    tank::{Stepping, Swimmer, Tank},
};
use reef_flow::Level;
use reef_sdk::{
    Workers,
    abi::{self, Flow, Obstacle},
};

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

#[test]
fn a_step_of_a_shoal_allocates_nothing_once_warm() {
    let mut species = Species::default();
    species.carries.kind = Singularity::Source;
    let kind = Kind::new(&species, Vec::new()).expect("a kind");
    let low = DVec3::new(-4.0, -9.0, -4.0);
    let start = |i: u32| {
        let at = f64::from(i);
        let place = DVec3::new((at * 0.7548).fract(), (at * 0.5698).fract(), (at * 0.4302).fract());
        Start {
            kind: 0,
            position: low + DVec3::splat(1.0) + place * 6.0,
            heading: at,
            size: 1.0,
            habitat: 0,
            home: None,
            seed: i.into(),
        }
    };
    let starts: Vec<Start> = (0..200).map(start).collect();
    let habitat = Habitat { low, high: low + DVec3::splat(8.0) };
    let mut shoal = Shoal::new(vec![kind], vec![habitat], &starts).expect("a shoal");
    let current =
        Flow { kind: abi::FLOW_DIRECTIONAL, axis: [1.0, 0.0, 0.0], strength: 0.05, ..Flow::default() };
    let rock = Obstacle { from: [0.0, -5.0, 0.0], radius: 0.5, ..Obstacle::default() };
    let wave = abi::Wave {
        amplitude: 0.2,
        wave_number: 0.3,
        frequency: 1.6,
        direction: [1.0, 0.0],
        ..abi::Wave::default()
    };
    let mut flow = Vec::with_capacity(300);
    let mut counts = 0;
    let mut emitted = 0;
    for step in 0..400 {
        // The eye wanders: bodies become points and points bodies, farther than while warming up.
        let swing = if step < 200 { 1.0 } else { 3.0 };
        let around = Surroundings {
            flow: &flow,
            bed: None,
            waves: Waves { trains: &[wave], depth: 9.0, factor: 1.0, camera: None },
            obstacles: &[rock],
            strangers: &[],
            surface: 0.0,
            hosts: &[Host {
                position: DVec3::new(0.0, -5.0, 0.0),
                radius: 2.0,
                id: 1,
                species: abi::fnv1a_32(b"host"),
            }],
            eye: DVec3::new(swing * (f64::from(step) * 0.05).sin(), -5.0, 0.0),
            near: 2.5,
            dt: 1.0 / 60.0,
            level: Level::best(),
            workers: Workers::inline(),
        };
        let before = reef_counting::of_this_thread();
        shoal.step(&around);
        if step >= 200 {
            counts += reef_counting::of_this_thread() - before;
        }
        emitted += shoal.flows().len();
        flow.clear();
        flow.push(current);
        flow.extend_from_slice(shoal.flows());
    }
    assert!(emitted > 100, "they carry something: {emitted}");
    assert!(reef_counting::of_this_thread() > 0, "nothing counts");
    assert_eq!(counts, 0);
}
