//! The command line: one subcommand a file in [`crate::headless`], the window without one.

use std::{process::ExitCode, time::Duration};

use clap::{CommandFactory, Parser, error::ErrorKind};
use reef_command::Common;
use reef_plugin::{Limits, offer_patience, probe, set_limits};
use reef_report::{diagnostic, say};

use crate::{app, headless};

/// A living sea: run it, render it, write plugins for it.
#[derive(Parser, Debug)]
#[command(
    name = "reef",
    version,
    subcommand_precedence_over_arg = true,
    after_help = "Examples:\n  \
        reef                                          the default sea in a window\n  \
        reef render reef --frames 60 --out sea.png    a picture of its second second\n  \
        reef sim reef --steps 600 --hash              no GPU: is it the same sea everywhere?\n  \
        reef scene check my-scene.toml                what is wrong with it, and where\n\n\
        Scenes are files, or names of those in assets/scenes, whose README.md explains every key.\n\
        Exit codes: 0 fine, 1 the check failed, 2 usage or bad input, 3 the machine lacks something."
)]
struct Cli {
    #[command(flatten)]
    common: Common,
    #[command(flatten)]
    window: app::Args,
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(clap::Subcommand, Debug)]
enum Command {
    /// Render frames of a scene to a picture, a folder or a video.
    Render(headless::render::Args),
    /// Check scenes under the validation layers against golden pictures.
    Validate(headless::validate::Args),
    /// Step a scene without a GPU: hashes, recordings, states.
    Sim(headless::sim::Args),
    /// What is loaded, and a beginning for a plugin of your own.
    Plugin(headless::plugins::Args),
    /// Check scene files, print their JSON Schema.
    Scene(headless::scenes::Args),
    /// The measured figures of this machine.
    Bench(reef_bench::Args),
    /// Devices, drivers, layers, and what is missing.
    Doctor(headless::doctor::Args),
    /// Compile the shaders that the program embeds.
    #[command(hide = true)]
    Shaders(headless::shaders::Args),
}

/// How long plugins may take in this command: where people wait for pictures, a step that is late is a fault;
/// a run that writes files has no hurry. The checker of plugins holds them to the window's limits, whatever
/// was said.
fn limits(command: Option<&Command>, patience: Option<Duration>) -> Option<Limits> {
    let limits = match command {
        Some(Command::Plugin(_)) => return None,
        Some(Command::Sim(args)) if args.watch => Limits::default(),
        Some(Command::Sim(_) | Command::Render(_) | Command::Validate(_) | Command::Bench(_)) => {
            Limits::offline()
        }
        _ => Limits::default(),
    };
    Some(patience.map_or(limits, |patience| limits.with_patience(patience)))
}

/// Builds that nobody knows are loaded by another process first; the checker has processes of its own.
fn offer_probe(command: Option<&Command>, patience: Option<Duration>) {
    #[cfg(target_os = "linux")]
    if matches!(command, Some(Command::Plugin(args)) if matches!(args.command, headless::plugins::Command::Check(_)))
    {
        return;
    }
    if matches!(command, Some(Command::Shaders(_))) {
        return;
    }
    if let Ok(program) = reef_files::program() {
        let known = reef_files::cache::folder().map(|folder| folder.join("plugins"));
        probe::offer(probe::Probe { program, known, patience });
    }
}

/// Parses the command line, runs the command and turns its outcome into an exit code.
pub fn main() -> ExitCode {
    let cli = Cli::parse();
    if let (Some(_), Some(scene)) = (&cli.command, &cli.window.scene) {
        let told =
            format!("{} stands before the command: the scene of a command follows it", scene.display());
        Cli::command().error(ErrorKind::ArgumentConflict, told).exit();
    }
    #[cfg(target_os = "linux")]
    if let Some(Command::Plugin(headless::plugins::Args { command: headless::plugins::Command::Probe })) =
        &cli.command
    {
        if let Some(patience) = cli.common.patience {
            set_limits(Limits::default().with_patience(patience));
        }
        offer_patience();
        // Before anything starts a thread.
        probe::serve();
    }
    reef_report::log::init();
    offer_probe(cli.command.as_ref(), cli.common.patience);
    if let Err(error) = reef_files::remove_at_signals() {
        tracing::warn!("a signal may leave files named .reef-*.part: {error}");
    }
    let common = &cli.common;
    if let Some(limits) = limits(cli.command.as_ref(), common.patience) {
        set_limits(limits);
        offer_patience();
    }
    let outcome = match &cli.command {
        None => app::run(common, &cli.window),
        Some(Command::Render(args)) => headless::render::run(common, args),
        Some(Command::Validate(args)) => headless::validate::run(common, args),
        Some(Command::Sim(args)) => headless::sim::run(common, args),
        Some(Command::Plugin(args)) => headless::plugins::run(common, args),
        Some(Command::Scene(args)) => headless::scenes::run(common, args),
        Some(Command::Bench(args)) => reef_bench::run(common, args),
        Some(Command::Doctor(args)) => headless::doctor::run(common, args),
        Some(Command::Shaders(args)) => headless::shaders::run(common, args),
    };
    let code = match outcome.and_then(|()| say::all_said()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            diagnostic::tell(&failure.report);
            ExitCode::from(failure.code)
        }
    };
    reef_files::end_as_asked();
    code
}

#[cfg(test)]
mod tests {
    use super::*;

    fn limits_of(words: &str) -> Option<Limits> {
        let cli = Cli::try_parse_from(words.split(' ')).expect("a command line");
        limits(cli.command.as_ref(), cli.common.patience)
    }

    #[test]
    fn only_what_people_look_at_has_a_hurry() {
        let live = Some(Limits::default());
        for words in ["reef", "reef reef", "reef sim reef --watch", "reef sim reef --watch --steps 9"] {
            assert_eq!(limits_of(words), live, "{words}");
        }
        for words in
            ["reef sim reef --steps 9", "reef render reef --out x.png", "reef validate", "reef bench"]
        {
            assert_eq!(limits_of(words), Some(Limits::offline()), "{words}");
            let patient = limits_of(&format!("{words} --patience 1.5")).expect("limits");
            assert_eq!(patient.step, Duration::from_millis(1500), "{words}");
        }
        assert_eq!(limits_of("reef plugin check x.so --patience 9"), None);
        for wrong in ["0", "-1", "nan", "inf", "1e7", "soon"] {
            assert!(Cli::try_parse_from(["reef", "bench", "--patience", wrong]).is_err(), "{wrong}");
        }
    }
}
