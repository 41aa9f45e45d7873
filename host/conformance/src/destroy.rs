//! The end of instances.

use super::{
    sea::Sea,
    step::WORKS,
    subject::{Subject, run},
    table::{Check, Of, Rule::Header},
    verdict::Outcome,
};

const LAST: &str = "valid until destroy() returned, or create() returned a failure.";

pub(super) const CHECKS: &[Check] = &[
    Check {
        name: "destroy-stepped",
        about: "An instance that stepped can be destroyed.",
        rule: Header(LAST),
        needs: WORKS,
        of: Of::Plugin,
        run: stepped,
    },
    Check {
        name: "destroy-among",
        about: "Destroying one instance leaves the others whole.",
        rule: Header("`host` is this instance's own"),
        needs: &["destroy-stepped"],
        of: Of::Plugin,
        run: among,
    },
];

fn stepped(subject: &Subject) -> Outcome {
    let (_plugin, instance) = subject.stepped(5)?;
    instance.destroy()?;
    Ok(None)
}

fn among(subject: &Subject) -> Outcome {
    let (plugin, first) = subject.stepped(2)?;
    let mut others = Vec::new();
    for _ in 0..4 {
        let mut instance = subject.create(&plugin)?;
        run(&mut instance, &Sea::usual(), 0..3)?;
        others.push(instance);
    }
    first.destroy()?;
    others.swap_remove(2).destroy()?;
    for instance in &mut others {
        run(instance, &Sea::usual(), 3..6)?;
    }
    for instance in others {
        instance.destroy()?;
    }
    Ok(None)
}
