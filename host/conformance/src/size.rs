//! Growth of the contract: structs of hosts that are older or newer than this plugin.

use reef_abi as abi;
use reef_plugin::{
    StepStatus,
    bare::calls::{Bare, Newer},
};

use super::{
    sea::Sea,
    state::kept,
    step::FULL,
    subject::{Subject, WORKERS, difference, emitted, payload, run, step},
    table::{Check, Of, Rule::Header},
    verdict::{Not, Outcome, broken, must},
};

const READS: &str = "A reader takes min(size, sizeof) bytes and treats the rest as zero";
const WRITES: &str = "a writer never writes past the caller's size.";

pub(super) const CHECKS: &[Check] = &[
    check(
        "size-instance-less",
        "Into a smaller table create() writes no more than fits.",
        WRITES,
        &["destroy-fresh"],
        instance_less,
    ),
    check(
        "size-instance-more",
        "Into a larger table create() writes what it knows, and says how much that is.",
        WRITES,
        &["destroy-fresh"],
        instance_more,
    ),
    check("size-host", "A host with more services is fine.", READS, &["step-full", "destroy-stepped"], host),
    check("size-step", "A step's input with more fields is fine.", READS, FULL, step_input),
    check("size-output", "An output with more functions is fine.", READS, FULL, output),
    check("size-writer", "A writer with more fields is fine.", READS, &["state-bytes"], writer),
    check("size-reader", "A reader with more fields is fine.", READS, &["state-bytes"], reader),
];

const fn check(
    name: &'static str,
    about: &'static str,
    rule: &'static str,
    needs: &'static [&'static str],
    run: fn(&Subject) -> Outcome,
) -> Check {
    Check { name, about, rule: Header(rule), needs, of: Of::Plugin, run }
}

fn instance_less(subject: &Subject) -> Outcome {
    let plugin = subject.load(WORKERS)?;
    let text = subject.create_text(&plugin)?;
    let given = std::mem::offset_of!(abi::Instance, get_param) as u32;
    let filled = plugin.create_sized(&text, given)?;
    must!(filled.kept, "given a table of {given} bytes, create() wrote behind it");
    if filled.status != abi::OK {
        return Ok(Some("refused".into()));
    }
    must!(
        filled.size <= given,
        "given a table of {given} bytes, create() says that it filled {}",
        filled.size
    );
    Ok(None)
}

fn instance_more(subject: &Subject) -> Outcome {
    let plugin = subject.load(WORKERS)?;
    let text = subject.create_text(&plugin)?;
    let known = size_of::<abi::Instance>() as u32;
    let filled = plugin.create_sized(&text, known + 64)?;
    let why = filled.message.unwrap_or_default();
    must!(filled.status == abi::OK, "given a table of {} bytes, create() failed: {why}", known + 64);
    must!(
        filled.size == known,
        "given a table of {} bytes, of which it knows {known}, create() says that it filled {}",
        known + 64,
        filled.size
    );
    Ok(None)
}

fn host(subject: &Subject) -> Outcome {
    let plugin = subject.load(WORKERS)?;
    let text = subject.create_text(&plugin)?;
    let mut instance = plugin.create_in_grown_host(&text)?;
    run(&mut instance, &Sea::full(), 0..10)?;
    instance.destroy()?;
    Ok(None)
}

/// Steps with a newer struct must emit what steps with the known one do.
fn newer(subject: &Subject, newer: Newer, what: &str) -> Outcome {
    let (plugin, mut plain) = subject.fresh()?;
    let mut other = subject.create(&plugin)?;
    for number in 0..10 {
        step(&mut plain, &Sea::full().input(number), &[])?;
        let report = other.step_newer(&Sea::full().input(number), &[], newer);
        if matches!(report.status, StepStatus::Failed | StepStatus::Standing) {
            broken!("given {what}, step {number}: {}", report.message.unwrap_or_default());
        }
        if let Some(difference) = difference(&emitted(plain.outputs()), &emitted(other.outputs())) {
            broken!("given {what}, step {number} emits something else: {difference}");
        }
    }
    Ok(None)
}

fn step_input(subject: &Subject) -> Outcome {
    newer(subject, Newer::Step, "a reef_step with more fields")
}

fn output(subject: &Subject) -> Outcome {
    newer(subject, Newer::Output, "a reef_output with more fields")
}

fn writer(subject: &Subject) -> Outcome {
    let (_plugin, mut instance) = kept(subject)?;
    let before = payload(&mut instance)?;
    let bytes = instance.save_bare(usize::MAX, true)?;
    match difference(&before, &bytes) {
        Some(difference) => {
            broken!("given a reef_writer with more fields, the state is another: {difference}")
        }
        None => Ok(None),
    }
}

fn reader(subject: &Subject) -> Outcome {
    let (plugin, mut instance) = kept(subject)?;
    let bytes = payload(&mut instance)?;
    let mut fresh = subject.create(&plugin)?;
    let state = Bare { newer: true, ..Bare::new(&bytes, plugin.info().state_version) };
    fresh
        .load_bare(state)
        .map_err(|(_, error)| Not::Kept(format!("given a reef_reader with more fields: {error}")))?;
    match difference(&bytes, &payload(&mut fresh)?) {
        Some(difference) => {
            broken!("given a reef_reader with more fields, the state is another: {difference}")
        }
        None => Ok(None),
    }
}
