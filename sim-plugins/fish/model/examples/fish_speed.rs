//! Where the time of a step goes on one core: `cargo run -p reef-fish-model --example fish_speed [FISH
//! [LEVEL]]`. LEVEL: the least `REEF_SIMD_*` that is measured.

use std::time::Instant;

use glam::DVec3;
use reef_fish_model::{
    Plan,
    bare::Bare,
    body::{Body, Profile},
    material::{Beat, Drive, Material, Method},
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
    }
}
