//! States: all that a later step depends on, in bytes that say the same everywhere.

use reef_abi as abi;
use reef_plugin::{Instance, Plugin, bare::calls::Bare};

use super::{
    param,
    sea::Sea,
    step::FULL,
    subject::{Subject, difference, emitted, everything, offers, payload, run, set, step},
    table::{
        Check, Of, Rule,
        Rule::{Guide, Header},
    },
    verdict::{Not, Outcome, broken, must},
};

const WHOLE: &str = "with it, the sea goes on exactly as if nothing had happened";

/// What most checks of states need.
pub(super) const BYTES: &[&str] = &["state-bytes"];

pub(super) const FIRST: &[Check] = &[
    check(
        "state-saves",
        &["step-runs"],
        "save_state() works at any time.",
        Header("what save_state writes"),
        saves,
    ),
    check(
        "state-twice",
        &["state-saves"],
        "Saving twice gives the same bytes.",
        Header("The payload is the plugin's own, little-endian and without pointers"),
        twice,
    ),
];

pub(super) const CHECKS: &[Check] = &[
    check(
        "state-loads",
        FULL,
        "load_state() takes what save_state() wrote.",
        Header("Where save_state writes and load_state reads."),
        loads,
    ),
    check(
        "state-bytes",
        &["state-loads"],
        "A state that was saved, loaded and saved again is the same bytes.",
        Guide(WHOLE),
        bytes,
    ),
    check(
        "state-goes-on",
        BYTES,
        "After a load the steps go on as if nothing had happened.",
        Guide(WHOLE),
        goes_on,
    ),
    check("state-unseen", &["state-goes-on"], "Saving changes nothing.", Guide(WHOLE), unseen),
    check(
        "state-over",
        &["state-goes-on", "step-storm"],
        "A state can be loaded into an instance that has other plans.",
        Guide(WHOLE),
        over,
    ),
    check(
        "state-back",
        &["state-goes-on"],
        "A state can be loaded into the instance that saved it, again and again.",
        Guide(WHOLE),
        back,
    ),
    check(
        "state-trial",
        &["state-back", "reset-repeats"],
        "After a trial step, a load or a reset makes the instance whole.",
        Header("on the side, before a swap: outputs are checked and thrown away"),
        trial,
    ),
    check(
        "state-short-reads",
        BYTES,
        "A reader may give less than it is asked for.",
        Header("May return fewer than asked before the end."),
        short_reads,
    ),
    check(
        "state-full",
        BYTES,
        "A writer that takes no more makes save_state() fail, and nothing else.",
        Header("Each says in what state the instance is left."),
        full,
    ),
    check(
        "state-steady",
        &["state-bytes", "step-long"],
        "A state does not grow from step to step.",
        Guide("Leave out what follows from the rest"),
        steady,
    ),
];

const fn check(
    name: &'static str,
    needs: &'static [&'static str],
    about: &'static str,
    rule: Rule,
    run: fn(&Subject) -> Outcome,
) -> Check {
    Check { name, about, rule, needs, of: Of::Plugin, run }
}

/// A new instance after some steps, with parameters off their defaults; of a plugin that keeps states.
pub(super) fn kept(subject: &Subject) -> Result<(Plugin, Instance), Not> {
    let (plugin, mut instance) = subject.fresh()?;
    if !offers(&instance, "save_state") || !offers(&instance, "load_state") {
        return Err(Not::There("it does not save and load states".into()));
    }
    run(&mut instance, &Sea::full(), 0..20)?;
    let values: Vec<(u32, f64)> =
        plugin.info().params.iter().map(|param| (param.id, param::other(param))).collect();
    set(&mut instance, &values)?;
    Ok((plugin, instance))
}

fn saves(subject: &Subject) -> Outcome {
    let (plugin, mut instance) = subject.fresh()?;
    if !offers(&instance, "save_state") {
        return Err(Not::There("it has no save_state".into()));
    }
    instance.save()?;
    run(&mut instance, &Sea::usual(), 0..10)?;
    let state = payload(&mut instance)?;
    drop((instance, plugin));
    Ok(Some(format!("{} bytes", state.len())))
}

fn loads(subject: &Subject) -> Outcome {
    let (plugin, mut instance) = kept(subject)?;
    let state = instance.save()?;
    let mut fresh = subject.create(&plugin)?;
    fresh.load(&state)?;
    run(&mut fresh, &Sea::usual(), 21..23)?;
    Ok(None)
}

fn bytes(subject: &Subject) -> Outcome {
    let (plugin, mut instance) = kept(subject)?;
    let before = payload(&mut instance)?;
    let state = instance.save()?;
    let mut fresh = subject.create(&plugin)?;
    fresh.load(&state)?;
    match difference(&before, &payload(&mut fresh)?) {
        Some(difference) => broken!("the state before and after a load: {difference}"),
        None => Ok(None),
    }
}

fn twice(subject: &Subject) -> Outcome {
    let (_plugin, mut instance) = subject.stepped(10)?;
    if !offers(&instance, "save_state") {
        return Err(Not::There("it has no save_state".into()));
    }
    let first = payload(&mut instance)?;
    match difference(&first, &payload(&mut instance)?) {
        Some(difference) => broken!("two states of one instance, with nothing between them: {difference}"),
        None => Ok(None),
    }
}

fn goes_on(subject: &Subject) -> Outcome {
    let (plugin, mut straight) = kept(subject)?;
    let state = straight.save()?;
    let mut loaded = subject.create(&plugin)?;
    loaded.load(&state)?;
    for number in 22..60 {
        run(&mut straight, &Sea::full(), number..number + 1)?;
        run(&mut loaded, &Sea::full(), number..number + 1)?;
        if let Some(difference) = difference(&emitted(straight.outputs()), &emitted(loaded.outputs())) {
            broken!("step {number}, {} steps after a load, emits something else: {difference}", number - 21);
        }
    }
    match difference(&payload(&mut straight)?, &payload(&mut loaded)?) {
        Some(difference) => broken!("38 steps after a load the state is another: {difference}"),
        None => Ok(None),
    }
}

fn unseen(subject: &Subject) -> Outcome {
    let (plugin, mut saved) = kept(subject)?;
    let mut plain = subject.create(&plugin)?;
    plain.load(&saved.save()?)?;
    for number in 22..42 {
        for _ in 0..3 {
            saved.save()?;
        }
        run(&mut saved, &Sea::usual(), number..number + 1)?;
        run(&mut plain, &Sea::usual(), number..number + 1)?;
    }
    match difference(&everything(&mut plain)?, &everything(&mut saved)?) {
        Some(difference) => broken!("20 steps with saves between them give something else: {difference}"),
        None => Ok(None),
    }
}

fn over(subject: &Subject) -> Outcome {
    let (plugin, mut instance) = kept(subject)?;
    let state = instance.save()?;
    let mut other = subject.create(&plugin)?;
    let values: Vec<(u32, f64)> =
        plugin.info().params.iter().map(|param| (param.id, param.maximum)).collect();
    run(&mut other, &Sea::storm(), 0..30)?;
    set(&mut other, &values)?;
    other.load(&state)?;
    run(&mut instance, &Sea::usual(), 22..32)?;
    run(&mut other, &Sea::usual(), 22..32)?;
    match difference(&everything(&mut instance)?, &everything(&mut other)?) {
        Some(difference) => {
            broken!("something of what the instance was before the load is left: {difference}")
        }
        None => Ok(None),
    }
}

fn back(subject: &Subject) -> Outcome {
    let (_plugin, mut instance) = kept(subject)?;
    let state = instance.save()?;
    let mut first = None;
    for turn in 1..=5 {
        instance.load(&state)?;
        run(&mut instance, &Sea::usual(), 22..32)?;
        let now = everything(&mut instance)?;
        let first = first.get_or_insert_with(|| now.clone());
        if let Some(difference) = difference(first, &now) {
            broken!("the steps after load {turn} are not those after load 1: {difference}");
        }
    }
    Ok(None)
}

fn trial(subject: &Subject) -> Outcome {
    let (plugin, mut instance) = kept(subject)?;
    let sea = Sea::usual();
    let tried = Sea { flags: abi::STEP_TRIAL, ..Sea::usual() };
    let state = instance.save()?;
    let mut other = subject.create(&plugin)?;
    // As a reload does: one that begins anew, and one that goes on from a state.
    other.load(&state)?;
    step(&mut other, &tried.input(22), &[])?;
    other.forget();
    other.load(&state)?;
    run(&mut other, &sea, 22..25)?;
    run(&mut instance, &sea, 22..25)?;
    if let Some(difference) = difference(&everything(&mut instance)?, &everything(&mut other)?) {
        broken!("after a trial step and load_state() a step is another: {difference}");
    }
    let mut fresh = subject.create(&plugin)?;
    step(&mut fresh, &tried.input(1), &[])?;
    fresh.forget();
    if offers(&fresh, "reset") {
        fresh.reset()?;
        run(&mut fresh, &sea, 0..3)?;
    }
    Ok(None)
}

fn short_reads(subject: &Subject) -> Outcome {
    let (plugin, mut instance) = kept(subject)?;
    let bytes = payload(&mut instance)?;
    let version = plugin.info().state_version;
    for at_once in [1, 7, 13, 4096] {
        let mut fresh = subject.create(&plugin)?;
        fresh.load_bare(Bare { at_once, ..Bare::new(&bytes, version) }).map_err(|(_, error)| {
            Not::Kept(format!("with a reader that gives {at_once} bytes at once: {error}"))
        })?;
        if let Some(difference) = difference(&bytes, &payload(&mut fresh)?) {
            broken!("read {at_once} bytes at once, the state is another: {difference}");
        }
    }
    Ok(None)
}

fn full(subject: &Subject) -> Outcome {
    let (_plugin, mut instance) = kept(subject)?;
    let before = payload(&mut instance)?;
    if before.is_empty() {
        return Err(Not::There("its state has no bytes".into()));
    }
    for room in [0, before.len() / 2, before.len() - 1] {
        if instance.save_bare(room, false).is_ok() {
            broken!(
                "save_state() returned REEF_OK, though the writer took {room} of {} bytes at most",
                before.len()
            );
        }
    }
    must!(payload(&mut instance)? == before, "after a writer that was full the state is another");
    run(&mut instance, &Sea::usual(), 22..25)?;
    Ok(None)
}

fn steady(subject: &Subject) -> Outcome {
    let (_plugin, mut instance) = kept(subject)?;
    run(&mut instance, &Sea::usual(), 22..200)?;
    let early = payload(&mut instance)?.len();
    run(&mut instance, &Sea::usual(), 200..2000)?;
    let late = payload(&mut instance)?.len();
    // Life may come and go; what grows by a byte in every other step does not stop.
    must!(late < early + 900, "the state has {early} bytes after 200 steps and {late} after 2000");
    Ok(Some(format!("{late} bytes")))
}
