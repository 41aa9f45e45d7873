//! `reef bench jumps`: a minute of the default sea is played, and remembered as the window does it; then the
//! sea jumps about in it.

use std::{path::Path, time::Instant};

use reef_command::{Common, Past, REMEMBER, open};
use reef_plugin::Registry;
use reef_report::failure::Failure;
use reef_sea::{Options, World, step::state::StateError};

use super::{
    measure::median,
    report::{Bar, Report},
};

/// Steps that are played: a minute.
const MINUTE: u64 = 3600;
/// Jumps.
const JUMPS: u64 = 60;
/// From one jump's goal to the next, modulo the minute: far from each other, and all different.
const STRIDE: u64 = 2_221;

/// Measures.
pub fn run(common: &Common) -> Result<Report, Failure> {
    let plugins: Registry = open::plugins(&Common { workers: Some(2), ..common.clone() })?;
    let scene = open::scene(common, Path::new(open::DEFAULT_SCENE), &plugins)?;
    let history = Past { remember: REMEMBER }.bytes();
    let options = Options { seed: common.seed, history, ..Options::default() };
    let mut world = World::new(scene, &plugins, &options).map_err(Failure::input)?;
    let (mut steps, mut costs) = (Vec::new(), Vec::new());
    for _ in 0..MINUTE {
        world.step();
        steps.push((world.step_seconds() - world.remember_seconds()) * 1e3);
        costs.push(world.remember_seconds() * 1e3);
    }
    let memory = world.memory();
    let mut jumps: Vec<f64> = (1..=JUMPS)
        .map(|number| {
            let goal = 1 + number * STRIDE % MINUTE;
            let began = Instant::now();
            world.go_to(goal).map_err(|error| Failure::check(StateError::from(error)))?;
            world.step_to(goal);
            Ok(began.elapsed().as_secs_f64() * 1e3)
        })
        .collect::<Result<_, Failure>>()?;
    let mean = |of: &[f64]| of.iter().sum::<f64>() / of.len().max(1) as f64;
    let cost = mean(&costs);
    costs.retain(|cost| *cost > 0.01);
    let mut report = Report::default();
    report.figure("a step, without what follows", mean(&steps), "ms");
    report.figure("remembering, mean of all steps", cost, "ms");
    report.figure("remembering, steps that do", costs.len() as f64, "");
    report.figure("remembering in these, median", median(costs.clone()), "ms");
    report.figure("remembering in these, 95 of 100", quantile(&mut costs, 0.95), "ms");
    report.figure("states", memory.states as f64, "");
    let (used, most) = (memory.used as f64 / f64::from(1 << 20), memory.most as f64 / f64::from(1 << 20));
    report.judged("memory of the states", used, "MB", Bar::AtMost(most));
    report.figure("a jump, median", median(jumps.clone()), "ms");
    report.figure("a jump, 95 of 100", quantile(&mut jumps, 0.95), "ms");
    report.figure("a jump, longest", quantile(&mut jumps, 1.0), "ms");
    Ok(report)
}

/// The value that this share of all is not above; NaN of nothing.
fn quantile(of: &mut [f64], share: f64) -> f64 {
    of.sort_by(f64::total_cmp);
    let at = ((of.len() as f64 * share).ceil() as usize).clamp(1, of.len().max(1)) - 1;
    of.get(at).copied().unwrap_or(f64::NAN)
}
