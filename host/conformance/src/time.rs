//! How long steps take, in the processor's time of one thread: a busy machine condemns nobody.

use std::time::Instant;

use reef_plugin::{Instance, bare::process::processor_time};

use super::{
    sea::{DT, Sea},
    subject::{Subject, step},
    table::{Check, Of, Rule::Guide},
    verdict::{Not, Outcome, must},
};

const WATCHED: &str = "after 250 ms of work `should_stop` answers 1";

pub(super) const CHECKS: &[Check] = &[
    Check {
        name: "time-step",
        about: "Half of the steps take less than a step's length.",
        rule: Guide("The sea runs in steps of equal length, 1/60 s unless the scene says otherwise."),
        needs: &["step-full"],
        of: Of::Plugin,
        run: median,
    },
    Check {
        name: "time-spread",
        about: "No step takes much longer than others.",
        rule: Guide(WATCHED),
        needs: &["step-full"],
        of: Of::Plugin,
        run: spread,
    },
];

/// Steps before anything is measured, and steps that are.
const STEPS: [u64; 2] = [60, 120];

/// Processor time of each of many steps on one worker [s], in order of size.
fn times(subject: &Subject) -> Result<Vec<f64>, Not> {
    let plugin = subject.load(1)?;
    let mut instance = subject.create(&plugin)?;
    let sea = Sea::full();
    let end = Instant::now() + subject.limit.mul_f64(0.6);
    let mut times = Vec::new();
    for number in 0..STEPS[0] + STEPS[1] {
        let time = one(&mut instance, &sea, number)?;
        if number >= STEPS[0] || Instant::now() > end {
            times.push(time);
        }
        if Instant::now() > end && times.len() > 20 {
            break;
        }
    }
    times.sort_by(f64::total_cmp);
    Ok(times)
}

/// One step, in processor time of the control thread [s].
fn one(instance: &mut Instance, sea: &Sea, number: u64) -> Result<f64, Not> {
    let library = instance.plugin().library().clone();
    let now = || library.on_control(processor_time).map_err(Not::Kept);
    let before = now()?;
    step(instance, &sea.input(number), &[])?;
    Ok((now()? - before) as f64 * 1e-9)
}

/// The time within which this share of the steps ended [s].
fn within(times: &[f64], share: f64) -> f64 {
    let last = times.len().saturating_sub(1) as f64;
    times.get((share * last).round() as usize).copied().unwrap_or(0.0)
}

fn ms(seconds: f64) -> String {
    format!("{:.3} ms", 1e3 * seconds)
}

fn median(subject: &Subject) -> Outcome {
    let median = within(&times(subject)?, 0.5);
    must!(median <= DT, "half of the steps take more than {}; a step is {} long", ms(median), ms(DT));
    Ok(Some(ms(median)))
}

fn spread(subject: &Subject) -> Outcome {
    let times = times(subject)?;
    let (median, most) = (within(&times, 0.5), within(&times, 0.96));
    // Below half a millisecond a cache that somebody else emptied counts for more than the plugin's work.
    must!(
        most <= 5.0 * median + 5e-4,
        "of 100 steps four take more than {}; half of them less than {}",
        ms(most),
        ms(median)
    );
    Ok(Some(format!(
        "median {}, 96 of 100 within {}, longest {}",
        ms(median),
        ms(most),
        ms(within(&times, 1.0))
    )))
}
