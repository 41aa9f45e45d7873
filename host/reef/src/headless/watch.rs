//! `reef sim SCENE --watch`: the sea in real time without a window, while plugins are rebuilt and the scene
//! is edited.

use reef_command::{Common, open};
use reef_plugin::{Health, pinned};
use reef_report::{
    failure::{Failure, Outcome},
    say::{self, say},
};
use reef_sea::{
    Options, World,
    reload::{Gravity, REMEMBER, pace},
    step::rescue::Rescue,
};
use serde_json::json;

use super::sim::Args;

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
    let in_order = reef_files::in_order();
    let mut rescue = Rescue::beside(args.journal.as_deref());
    let lateness = pace(&mut live, &mut world, args.steps.unwrap_or(u64::MAX), |live, world, is_first| {
        for notice in live.take_notices() {
            tell(common, notice.step, &notice.text, notice.gravity == Gravity::Trouble);
        }
        for message in world.take_messages() {
            tell(common, message.step, &format!("{}: {}", message.module, message.text), true);
        }
        rescue.keep(world, None);
        if is_first {
            first.push(world.clock().step);
        }
        in_order.asked().is_none() && (args.journal.is_some() || say::is_heard())
    });
    if let Some(signal) = in_order.asked() {
        tracing::warn!(step = world.clock().step, "ended by {signal}");
    }
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
