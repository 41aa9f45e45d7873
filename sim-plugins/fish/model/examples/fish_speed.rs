//! Where the time of a step goes on one core: `cargo run -p reef-fish-model --example fish_speed [FISH
//! [LEVEL]]`: bodies by both methods beside the bare kernel, and a shoal of five times as many points. LEVEL:
//! the least `REEF_SIMD_*` that is measured.

use std::time::Instant;

use glam::DVec3;
use reef_fish_model::{
    Plan,
    bare::Bare,
    body::{Body, Profile},
    material::{Beat, Drive, Material, Method},
    shoal::{Habitat, Kind, Shoal, Start, Surroundings, Waves, bare::Bare as BarePoints},
    species::Species,
    tank::{Stepping, Swimmer, Tank},
};
use reef_flow::Level;
use reef_sdk::Workers;

const DT: f64 = 1.0 / 60.0;

/// The shortest time of some runs [s].
fn shortest(runs: usize, mut run: impl FnMut()) -> f64 {
    let time = |_| {
        let start = Instant::now();
        run();
        start.elapsed().as_secs_f64()
    };
    (0..runs).map(time).fold(f64::INFINITY, f64::min)
}

/// Cubic lengths of water that each fish of a shoal begins with.
const WATER: f64 = 2.0;

/// So many fish of the default species.
fn shoal(count: usize) -> Shoal {
    let kind = Kind::new(&Species::default(), Vec::new()).expect("the default species");
    // They begin in the middle of it.
    let side = kind.length() * (WATER * count as f64).cbrt() / 0.8;
    let low = DVec3::new(0.0, -100.0, 0.0);
    let start = |i: usize| {
        let place = |factor: f64| 0.1 + 0.8 * (i as f64 * factor).fract();
        let place = DVec3::new(place(0.754_877_666), place(0.569_840_291), place(0.430_159_709));
        let (position, heading) = (low + place * side, i as f64);
        Start { kind: 0, position, heading, size: 1.0, habitat: 0, home: None, seed: i as u64 }
    };
    let starts: Vec<Start> = (0..count).map(start).collect();
    Shoal::new(vec![kind], vec![Habitat { low, high: low + side }], &starts).expect("a shoal")
}

/// What is around them: nothing; bodies nearer than `near` [m] to their middle.
fn around(near: f64, level: Level) -> Surroundings<'static> {
    Surroundings {
        flow: &[],
        bed: None,
        waves: Waves::default(),
        obstacles: &[],
        strangers: &[],
        surface: 0.0,
        hosts: &[],
        eye: DVec3::new(0.0, -100.0, 0.0),
        near,
        dt: DT,
        level,
        workers: Workers::inline(),
    }
}

fn main() {
    let mut arguments = std::env::args().skip(1).map(|text| text.parse().expect("a number"));
    let count: usize = arguments.next().unwrap_or(400);
    let least = arguments.next().unwrap_or(0) as u32;
    let body = Body::new(&Profile::default()).expect("the default body");
    let plan = Plan::new(&body, &Material::default(), &Beat::default()).expect("the default material");
    for level in Level::all().into_iter().filter(|level| level.code() >= least) {
        println!("{}", level.name());
        for (name, method) in [("implicit", Method::Implicit), ("symplectic", Method::Symplectic)] {
            let mut bare = Bare::new(plan.clone());
            let time = shortest(200, || bare.step(level, method));
            let ceiling = bare.spring_substeps() as f64 / time;
            let place = |i: usize| Swimmer {
                drive: Drive { speed: 2.0, force: 0.2, ..Drive::default() },
                ..Swimmer::at(DVec3::X * i as f64)
            };
            let mut tank = Tank::new(plan.clone(), (0..count).map(place).collect(), &[]);
            let stepping = Stepping { method, ..Stepping::default() };
            let time = shortest(20, || tank.step_all(DT, &stepping, level, Workers::inline()));
            let speed = (4 * count * body.springs().len()) as f64 / time;
            println!(
                "  {name}: bare {:.0} M spring-substeps/s; {count} fish {:.3} ms a step, {:.0} M/s, {:.0} % of bare",
                ceiling * 1e-6,
                time * 1e3,
                speed * 1e-6,
                100.0 * speed / ceiling
            );
        }
        let kind = Kind::new(&Species::default(), Vec::new()).expect("the default species");
        let mut bare = BarePoints::new(&kind, 5 * count, WATER);
        let time = shortest(20, || bare.step(level));
        println!(
            "  bare points: {:.2} M fish-steps/s, {:.0} neighbours each",
            bare.count() as f64 / time * 1e-6,
            bare.noted()
        );
        for (name, near, count) in [("points", 0.0, 5 * count), ("bodies", 1e9, count)] {
            let mut shoal = shoal(count);
            let around = around(near, level);
            (0..120).for_each(|_| shoal.step(&around));
            let time = shortest(20, || shoal.step(&around));
            println!(
                "  a shoal of {count} {name}: {:.3} ms a step, {:.2} M fish-steps/s",
                time * 1e3,
                count as f64 / time * 1e-6
            );
        }
    }
}
