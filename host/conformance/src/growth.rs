//! Nothing grows: not from step to step, nor from instance to instance, nor from load to load.

use std::time::{Duration, Instant};

use reef_plugin::bare::{
    imports::Kind,
    process::{Held, heap},
};

use super::{
    sea::Sea,
    state::kept,
    step::FULL,
    subject::{Subject, WORKERS, run},
    table::{
        Check, Of,
        Rule::{Guide, Header},
    },
    verdict::{Not, Outcome, must},
};

const FREES: &str = "Never crosses: what one side allocated, that side frees.";
const NO_MEMORY: &str = "After the first few steps a step should ask the system for no memory at all.";

pub(super) const CHECKS: &[Check] = &[
    Check {
        name: "growth-allocations",
        about: "After the first steps no step asks the system for memory.",
        rule: Guide(NO_MEMORY),
        needs: FULL,
        of: Of::Plugin,
        run: allocations,
    },
    Check {
        name: "growth-steps",
        about: "10 000 steps leave no more memory, files or threads behind than a hundred.",
        rule: Guide(NO_MEMORY),
        needs: &["step-long"],
        of: Of::Plugin,
        run: steps,
    },
    Check {
        name: "growth-instances",
        about: "Instances that are made, stepped and destroyed leave no memory behind.",
        rule: Header(FREES),
        needs: &["destroy-stepped"],
        of: Of::Plugin,
        run: instances,
    },
    Check {
        name: "growth-states",
        about: "Saving and loading leave no memory behind.",
        rule: Header(FREES),
        needs: &["state-bytes"],
        of: Of::Plugin,
        run: states,
    },
    Check {
        name: "growth-loads",
        about: "A library that is loaded and closed again and again leaves no memory, files or mappings behind.",
        rule: Header(FREES),
        needs: &["load-again", "close-unmaps", "close-files"],
        of: Of::Library,
        run: loads,
    },
];

fn allocations(subject: &Subject) -> Outcome {
    let (plugin, mut instance) = subject.fresh()?;
    run(&mut instance, &Sea::full(), 0..100)?;
    let imports = plugin.library().watch_imports().map_err(Not::There)?;
    let (count, name) = imports.count(Kind::Memory, || {
        // Whether it steps is for other checks.
        let _ = run(&mut instance, &Sea::full(), 100..400);
    });
    must!(
        count == 0,
        "300 steps after the first 100 asked for memory {count} times, by {name} the last time"
    );
    Ok(None)
}

const STEPS: u64 = 10_000;
/// Steps before anything is counted.
const WARM: u64 = 200;
/// What the host and the C library may take meanwhile for reasons of their own [bytes].
const SLACK: u64 = 4096;

/// What must not be more than before: memory of the heap above `slack`, files, threads.
fn no_more(before: &Held, after: &Held, slack: u64, what: &str) -> Outcome {
    let grown = after.heap.saturating_sub(before.heap);
    must!(grown <= slack, "{what} left {grown} bytes on the heap");
    for (name, before, after) in
        [("files", before.files, after.files), ("threads", before.threads, after.threads)]
    {
        must!(after <= before, "{what} left {} {name}", after - before);
    }
    Ok(None)
}

fn steps(subject: &Subject) -> Outcome {
    let (_plugin, mut instance) = subject.fresh()?;
    let sea = Sea::usual();
    run(&mut instance, &sea, 0..WARM)?;
    let before = Held::now();
    // A large sea gets as many steps as there is time for.
    let end = Instant::now() + subject.limit.mul_f64(0.7).min(Duration::from_secs(600));
    let mut made = 0;
    while made < STEPS && Instant::now() < end {
        run(&mut instance, &sea, WARM + made..WARM + made + 100)?;
        made += 100;
    }
    let after = Held::after(&before);
    // Two bytes a step would be seen.
    no_more(&before, &after, made.max(WARM) + SLACK, &format!("{made} steps"))?;
    Ok(Some(format!("{made} steps")))
}

fn instances(subject: &Subject) -> Outcome {
    // Some models take a tenth of a second to grow.
    const COUNT: u64 = 24;
    let plugin = subject.load(WORKERS)?;
    let one = || {
        let mut instance = subject.create(&plugin)?;
        run(&mut instance, &Sea::usual(), 0..3)
    };
    (0..8).try_for_each(|_| one())?;
    let before = Held::now();
    (0..COUNT).try_for_each(|_| one())?;
    no_more(&before, &Held::after(&before), 64 * COUNT + SLACK, &format!("{COUNT} instances"))
}

fn states(subject: &Subject) -> Outcome {
    const COUNT: u64 = 500;
    let (_plugin, mut instance) = kept(subject)?;
    let state = instance.save()?;
    let mut round = || {
        drop(instance.save()?);
        instance.load(&state)?;
        Ok::<(), Not>(())
    };
    (0..50).try_for_each(|_| round())?;
    let before = heap();
    (0..COUNT).try_for_each(|_| round())?;
    let grown = heap().saturating_sub(before);
    must!(grown <= 16 * COUNT + SLACK, "{COUNT} saves and loads left {grown} bytes on the heap");
    Ok(None)
}

fn loads(subject: &Subject) -> Outcome {
    const COUNT: u64 = 12;
    const ROUNDS: usize = 3;
    let one = || subject.open(1).map(drop);
    (0..4).try_for_each(|_| one())?;
    // The C library maps an arena for each thread that finds the others taken, up to a limit. What leaks
    // leaks in each round.
    let mut least = u64::MAX;
    for _ in 0..ROUNDS {
        let before = Held::now();
        (0..COUNT).try_for_each(|_| one())?;
        let after = Held::after(&before);
        // What the host itself keeps of a loading is little; a library's memory is more.
        no_more(&before, &after, 1024 * COUNT + SLACK, &format!("{COUNT} loadings"))?;
        least = least.min(after.mappings.saturating_sub(before.mappings) as u64);
        if least < COUNT / 2 {
            break;
        }
    }
    must!(least < COUNT / 2, "each {COUNT} loadings left {least} mappings or more");
    Ok(None)
}
