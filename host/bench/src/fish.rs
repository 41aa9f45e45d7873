//! `reef bench fish`: spring-sub-steps a second of the fish's bodies, by both methods, beside bare kernels
//! over hot data in the same rounds; and a shoal of ten thousand bodies on the host's workers.

use glam::DVec3;
use reef_command::Common;
use reef_fish_model::{
    Plan,
    bare::Bare,
    material::{Drive, Method},
    tank::{Stepping, Swimmer, Tank},
};
use reef_flow::Level;
use reef_report::failure::Failure;
use reef_sdk::Workers;

use super::{
    cells::figure,
    fibre::running,
    measure::{Work, best, rounds},
    report::{Bar, Report},
    swimmers::{As, BYTES, kind, sea},
};

/// Bodies of a tank, of the seas that one and two workers step, and of the largest.
const TANK: usize = 400;
const COUNT: usize = 2000;
const MOST: usize = 10_000;
/// Length of a step [s], and sub-steps of it, of 4 ms or so as in the thesis.
const DT: f64 = 1.0 / 60.0;
const SUBSTEPS: usize = 4;
/// Rounds in which everything takes its turn.
const ROUNDS: usize = 40;

/// Measures.
pub fn run(common: &Common) -> Result<Report, Failure> {
    let level = Level::best();
    let plan = kind()?.plan;
    let springs = plan.body().springs().len();
    let [mut implicit, mut symplectic] = [(); 2].map(|()| Bare::new(plan.clone()));
    let [mut implicit_tank, mut symplectic_tank] = [(); 2].map(|()| tank(&plan));
    let mut one = sea(common, 1, COUNT, As::Bodies)?;
    let mut two = sea(common, 2, COUNT, As::Bodies)?;
    let mut most = sea(common, 2, MOST, As::Bodies)?;
    let step = |tank: &mut Tank, method: Method| {
        let stepping = Stepping { method, ..Stepping::default() };
        tank.step_all(DT, &stepping, level, Workers::inline());
    };
    let things: Vec<Work<'_>> = vec![
        Box::new(|| symplectic.step(level, Method::Symplectic)),
        Box::new(|| step(&mut symplectic_tank, Method::Symplectic)),
        Box::new(|| implicit.step(level, Method::Implicit)),
        Box::new(|| step(&mut implicit_tank, Method::Implicit)),
        Box::new(|| one.step()),
        Box::new(|| two.step()),
        Box::new(|| most.step()),
    ];
    let seen = rounds(things, ROUNDS);
    for world in [&mut one, &mut two, &mut most] {
        running(world)?;
    }
    let rate = |column: usize, count: usize| count as f64 / best(&seen, column) / 1e6;
    let mut report = Report::default();
    const UNIT: &str = "M spring-sub-steps/s";
    let tanks = TANK * springs * SUBSTEPS;
    let methods = [
        ("symplectic", 0, symplectic.spring_substeps(), 60.0),
        ("implicit", 2, implicit.spring_substeps(), 50.0),
    ];
    for (name, column, bare, bar) in methods {
        let ceiling = rate(column, bare);
        let bodies = rate(column + 1, tanks);
        report.figure(format!("{name}: bare kernel, one core, {}", level.name()), ceiling, UNIT);
        report.figure(format!("{name}: bodies"), bodies, UNIT);
        report.judged("their share of the ceiling", 100.0 * bodies / ceiling, "%", Bar::AtLeast(bar));
    }
    report.figure("bodies in a shoal, one worker", rate(4, COUNT * springs * SUBSTEPS), UNIT);
    report.two_workers(best(&seen, 4) / best(&seen, 5));
    let step = 1e3 * best(&seen, 6);
    report.judged("a step of 10 000 bodies in a shoal, two workers", step, "ms", Bar::AtMost(1e3 / 60.0));
    report.judged("memory of a fish", figure(&most, BYTES), "B", Bar::AtMost(4000.0));
    report.note(format!(
        "A spring-sub-step: one spring of a body, for a quarter of a step of 1/60 s, with its share of skin and solver. {ROUNDS} \
         short rounds in which all take turns of some steps; each one's best counts. The bare kernels: eight fish, nothing \
         gathered. A shoal's step has all that fish perceive and want, in still water without a bed, and nothing drawn."
    ));
    Ok(report)
}

/// Bodies that swim beside each other.
fn tank(plan: &Plan) -> Tank {
    let drive = Drive { speed: 2.0, force: 0.2, ..Drive::default() };
    let place = |i: usize| Swimmer { drive, ..Swimmer::at(DVec3::X * i as f64) };
    Tank::new(plan.clone(), (0..TANK).map(place).collect(), &[])
}
