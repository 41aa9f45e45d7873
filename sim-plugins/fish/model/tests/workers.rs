//! One worker or many: the same bytes.

use glam::DVec3;
use reef_fish_model::{
    Plan,
    body::{Body, Profile},
    material::{Beat, Drive, Material},
    shoal::{Habitat, Host, Kind, Shoal, Start, State, Surroundings, Waves},
    species::{Singularity, Species},
    tank::{Stepping, Swimmer, Tank},
};
use reef_flow::Level;
use reef_model_tests::threads::with_workers;
use reef_sdk::{
    Workers,
    abi::{self, Flow},
};

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

/// A shoal of which some are near, with what hunts it, in a current; and what it emits.
fn shoal(workers: Workers<'_>) -> (State, Vec<Flow>) {
    let mut species = Species::default();
    species.carries.kind = Singularity::Hole;
    (species.mind.home, species.mind.lives_in) = (4.0, vec!["host".into()]);
    let kinds = [Vec::new(), vec![0]].map(|prey| Kind::new(&species, prey).expect("a kind"));
    let low = DVec3::new(-4.0, -9.0, -4.0);
    let start = |i: u32| {
        let at = f64::from(i);
        let place = DVec3::new((at * 0.7548).fract(), (at * 0.5698).fract(), (at * 0.4302).fract());
        Start {
            kind: u32::from(i % 40 == 7),
            position: low + DVec3::splat(1.0) + place * 6.0,
            heading: at,
            size: 0.8 + 0.4 * place.x,
            habitat: 0,
            home: i.is_multiple_of(5).then_some(DVec3::new(0.0, -5.0, 0.0)),
            seed: i.into(),
        }
    };
    let starts: Vec<Start> = (0..300).map(start).collect();
    let habitat = Habitat { low, high: low + DVec3::splat(8.0) };
    let mut shoal = Shoal::new(kinds.to_vec(), vec![habitat], &starts).expect("a shoal");
    let current =
        Flow { kind: abi::FLOW_DIRECTIONAL, axis: [1.0, 0.0, 0.0], strength: 0.05, ..Flow::default() };
    let wave = abi::Wave {
        amplitude: 0.2,
        wave_number: 0.3,
        frequency: 1.6,
        direction: [1.0, 0.0],
        ..abi::Wave::default()
    };
    for _ in 0..60 {
        shoal.step(&Surroundings {
            flow: &[current],
            bed: None,
            waves: Waves { trains: &[wave], depth: 9.0, factor: 1.0, camera: None },
            obstacles: &[],
            strangers: &[],
            surface: 0.0,
            hosts: &[Host {
                position: DVec3::new(0.0, -5.0, 0.0),
                radius: 0.3,
                id: 1,
                species: abi::fnv1a_32(b"host"),
            }],
            eye: DVec3::new(0.0, -5.0, 0.0),
            near: 2.0,
            dt: 1.0 / 60.0,
            level: Level::best(),
            workers,
        });
    }
    (shoal.save(), shoal.flows().to_vec())
}

#[test]
fn a_shoal_is_the_same_bytes_with_one_worker_or_four() {
    let one = shoal(Workers::inline());
    assert!(!one.1.is_empty() && one.0.near.contains(&0) && one.0.near.contains(&1));
    for count in [1, 2, 4] {
        assert!(with_workers(count, shoal) == one, "{count} workers");
    }
}
