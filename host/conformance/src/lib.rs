//! `reef plugin check`: does a plugin keep to the contract? One small function a check, each run in a process
//! of its own with a time limit; the families of checks are one file each.

#![cfg(target_os = "linux")]

mod child;
mod close;
mod config;
mod create;
mod descriptor;
mod destroy;
mod emits;
mod entry;
mod group;
mod growth;
mod input;
mod judge;
mod load;
mod manners;
mod output;
mod param;
mod param_table;
mod process;
mod repeat;
mod report;
mod reset;
mod schema;
mod sea;
mod services;
mod size;
mod state;
mod state_refused;
mod step;
mod subject;
mod table;
mod time;
mod verdict;

use std::{
    path::{Path, PathBuf},
    thread,
    time::Duration,
};

use reef_command::Common;
use reef_report::{
    failure::{Failure, Outcome},
    say::say,
};
use reef_sea::scene::words::nearest;

use self::{judge::Judgement, process::Conduct, table::Check, verdict::Verdict};

/// Options of `reef plugin check`.
#[derive(clap::Args, Clone, Debug)]
pub struct Args {
    /// The plugin's library.
    #[arg(value_name = "PATH", required_unless_present = "list")]
    pub path: Option<PathBuf>,
    /// Only the checks of this name, or whose names begin with it; may be repeated.
    #[arg(long, value_name = "NAME")]
    pub only: Vec<String>,
    /// Print the names of all checks and what they are about.
    #[arg(long)]
    pub list: bool,
    /// The configuration of the instances that are made: JSON (the module's table), or a file of it, or a
    /// scene that uses the plugin.
    #[arg(long, value_name = "FILE|JSON")]
    pub config: Option<String>,
    /// Of a library with several plugins, only the one with this id.
    #[arg(long, value_name = "ID")]
    pub plugin: Option<String>,
    /// Longest time that one check may take [s].
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0, value_parser = seconds)]
    pub timeout: f64,
    /// How many checks run at once; as many as there are cores without it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    pub jobs: Option<u16>,
    /// Run the one check here, and write its verdict to this file.
    #[arg(long, value_name = "FILE", hide = true)]
    pub verdict: Option<PathBuf>,
}

/// A time limit.
fn seconds(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(seconds) if (0.1..=86_400.0).contains(&seconds) => Ok(seconds),
        _ => Err("a number of seconds from 0.1 to 86400 is wanted".into()),
    }
}

/// Runs the checks, or, as their child process, one of them.
pub fn run(common: &Common, args: &Args) -> Outcome {
    if args.list {
        say(report::list(common.json).trim_end());
        return Ok(());
    }
    let Some(path) = args.path.as_deref() else {
        return Err(Failure::input(miette::miette!("name the library that is to be checked")));
    };
    let config = config::Config::read(args.config.as_deref()).map_err(Failure::input)?;
    if let Some(verdict) = &args.verdict {
        child::run(common, args, path, config, verdict);
    }
    readable(path)?;
    let wanted = wanted(&args.only)?;
    let conduct = Conduct::new(common, args, path)?;
    let plugins = plugins(args, &conduct)?;
    let jobs = args.jobs.map_or_else(|| thread::available_parallelism().map_or(1, usize::from), usize::from);
    if !common.json {
        say(format_args!("{}", path.display()));
    }
    let several = plugins.len() > 1;
    let judgements = judge::all(&conduct, &plugins, &wanted, jobs, |judgement| {
        if !common.json {
            say(report::line(judgement, several));
        }
    });
    if common.json {
        say(format_args!("{:#}", report::json(path, &judgements)));
    } else {
        say(report::sum(&judgements));
    }
    conclude(&judgements)
}

/// 0, unless a check failed (1), or the plugin could not be tried as it was asked for (2).
fn conclude(judgements: &[Judgement]) -> Outcome {
    let failed =
        judgements.iter().filter(|judgement| matches!(judgement.verdict, Verdict::Failed(_))).count();
    match failed {
        0 => {}
        1 => return Err(Failure::check(miette::miette!("one check failed: see above"))),
        n => return Err(Failure::check(miette::miette!("{n} checks failed: see above"))),
    }
    match judgements.iter().find_map(|judgement| judgement.verdict.unconfigured()) {
        Some(problem) => Err(Failure::input(miette::miette!(
            help = "give the plugin a configuration that it takes: --config FILE|JSON",
            "no instance could be made to check: {problem}"
        ))),
        None => Ok(()),
    }
}

/// A path that leads nowhere is no fault of a plugin.
fn readable(path: &Path) -> Outcome {
    match reef_plugin::inspect::read(path) {
        Ok(_) => Ok(()),
        Err(refusal) => Err(Failure::input(miette::miette!("{}: {refusal}", path.display()))),
    }
}

/// Which checks were asked for: all without a name.
fn wanted(names: &[String]) -> Result<Vec<&'static Check>, Failure> {
    for name in names {
        if !table::all().any(|check| check.is_called(name)) {
            let near = nearest(name, table::all().map(|check| check.name));
            let near = near.map(|near| format!("; did you mean {near:?}?")).unwrap_or_default();
            return Err(Failure::input(miette::miette!(
                help = "reef plugin check --list prints all names",
                "no check is called {name:?}, nor do names begin so{near}"
            )));
        }
    }
    Ok(table::all()
        .filter(|check| names.is_empty() || names.iter().any(|name| check.is_called(name)))
        .collect())
}

/// The ids of the library's plugins that are to be checked; None: the library does not say.
fn plugins(args: &Args, conduct: &Conduct) -> Result<Vec<Option<String>>, Failure> {
    let ids: Vec<String> = match conduct.run(child::PLUGINS, None) {
        Verdict::Passed(Some(ids)) => ids.lines().map(str::to_owned).collect(),
        _ => Vec::new(),
    };
    match &args.plugin {
        None if ids.len() < 2 => Ok(vec![None]),
        None => Ok(ids.into_iter().map(Some).collect()),
        Some(id) if ids.is_empty() || ids.contains(id) => Ok(vec![Some(id.clone())]),
        Some(id) => Err(Failure::input(miette::miette!(
            "there is no plugin {id:?} in this library; it has: {}",
            ids.join(", ")
        ))),
    }
}

/// The longest that one check may take.
fn limit(args: &Args) -> Duration {
    Duration::from_secs_f64(args.timeout)
}
