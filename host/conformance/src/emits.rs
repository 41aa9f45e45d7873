//! A plugin that steps, and does nothing with it.

use super::{
    sea::Sea,
    subject::{Subject, emitted, step},
    table::{Check, Of, Rule::Header},
    verdict::{Outcome, broken},
};
use reef_plugin::StepStatus;
use reef_streams::Outputs;

pub(super) const CHECKS: &[Check] = &[
    Check {
        name: "step-refused",
        about: "Not every step is refused.",
        rule: Header("this step is refused, the state is untouched; the last good outputs stay"),
        needs: &["step-runs"],
        of: Of::Plugin,
        run: refused,
    },
    Check {
        name: "step-emits",
        about: "Something is emitted in the first second.",
        rule: Header("What a step emits."),
        needs: &["step-refused"],
        of: Of::Plugin,
        run: emits,
    },
];

/// Steps in the first second.
const SECOND: u64 = 60;

fn refused(subject: &Subject) -> Outcome {
    let (_plugin, mut instance) = subject.fresh()?;
    for number in 0..SECOND {
        if step(&mut instance, &Sea::usual().input(number), &[])? != StepStatus::Discarded {
            return Ok(None);
        }
    }
    broken!("it refused each of the first {SECOND} steps")
}

fn emits(subject: &Subject) -> Outcome {
    let (_plugin, mut instance) = subject.fresh()?;
    let nothing = emitted(&Outputs::default());
    for number in 0..SECOND {
        step(&mut instance, &Sea::usual().input(number), &[])?;
        if emitted(instance.outputs()) != nothing {
            return Ok(None);
        }
    }
    broken!("none of the first {SECOND} steps emitted anything")
}
