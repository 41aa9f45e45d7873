//! `reef sim`: steps without a GPU; hashes, recordings, states.

use std::{
    collections::BTreeSet,
    io::{IsTerminal, Write},
    path::{Path, PathBuf},
    time::Instant,
};

use reef_command::{Common, Past, open};
use reef_files as files;
use reef_files::Writing;
use reef_plugin::{Library, Noted};
use reef_report::{
    failure::{Failure, Outcome},
    say::{self, say},
};
use reef_sea::{
    Options, World,
    reload::{REMEMBER, swap::Swap},
    step::{
        hash::{Chain, hex},
        journal::Journal,
        record,
        rescue::Rescue,
    },
};
use serde_json::json;

use super::jumps;

/// Options of `reef sim`.
#[derive(clap::Args, Clone, Debug)]
pub struct Args {
    /// Scene to step: a file, or the name of one in assets/scenes.
    pub scene: PathBuf,
    /// How many steps; with --watch without an end where it is not given.
    #[arg(long, value_name = "N", required_unless_present_any = ["watch", "at"])]
    pub steps: Option<u64>,
    /// Go to this second of the sea and print the hash of that moment; may be repeated, forward and back.
    #[arg(
        long,
        value_name = "T",
        value_parser = super::render::moment,
        conflicts_with_all = ["steps", "watch", "hash", "record", "save_state", "reload_at"]
    )]
    pub at: Vec<f64>,
    /// What is remembered on the way.
    #[command(flatten)]
    pub past: Past,
    /// In real time, taking up newer builds of plugins, and edits of the scene and its species, as they are
    /// saved.
    #[arg(long, conflicts_with_all = ["hash", "record", "load_state", "save_state", "replay", "reload_at"])]
    pub watch: bool,
    /// Load all plugins anew before this step: hashes must not change.
    #[arg(long, value_name = "STEP", hide = true)]
    pub reload_at: Option<u64>,
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
    /// Record this stream only, as the plugin names what it traces; may be repeated. The sea's own is `flow`.
    #[arg(long, value_name = "NAME", requires = "record")]
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
    if args.watch {
        return super::watch::run(common, args);
    }
    let steps = args.steps.unwrap_or_default();
    let options = Options {
        trace: args.record.is_some(),
        remember: args.reload_at.map(|_| REMEMBER),
        history: if args.at.is_empty() { 0 } else { args.past.bytes() },
        ..Options::default()
    };
    let mut world = open::world(common, &args.scene, options)?;
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
    distinct(&[
        ("--record", args.record.as_deref()),
        ("--save-state", args.save_state.as_deref()),
        ("--journal", args.journal.as_deref()),
    ])?;
    let in_order = files::in_order();
    // All files are begun before the first step: nobody should wait for an answer that cannot be written.
    let mut recording = args.record.as_deref().map(Writing::create).transpose().map_err(Failure::input)?;
    let mut state = args.save_state.as_deref().map(Writing::create).transpose().map_err(Failure::input)?;
    if let Some(path) = &args.journal {
        world.write_journal_to(path).map_err(Failure::input)?;
    }
    let filter = record::Filter {
        plugins: args.plugin.clone(),
        streams: args.stream.clone(),
        objects: args.object.clone(),
    };
    let told = |out: &Writing| {
        let part = out.part().display();
        Noted::new(format!("What was recorded, but for its last lines, is in {part}."))
    };
    let noted = recording.as_ref().map(told);
    if let Some(out) = &mut recording {
        check_filter(&world, &filter)?;
        writeln!(out, "{}", record::COLUMNS).map_err(|error| Failure::input(out.error(&error)))?;
        if args.load_state.is_none() {
            record::write(&world, &filter, out).map_err(|error| Failure::input(out.error(&error)))?;
        }
    }
    let beside = args.save_state.as_deref().or(args.journal.as_deref());
    let mut rescue = beside.map(|file| Rescue::beside(Some(file)));
    let writes = args.record.is_some() || args.save_state.is_some() || args.journal.is_some();
    let hashing = args.hash || args.save_state.is_some();
    let plain = !common.json;
    let bar = say::progress(steps, "steps", plain && !(args.hash && std::io::stdout().is_terminal()));
    let mut hashes = Vec::new();
    let began = Instant::now();
    let mut simulated = 0.0;
    let mut broken = None;
    let moments = jumps::visit(&mut world, &args.at, plain, &in_order, |world| {
        if let Some(rescue) = &mut rescue {
            rescue.keep(world, None);
        }
    })?;
    let mut made = 0;
    while made < steps && in_order.asked().is_none() {
        if args.reload_at == Some(world.clock().step + 1) {
            reload(&mut world, open::workers(common))?;
        }
        world.step();
        simulated += world.step_seconds();
        if let Some(out) = &mut recording
            && world.clock().step % args.every == 0
        {
            record::write(&world, &filter, out).map_err(|error| Failure::input(out.error(&error)))?;
        }
        if hashing {
            match chain.add(&mut world) {
                Ok(digest) if args.hash && plain => {
                    say(format_args!("step {} {}", world.clock().step, hex(&digest)));
                }
                Ok(digest) if args.hash => hashes.push(hex(&digest)),
                Ok(_) => {}
                // A module that stands still has no state: no hash or state can be given from here on.
                Err(error) => {
                    broken = Some((world.clock().step, error));
                    break;
                }
            }
        }
        if let Some(rescue) = &mut rescue {
            rescue.keep(&mut world, hashing.then_some(&chain));
        }
        bar.inc(1);
        made += 1;
        if !writes && !say::is_heard() {
            break;
        }
    }
    bar.finish_and_clear();
    let interrupted = (made < steps || moments.len() < args.at.len()) && broken.is_none();
    if let Some(signal) = in_order.asked().filter(|_| interrupted) {
        // Half a recording, or a state of another step, is not what was asked for: what stood there stays.
        tracing::warn!(
            step = world.clock().step,
            "ended by {signal}: no recording and no state is written{}",
            if args.journal.is_some() { ", but the journal up to here" } else { "" }
        );
        (recording, state) = (None, None);
    }
    // It is in its place now, or gone.
    drop(noted);
    if let Some(recording) = recording {
        recording.finish().map_err(Failure::input)?;
    }
    if let Some((step, error)) = broken {
        world.flush_journal().map_err(Failure::input)?;
        return Err(Failure::check(miette::miette!(
            help = "what was recorded up to there, and the journal, are kept",
            "step {step}: no hash and no state from here on: {error}"
        )));
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
            "steps": made,
            "step": world.clock().step,
            "time": world.clock().time(),
            "seconds": began.elapsed().as_secs_f64(),
            "step_seconds": simulated,
            "hash": args.hash.then(|| hex(&chain.digest)),
            "hashes": hashes,
            "moments": moments,
            "messages": messages,
        }));
    } else {
        jumps::tell(&world, &moments);
        let per_step = if made > 0 { simulated / made as f64 * 1e3 } else { 0.0 };
        say(format_args!(
            "{}: {} steps to {:.3} s of the sea, {per_step:.3} ms a step",
            world.scene().name,
            made,
            world.clock().time()
        ));
        if args.hash {
            say(format_args!("hash {}", hex(&chain.digest)));
        }
    }
    if world.modules().enumerate().any(|(at, _)| {
        use reef_plugin::Health;
        world.instance(at).is_some_and(|instance| *instance.health() != Health::Running)
    }) {
        return Err(Failure::check(miette::miette!(
            "a module failed on the way and stands still (see above)"
        )));
    }
    Ok(())
}

/// Loads the libraries of all modules anew and lets the new instances take their places.
fn reload(world: &mut World, workers: usize) -> Outcome {
    let mut paths: Vec<PathBuf> = world.modules().filter_map(|(_, info)| info.path.clone()).collect();
    paths.sort();
    paths.dedup();
    for path in paths {
        let failed = |problem: String| Failure::check(miette::miette!("{}: {problem}", path.display()));
        let (_, plugins) = Library::load(&path, workers).map_err(|refusal| failed(refusal.to_string()))?;
        let job = world.order_reload(&plugins).map_err(|error| failed(error.to_string()))?;
        let Some(job) = job else { continue };
        let outcome = std::thread::scope(|scope| {
            scope.spawn(|| job.work(|| {}));
            loop {
                match world.swap(&job) {
                    Swap::NotYet => std::thread::yield_now(),
                    outcome => break outcome,
                }
            }
        });
        match outcome {
            Swap::Failed(problem) => return Err(failed(problem)),
            outcome => drop(outcome),
        }
    }
    Ok(())
}

/// Of results with the same path only the last one would be left.
fn distinct(results: &[(&str, Option<&Path>)]) -> Outcome {
    let mut places: Vec<(&str, PathBuf)> = Vec::new();
    for (option, path) in results.iter().filter_map(|(option, path)| Some((*option, (*path)?))) {
        let here = files::target(path).map_err(Failure::input)?;
        if let Some((other, _)) = places.iter().find(|(_, there)| *there == here) {
            return Err(Failure::input(miette::miette!(
                help = "each result needs a file of its own",
                "{other} and {option} lead to the same file, {}",
                path.display()
            )));
        }
        places.push((option, here));
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
    let traces = world.modules().flat_map(|(_, info)| info.traces.iter().map(String::as_str));
    let streams: BTreeSet<&str> = traces.chain([record::FLOW]).collect();
    match filter.streams.iter().find(|wanted| !streams.contains(wanted.as_str())) {
        Some(wanted) => {
            let known: Vec<&str> = streams.into_iter().collect();
            Err(Failure::input(miette::miette!(
                "--stream {wanted}: nothing in this scene is recorded by that name; it has {}",
                known.join(", ")
            )))
        }
        None => Ok(()),
    }
}
