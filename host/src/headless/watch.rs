//! `reef sim SCENE --watch`: the sea in real time without a window, while plugins are rebuilt and the scene is edited.

use std::time::{Duration, Instant};

use serde_json::json;

use super::sim::Args;
use crate::{
    cli::Common,
    failure::{Failure, Outcome},
    live::{Gravity, Live, REMEMBER, sleep_until},
    open::{self, say},
    plugin::{Health, pinned},
    world::{Options, World},
};

/// How late steps begin [s], by when they were due.
#[derive(Clone, Debug, Default)]
pub struct Lateness {
    /// The latest.
    pub worst: f64,
    /// Steps that began more than one step's length after they were due.
    pub late: u64,
}

/// Steps a world at the pace of its clock until `steps` are made, tending to what changes between them. `after` is called
/// after each step with the world, what is live, and whether the step was the first of newer instances.
pub fn pace(
    live: &mut Live,
    world: &mut World,
    steps: u64,
    mut after: impl FnMut(&mut Live, &mut World, bool) -> bool,
) -> Lateness {
    let dt = Duration::from_secs_f64(world.clock().dt);
    let mut lateness = Lateness::default();
    let mut due = Instant::now() + dt;
    let mut swapped = false;
    for _ in 0..steps {
        loop {
            swapped |= live.tend(world).swapped;
            if Instant::now() >= due {
                break;
            }
            sleep_until(due);
        }
        let late = due.elapsed().as_secs_f64();
        lateness.worst = lateness.worst.max(late);
        if late > dt.as_secs_f64() {
            lateness.late += 1;
            // What is lost is lost: a slow machine shows a slow sea.
            due = Instant::now();
        }
        world.step();
        if !after(live, world, std::mem::take(&mut swapped)) {
            break;
        }
        due += dt;
    }
    lateness
}

/// Runs until it is ended, or `--steps` are made.
pub fn run(common: &Common, args: &Args) -> Outcome {
    let plugins = open::plugins(common)?;
    let scene = open::scene(common, &args.scene, &plugins)?;
    let options = Options { seed: common.seed, remember: Some(REMEMBER), ..Options::default() };
    let mut world = World::new(scene, &plugins, &options).map_err(Failure::input)?;
    let mut live = open::live(common, plugins, &world)?;
    if let Some(path) = &args.journal {
        world.write_journal_to(path).map_err(Failure::input)?;
    }
    let modules: Vec<&str> = world.modules().map(|(name, _)| name).collect();
    if !common.json {
        say(format_args!("{}: watching {}", world.scene().name, modules.join(", ")));
    }
    let mut first = Vec::new();
    let lateness = pace(&mut live, &mut world, args.steps.unwrap_or(u64::MAX), |live, world, is_first| {
        for notice in live.take_notices() {
            tell(common, notice.step, &notice.text, notice.gravity == Gravity::Trouble);
        }
        for message in world.take_messages() {
            tell(common, message.step, &format!("{}: {}", message.module, message.text), true);
        }
        if is_first {
            first.push(world.clock().step);
        }
        args.journal.is_some() || open::is_heard()
    });
    world.flush_journal().map_err(Failure::input)?;
    let counts = live.counts();
    if common.json {
        say(json!({
            "scene": world.scene().name,
            "step": world.clock().step,
            "reloads": counts.reloads,
            "refusals": counts.refusals,
            "takeovers": counts.takeovers,
            "first_steps": first,
            "pinned": pinned(),
            "late_steps": lateness.late,
            "latest_ms": lateness.worst * 1e3,
        }));
    }
    let running = |module| world.instance(module).is_some_and(|i| *i.health() == Health::Running);
    if (0..world.modules().len()).all(running) {
        return Ok(());
    }
    Err(Failure::check(miette::miette!("a module failed on the way and stands still (see above)")))
}

fn tell(common: &Common, step: u64, text: &str, trouble: bool) {
    if common.json {
        say(json!({ "step": step, "text": text, "trouble": trouble }));
    } else {
        say(format_args!("step {step}: {text}"));
    }
}
