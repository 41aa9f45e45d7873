//! Back to the beginning.

use reef_plugin::Instance;

use super::{
    sea::Sea,
    step::WORKS,
    subject::{Subject, difference, emitted, offers, payload, run, set},
    table::{Check, Of, Rule::Header},
    verdict::{Not, Outcome, broken},
};

pub(super) const CHECKS: &[Check] = &[
    check("reset-fresh", "A fresh instance can be reset.", WORKS, fresh),
    check("reset-works", "An instance that stepped can be reset.", WORKS, works),
    check(
        "reset-state",
        "After reset() the state is that of a fresh instance.",
        &["reset-works", "step-full"],
        state,
    ),
    check(
        "reset-repeats",
        "After reset() the same steps give the same again.",
        &["reset-works", "step-full"],
        repeats,
    ),
];

const fn check(
    name: &'static str,
    about: &'static str,
    needs: &'static [&'static str],
    run: fn(&Subject) -> Outcome,
) -> Check {
    let rule = Header("Back to the state after create(), parameters included.");
    Check { name, about, rule, needs, of: Of::Plugin, run }
}

/// Resets it, if it offers that.
fn reset(instance: &mut Instance) -> Result<(), Not> {
    if !offers(instance, "reset") {
        return Err(Not::There("it has no reset".into()));
    }
    Ok(instance.reset()?)
}

fn fresh(subject: &Subject) -> Outcome {
    let (_plugin, mut instance) = subject.fresh()?;
    reset(&mut instance)?;
    run(&mut instance, &Sea::usual(), 0..5)?;
    Ok(None)
}

fn works(subject: &Subject) -> Outcome {
    let (_plugin, mut instance) = subject.stepped(20)?;
    for _ in 0..3 {
        reset(&mut instance)?;
        run(&mut instance, &Sea::usual(), 0..5)?;
    }
    Ok(None)
}

/// Steps with other parameters than the defaults.
fn astray(instance: &mut Instance) -> Result<(), Not> {
    let values: Vec<(u32, f64)> =
        instance.info().params.iter().map(|param| (param.id, param.maximum)).collect();
    run(instance, &Sea::full(), 0..10)?;
    set(instance, &values)?;
    run(instance, &Sea::usual(), 10..20)
}

fn state(subject: &Subject) -> Outcome {
    let (_plugin, mut instance) = subject.fresh()?;
    if !offers(&instance, "save_state") {
        return Err(Not::There("it saves no state".into()));
    }
    let before = payload(&mut instance)?;
    astray(&mut instance)?;
    reset(&mut instance)?;
    match difference(&before, &payload(&mut instance)?) {
        Some(difference) => broken!("the state after create() and the one after reset(): {difference}"),
        None => Ok(None),
    }
}

fn repeats(subject: &Subject) -> Outcome {
    let (plugin, mut instance) = subject.fresh()?;
    astray(&mut instance)?;
    reset(&mut instance)?;
    let mut fresh = subject.create(&plugin)?;
    for number in 0..30 {
        run(&mut instance, &Sea::usual(), number..number + 1)?;
        run(&mut fresh, &Sea::usual(), number..number + 1)?;
        if let Some(difference) = difference(&emitted(fresh.outputs()), &emitted(instance.outputs())) {
            broken!("step {number} of a fresh instance and of one that was reset: {difference}");
        }
    }
    Ok(None)
}
