//! Stepping, in all kinds of seas.

use reef_abi as abi;
use reef_plugin::StepStatus;

use super::{
    sea::Sea,
    subject::{Subject, difference, everything, offers, payload, run, step},
    table::{
        Check, Of, Rule,
        Rule::{Guide, Header},
    },
    verdict::{Not, Outcome, broken, must},
};

/// What most checks need: it steps, and two instances, or states, can be compared.
pub(super) const WORKS: &[&str] =
    &["step-runs", "step-emits", "state-saves", "state-twice", "repeat-instances"];
/// What checks need that load the library more than once.
const AGAIN: &[&str] = &["repeat-instances", "load-again"];
/// What checks in a full sea need.
pub(super) const FULL: &[&str] = &["step-full"];

pub(super) const FIRST: &[Check] = &[Check {
    name: "step-runs",
    about: "The state before the first step is emitted, and the first steps do not fail.",
    rule: Header("number of this step, from 1; 0: the state before the first"),
    needs: &["create-works"],
    of: Of::Plugin,
    run: runs,
}];

pub(super) const CHECKS: &[Check] = &[
    check("step-long", WORKS, "Ten seconds pass without a failure.", Header("done; the outputs count"), long),
    check(
        "step-empty",
        WORKS,
        "A sea without bed, flow, waves, actors and obstacles is fine.",
        Header("NULL only where [opt]."),
        empty,
    ),
    check(
        "step-full",
        WORKS,
        "A sea with much of everything is fine.",
        Header("the scene's, then what plugins emitted in the step before, in fixed order"),
        full,
    ),
    check("step-storm", WORKS, "A current of 5 m/s breaks nothing.", Guide(STABLE), storm),
    check(
        "step-awake",
        WORKS,
        "The first step emits something to stay.",
        Header("nothing changed since the last step: the last outputs stay"),
        awake,
    ),
    check(
        "step-sleep",
        WORKS,
        "A step that says REEF_SLEEP changed nothing.",
        Header("nothing changed since the last step: the last outputs stay, flow and actors included"),
        sleep,
    ),
    check(
        "step-zero",
        &["step-awake"],
        "A step of no length changes nothing.",
        Header("[s]; 0: emit the present state, change nothing"),
        zero,
    ),
    check(
        "step-trace",
        &["step-zero"],
        "Being recorded changes nothing.",
        Header("emit the trace stream; dt = 0 with it: only emit, do not advance"),
        trace,
    ),
    check(
        "step-debug",
        &["step-zero"],
        "Emitting debug lines changes nothing.",
        Header("emit debug lines"),
        debug,
    ),
    check(
        "step-unseen",
        &["step-full"],
        "A step that nobody looks at is to others, and to later steps, as one that is seen.",
        Header("what is asked for, and the state after the step are those of a step that is seen"),
        unseen,
    ),
    check(
        "step-lengths",
        &["repeat-instances", "load-again"],
        "Steps may be shorter and longer.",
        Guide(STABLE),
        lengths,
    ),
    check(
        "step-late",
        AGAIN,
        "A sea may be old: numbers of steps have 64 bits.",
        Header("number of this step, from 1"),
        late,
    ),
    check(
        "step-poke",
        WORKS,
        "A touch is survived.",
        Header("somebody touched the sea at `point`, at a speed of `value` [m/s]; object: what was hit"),
        poke,
    ),
    check(
        "step-message",
        WORKS,
        "A step that is refused says why.",
        Header("Every failure carries a message: call reef_host.set_error first."),
        message,
    ),
];

const STABLE: &str = "is stable at any length and exactly still for `dt = 0`";

const fn check(
    name: &'static str,
    needs: &'static [&'static str],
    about: &'static str,
    rule: Rule,
    run: fn(&Subject) -> Outcome,
) -> Check {
    Check { name, about, rule, needs, of: Of::Plugin, run }
}

fn runs(subject: &Subject) -> Outcome {
    subject.stepped(3)?;
    Ok(None)
}

/// Steps in one sea.
fn pass(subject: &Subject, sea: &Sea, steps: u64) -> Outcome {
    let (_plugin, mut instance) = subject.fresh()?;
    run(&mut instance, sea, 0..steps)?;
    Ok(None)
}

fn long(subject: &Subject) -> Outcome {
    pass(subject, &Sea::usual(), 600)
}

fn empty(subject: &Subject) -> Outcome {
    pass(subject, &Sea::empty(), 60)
}

fn full(subject: &Subject) -> Outcome {
    pass(subject, &Sea::full(), 120)
}

fn storm(subject: &Subject) -> Outcome {
    pass(subject, &Sea::storm(), 300)
}

fn zero(subject: &Subject) -> Outcome {
    let (_plugin, mut instance) = subject.fresh()?;
    let sea = Sea::usual();
    for number in 0..20 {
        step(&mut instance, &sea.input(number), &[])?;
        let before = everything(&mut instance)?;
        step(&mut instance, &reef_plugin::StepInput { dt: 0.0, ..sea.input(number) }, &[])?;
        if let Some(difference) = difference(&before, &everything(&mut instance)?) {
            broken!("after step {number}, one with dt = 0 changed outputs or state: {difference}");
        }
    }
    Ok(None)
}

fn lengths(subject: &Subject) -> Outcome {
    for dt in [1.0 / 240.0, 1.0 / 30.0, 0.1] {
        let sea = Sea { dt, ..Sea::usual() };
        pass(subject, &sea, 120).map_err(|not| of(not, &format!("with steps of {dt:.4} s")))?;
    }
    Ok(None)
}

/// Says in which sea it was.
fn of(not: Not, sea: &str) -> Not {
    match not {
        Not::Kept(why) => Not::Kept(format!("{sea}: {why}")),
        other => other,
    }
}

fn late(subject: &Subject) -> Outcome {
    for later in [u64::from(u32::MAX) - 5, 1 << 40] {
        let sea = Sea { later, ..Sea::usual() };
        pass(subject, &sea, 20).map_err(|not| of(not, &format!("from step {later} on")))?;
    }
    Ok(None)
}

/// A run with these flags must leave what a run without them leaves.
fn unchanged(subject: &Subject, flags: u32, what: &str) -> Outcome {
    let (plugin, mut plain) = subject.fresh()?;
    let mut flagged = subject.create(&plugin)?;
    let (sea, other) = (Sea::usual(), Sea { flags, ..Sea::usual() });
    for number in 0..30 {
        step(&mut plain, &sea.input(number), &[])?;
        step(&mut flagged, &other.input(number), &[])?;
        // With dt = 0 once more, as the host asks for a recording's first step.
        step(&mut flagged, &reef_plugin::StepInput { dt: 0.0, ..other.input(number) }, &[])?;
        if let Some(difference) = difference(&everything(&mut plain)?, &everything(&mut flagged)?) {
            broken!("{what}, step {number} gives other outputs or another state: {difference}");
        }
    }
    Ok(None)
}

fn trace(subject: &Subject) -> Outcome {
    unchanged(subject, abi::STEP_TRACE, "asked for a recording")
}

fn debug(subject: &Subject) -> Outcome {
    unchanged(subject, abi::STEP_DEBUG, "asked for debug lines")
}

/// Of so many steps the last is seen, and others of them are asked for traces and debug lines.
const LOOKS: u64 = 10;
const ASKS: u64 = 3;

fn unseen(subject: &Subject) -> Outcome {
    let (plugin, mut seen) = subject.fresh()?;
    let mut unseen = subject.create(&plugin)?;
    for number in 0..=6 * LOOKS {
        let looks = number.is_multiple_of(LOOKS);
        let asked = if number.is_multiple_of(ASKS) { abi::STEP_TRACE | abi::STEP_DEBUG } else { 0 };
        let sea = Sea { flags: asked, ..Sea::full() };
        let flags = if looks { asked } else { asked | abi::STEP_UNSEEN };
        run(&mut seen, &sea, number..number + 1)?;
        run(&mut unseen, &Sea { flags, ..Sea::full() }, number..number + 1)?;
        if looks {
            if let Some(difference) = difference(&everything(&mut seen)?, &everything(&mut unseen)?) {
                broken!("step {number}, which is seen after some that are not, is another: {difference}");
            }
            continue;
        }
        for (stream, _, bytes) in seen.outputs().all_bytes() {
            let other = unseen.outputs().bytes(stream.number).map_or(&[][..], |(_, bytes)| bytes);
            if !stream.shows
                && let Some(difference) = difference(bytes, other)
            {
                let name = stream.name;
                broken!(
                    "of step {number}, which nobody looks at, the stream {name} is another: {difference}"
                );
            }
        }
        if offers(&seen, "save_state")
            && let Some(difference) = difference(&payload(&mut seen)?, &payload(&mut unseen)?)
        {
            broken!("after step {number}, which nobody looks at, the state is another: {difference}");
        }
    }
    Ok(None)
}

fn poke(subject: &Subject) -> Outcome {
    let (_plugin, mut instance) = subject.fresh()?;
    let sea = Sea::usual();
    for number in 0..10 {
        let object = instance.outputs().objects.first().map_or(0, |object| object.id);
        let touch = |object| abi::Event {
            kind: abi::EVENT_POKE,
            object,
            point: [0.1, -4.0, 0.2],
            ..Default::default()
        };
        step(&mut instance, &sea.input(number), &[touch(0), touch(object)])?;
    }
    Ok(None)
}

fn message(subject: &Subject) -> Outcome {
    let (_plugin, mut instance) = subject.fresh()?;
    let mut refused = 0;
    for number in 0..120 {
        let report = instance.step(&Sea::usual().input(number), &[]);
        if report.status == StepStatus::Discarded {
            refused += 1;
            let silent = report.message.as_deref().is_none_or(|message| message == "it gave no reason");
            must!(!silent, "step {number} returned REEF_DISCARD without a message");
        }
    }
    match refused {
        0 => Ok(None),
        n => Ok(Some(format!("{n} steps refused"))),
    }
}

fn sleep(subject: &Subject) -> Outcome {
    let (_plugin, mut instance) = subject.fresh()?;
    let mut slept = 0;
    for number in 0..120 {
        let before = if offers(&instance, "save_state") { payload(&mut instance)? } else { Vec::new() };
        if step(&mut instance, &Sea::usual().input(number), &[])? != StepStatus::Sleep {
            continue;
        }
        slept += 1;
        if offers(&instance, "save_state")
            && let Some(difference) = difference(&before, &payload(&mut instance)?)
        {
            broken!("step {number} returned REEF_SLEEP, and the state is another: {difference}");
        }
    }
    match slept {
        0 => Err(Not::There("it never sleeps".into())),
        n => Ok(Some(format!("{n} of 120 steps"))),
    }
}

fn awake(subject: &Subject) -> Outcome {
    let (_plugin, mut instance) = subject.fresh()?;
    let sleeps = |status| status == StepStatus::Sleep;
    must!(!sleeps(step(&mut instance, &Sea::usual().input(0), &[])?), "the first step returned REEF_SLEEP");
    Ok(None)
}
