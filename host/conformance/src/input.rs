//! A step's input belongs to the host, and to this step.

use super::{
    sea::Sea,
    subject::{Subject, offers},
    table::{Check, Of, Rule::Header},
    verdict::{Not, Outcome, broken},
};
use reef_abi as abi;
use reef_plugin::{
    StepStatus,
    bare::pages::{Pages, Withheld},
};

pub(super) const CHECKS: &[Check] = &[
    Check {
        name: "input-unwritten",
        about: "A step writes nothing into its input.",
        rule: Header("int32_t (*step)(void *ctx, const reef_step *input, const reef_output *output);"),
        needs: &["step-full", "step-poke"],
        of: Of::Plugin,
        run: unwritten,
    },
    Check {
        name: "input-forgotten",
        about: "Nothing of a step's input is looked at after the step.",
        rule: Header("Everything reachable from a step's input is valid during that step only."),
        needs: &["step-full", "step-poke"],
        of: Of::Plugin,
        run: forgotten,
    },
];

/// Room for the largest input of these checks [bytes].
const ROOM: usize = 1 << 18;

fn stepped(subject: &Subject, withheld: Withheld, what: &str) -> Outcome {
    let lacking = |error: std::io::Error| Not::There(format!("the machine has no memory: {error}"));
    // Taken in turns: what the last step's input was stays out of reach in this one.
    let mut pages = [Pages::new(ROOM).map_err(lacking)?, Pages::new(ROOM).map_err(lacking)?];
    let (_plugin, mut instance) = subject.fresh()?;
    let sea = Sea::full();
    let touch = abi::Event { kind: abi::EVENT_POKE, point: [0.0, -4.0, 0.0], ..Default::default() };
    for number in 0..20 {
        let report =
            instance.step_from(&mut pages[number as usize % 2], &sea.input(number), &[touch], withheld);
        if matches!(report.status, StepStatus::Failed | StepStatus::Standing) {
            broken!("{what}, step {number}: {}", report.message.unwrap_or_default());
        }
        if withheld == Withheld::Afterwards && offers(&instance, "save_state") {
            instance.save()?;
        }
    }
    Ok(None)
}

fn unwritten(subject: &Subject) -> Outcome {
    stepped(subject, Withheld::Writing, "with an input that cannot be written to")
}

fn forgotten(subject: &Subject) -> Outcome {
    stepped(subject, Withheld::Afterwards, "with the inputs of former steps taken away")
}
