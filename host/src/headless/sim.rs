//! `reef sim`: steps without a GPU; hashes, recordings, states.

use std::{
    io::{IsTerminal, Write},
    path::PathBuf,
    time::Instant,
};

use serde_json::json;

use crate::{
    cli::Common,
    failure::{Failure, Outcome},
    files::Writing,
    open::{self, say},
    world::{
        World,
        hash::{Chain, hex},
        journal::Journal,
        record,
    },
};

/// Options of `reef sim`.
#[derive(clap::Args, Clone, Debug)]
pub struct Args {
    /// Scene to step: a file, or the name of one in assets/scenes.
    pub scene: PathBuf,
    /// How many steps.
    #[arg(long, value_name = "N")]
    pub steps: u64,
    /// Print one hash a step over all streams and states, each chained to the one before.
    #[arg(long)]
    pub hash: bool,
    /// Write where everything was to a CSV file.
    #[arg(long, value_name = "F.csv")]
    pub record: Option<PathBuf>,
    /// Record every K-th step only (step 0 and multiples of K).
    #[arg(long, value_name = "K", default_value_t = 1, requires = "record", value_parser = clap::value_parser!(u64).range(1..))]
    pub every: u64,
    /// Record this plugin (or module of the scene) only; may be repeated. The sea's own flow is `host`.
    #[arg(long, value_name = "ID", requires = "record")]
    pub plugin: Vec<String>,
    /// Record this stream only; may be repeated.
    #[arg(long, value_name = "NAME", requires = "record", value_parser = record::STREAMS)]
    pub stream: Vec<String>,
    /// Record the object with this number only; may be repeated.
    #[arg(long, value_name = "NUMBER", requires = "record")]
    pub object: Vec<u64>,
    /// Begin from a state that was saved.
    #[arg(long, value_name = "F")]
    pub load_state: Option<PathBuf>,
    /// Save the state after the last step.
    #[arg(long, value_name = "F")]
    pub save_state: Option<PathBuf>,
    /// Feed the inputs of a journal, each in its step.
    #[arg(long, value_name = "F")]
    pub replay: Option<PathBuf>,
    /// Write the journal of this run.
    #[arg(long, value_name = "F")]
    pub journal: Option<PathBuf>,
}

/// Steps the scene.
pub fn run(common: &Common, args: &Args) -> Outcome {
    let mut world = open::world(common, &args.scene, args.record.is_some())?;
    let mut chain = Chain::default();
    if let Some(path) = &args.load_state {
        let saved = world.load_from(path).map_err(Failure::input)?;
        chain = saved.unwrap_or_default();
    }
    if let Some(path) = &args.replay {
        let journal = Journal::read(path).map_err(Failure::input)?;
        world
            .replay(journal)
            .map_err(|problem| Failure::input(miette::miette!("{}: {problem}", path.display())))?;
    }
    // All files are begun before the first step: nobody should wait for an answer that cannot be written.
    let mut recording = args.record.as_deref().map(Writing::create).transpose().map_err(Failure::input)?;
    let state = args.save_state.as_deref().map(Writing::create).transpose().map_err(Failure::input)?;
    if let Some(path) = &args.journal {
        world.write_journal_to(path).map_err(Failure::input)?;
    }
    let filter = record::Filter {
        plugins: args.plugin.clone(),
        streams: args.stream.clone(),
        objects: args.object.clone(),
    };
    if let Some(out) = &mut recording {
        check_filter(&world, &filter)?;
        writeln!(out, "{}", record::COLUMNS).map_err(|error| Failure::input(out.error(&error)))?;
        if args.load_state.is_none() {
            record::write(&world, &filter, out).map_err(|error| Failure::input(out.error(&error)))?;
        }
    }
    let hashing = args.hash || args.save_state.is_some();
    let plain = !common.json;
    let bar = open::progress(args.steps, "steps", plain && !(args.hash && std::io::stdout().is_terminal()));
    let mut hashes = Vec::new();
    let began = Instant::now();
    let mut simulated = 0.0;
    for _ in 0..args.steps {
        world.step();
        simulated += world.step_seconds();
        if hashing {
            let digest = chain.add(&mut world).map_err(|error| Failure::check(miette::miette!("{error}")))?;
            if args.hash {
                if plain {
                    say(format_args!("step {} {}", world.clock().step, hex(&digest)));
                } else {
                    hashes.push(hex(&digest));
                }
            }
        }
        if let Some(out) = &mut recording
            && world.clock().step % args.every == 0
        {
            record::write(&world, &filter, out).map_err(|error| Failure::input(out.error(&error)))?;
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    if let Some(recording) = recording {
        recording.finish().map_err(Failure::input)?;
    }
    if let Some(mut file) = state {
        let bytes = world.save(Some(&chain)).map_err(Failure::input)?;
        file.write_all(&bytes).map_err(|error| Failure::input(file.error(&error)))?;
        file.finish().map_err(Failure::input)?;
    }
    world.flush_journal().map_err(Failure::input)?;
    let messages = world.take_messages();
    if common.json {
        let messages: Vec<_> = messages
            .iter()
            .map(|message| json!({ "step": message.step, "module": message.module, "text": message.text }))
            .collect();
        say(json!({
            "scene": world.scene().name,
            "seed": world.seed(),
            "steps": args.steps,
            "step": world.clock().step,
            "time": world.clock().time(),
            "seconds": began.elapsed().as_secs_f64(),
            "step_seconds": simulated,
            "hash": args.hash.then(|| hex(&chain.digest)),
            "hashes": hashes,
            "messages": messages,
        }));
    } else {
        let per_step = if args.steps > 0 { simulated / args.steps as f64 * 1e3 } else { 0.0 };
        say(format_args!(
            "{}: {} steps to {:.3} s of the sea, {per_step:.3} ms a step",
            world.scene().name,
            args.steps,
            world.clock().time()
        ));
        if args.hash {
            say(format_args!("hash {}", hex(&chain.digest)));
        }
    }
    if world.modules().enumerate().any(|(at, _)| {
        use crate::plugin::Health;
        world.instance(at).is_some_and(|instance| *instance.health() != Health::Running)
    }) {
        return Err(Failure::check(miette::miette!(
            "a module failed on the way and stands still (see above)"
        )));
    }
    Ok(())
}

/// A filter that nothing can pass is a slip of the pen.
fn check_filter(world: &World, filter: &record::Filter) -> Outcome {
    for wanted in &filter.plugins {
        let known = wanted == record::HOST
            || world.modules().any(|(name, info)| info.id == *wanted || name == wanted);
        if !known {
            let mut names: Vec<String> =
                world.modules().flat_map(|(name, info)| [info.id.clone(), name.to_owned()]).collect();
            names.push(record::HOST.to_owned());
            names.sort();
            names.dedup();
            return Err(Failure::input(miette::miette!(
                "--plugin {wanted}: this scene has no such plugin or module; it has {}",
                names.join(", ")
            )));
        }
    }
    Ok(())
}
