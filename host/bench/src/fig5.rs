//! `reef bench fig5`: how far the paper's jellyfish gets in 20 s, by how often it contracts (Rudolf and Mould
//! 2009, figure 5).

use reef_command::Common;
use reef_flow::Level;
use reef_jellyfish_model::{
    slice::{Build, Gait, Slice},
    water::Grid,
};
use reef_report::failure::Failure;

use super::report::{Bar, Report};

/// Contractions a second of the figure's curves.
const CURVES: [f64; 5] = [0.4, 0.7, 1.0, 1.5, 2.0];
/// Grid and step of the animal [s]; the time that it swims [s].
const CELLS: usize = 100;
const STEP: f64 = 0.005;
const SECONDS: usize = 20;
/// The least way of the animal at 0.7 Hz [m].
const LEAST: f64 = 0.2;

/// Measures.
pub fn run(_: &Common) -> Result<Report, Failure> {
    let ways = CURVES.map(way);
    let mut report = Report::default();
    for (frequency, way) in CURVES.iter().zip(&ways) {
        let each: Vec<String> = way.iter().map(|way| format!("{way:.3}")).collect();
        report.figure(format!("{frequency} Hz: way after {SECONDS} s"), way[way.len() - 1], "m");
        report.note(format!("{frequency} Hz, after every 4 s [m]: {}", each.join(" ")));
    }
    let end = |curve: usize| ways[curve][ways[curve].len() - 1];
    report.judged("way at 0.7 Hz", end(1), "m", Bar::AtLeast(LEAST));
    report.judged("way at 0.7 Hz over that at 0.4 Hz", end(1) / end(0), "×", Bar::AtLeast(1.0));
    report.judged("way at 0.7 Hz over that at 2.0 Hz", end(1) / end(4), "×", Bar::AtLeast(1.0));
    report.figure("way at 0.7 Hz over that at 1.0 Hz", end(1) / end(2), "×");
    report.note(
        "The paper's figure goes to 0.8 m and has its greatest way at 0.7 Hz, as real animals of 40 mm have; no table \
         gives its numbers. Here: its animal on 100 × 100 cells of 4 mm, steps of 5 ms, single precision.",
    );
    Ok(report)
}

/// Where the animal is after every 4 s [m].
fn way(frequency: f64) -> Vec<f64> {
    let build = Build::default();
    let grid =
        Grid { n: CELLS, cell: 10.0 * build.diameter / CELLS as f64, density: 1000.0, viscosity: 1.304e-6 };
    let Ok(mut slice) = Slice::<f32>::new(build, grid) else { return vec![f64::NAN] };
    if slice.set_gait(Gait { frequency, ..Gait::default() }).is_err() {
        return vec![f64::NAN];
    }
    let start = slice.place();
    let steps = (4.0 / STEP) as usize;
    (0..SECONDS / 4)
        .map(|_| {
            (0..steps).for_each(|_| slice.step(Level::best(), STEP));
            (slice.place() - start).y
        })
        .collect()
}
