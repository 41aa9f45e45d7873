//! `reef bench shoal`: fish-steps a second of a shoal of points on the host's workers, beside a bare kernel
//! of as many points in the same rounds.

use reef_command::Common;
use reef_fish_model::shoal::bare::Bare;
use reef_flow::Level;
use reef_report::failure::Failure;

use super::{
    cells::figure,
    fibre::running,
    measure::{Work, best, rounds},
    report::{Bar, Report},
    swimmers::{As, BYTES, WATER, kind, sea},
};

/// Points that are compared with the bare kernel's, and those of the largest shoal.
const COUNT: usize = 20_000;
const MOST: usize = 100_000;
/// Rounds in which everything takes its turn.
const ROUNDS: usize = 40;

/// Measures.
pub fn run(common: &Common) -> Result<Report, Failure> {
    let level = Level::best();
    let mut bare = Bare::new(&kind()?, COUNT, WATER);
    let mut one = sea(common, 1, COUNT, As::Points)?;
    let mut two = sea(common, 2, COUNT, As::Points)?;
    let mut most = sea(common, 2, MOST, As::Points)?;
    let things: Vec<Work<'_>> = vec![
        Box::new(|| bare.step(level)),
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
    const UNIT: &str = "M fish-steps/s";
    report.figure(format!("bare kernel, one core, {}: the ceiling", level.name()), rate(0, COUNT), UNIT);
    report.figure("neighbours of each that it takes note of", bare.noted(), "");
    report.figure("a shoal, one worker", rate(1, COUNT), UNIT);
    report.figure("a shoal, two workers", rate(2, COUNT), UNIT);
    let share = 100.0 * rate(1, COUNT) / rate(0, COUNT);
    report.judged("the shoal's share of the ceiling", share, "%", Bar::AtLeast(60.0));
    report.two_workers(best(&seen, 1) / best(&seen, 2));
    let step = 1e3 * best(&seen, 3);
    report.judged("a step of 100 000 points, two workers", step, "ms", Bar::AtMost(8.0));
    report.judged("memory of a point", figure(&most, BYTES), "B", Bar::AtMost(96.0));
    report.note(format!(
        "A fish-step: what one fish perceives, wants and does in a step, in still water without a bed, and nothing drawn. \
         {COUNT} points of one kind in water of {WATER} cubic lengths each, where it is not said otherwise. {ROUNDS} short rounds \
         in which all take turns of some steps; each one's best counts. The bare kernel sorts as many points that stay where \
         they are, and works out Reynolds' three rules for each."
    ));
    Ok(report)
}
