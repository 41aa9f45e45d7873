//! `reef scene`: errors without running, the JSON Schema for editors, the reference for people.

use std::path::{Path, PathBuf};

use reef_command::{Common, open};
use reef_plugin::Registry;
use reef_report::{
    diagnostic,
    failure::{Failure, Outcome},
    say::{say, shown},
};
use reef_sea::{
    Options, World,
    scene::{reference, schema},
};
use serde_json::json;

/// Options of `reef scene`.
#[derive(clap::Args, Clone, Debug)]
pub struct Args {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// Subcommands of `reef scene`.
#[derive(clap::Subcommand, Clone, Debug)]
pub enum Command {
    /// Checks scenes without running them: their modules are made, and no step is taken.
    Check {
        /// Scenes to check: files, or names of those in assets/scenes.
        #[arg(required = true)]
        scenes: Vec<PathBuf>,
    },
    /// Prints the JSON Schema of scenes, with the tables of all plugins that are found.
    Schema,
    /// Prints the reference of all keys as Markdown (assets/scenes/README.md).
    Reference,
}

/// Runs the subcommand.
pub fn run(common: &Common, args: &Args) -> Outcome {
    let mut plugins = open::plugins(common)?;
    if !matches!(args.command, Command::Check { .. }) {
        // What is told is told of all.
        plugins.wake();
    }
    match &args.command {
        Command::Check { scenes } => {
            let mut answers = Vec::new();
            let mut failed = None;
            for path in scenes {
                match check(common, path, &plugins) {
                    Ok(name) if common.json => {
                        answers.push(json!({ "scene": shown(path), "ok": true, "name": name }));
                    }
                    Ok(_) => say(format_args!("{}: fine", path.display())),
                    Err(failure) => {
                        if common.json {
                            let error = failure.to_string();
                            answers.push(json!({ "scene": shown(path), "ok": false, "error": error }));
                        }
                        // The last failure ends the command; those before it are told here.
                        if let Some(before) = failed.replace(failure) {
                            diagnostic::tell(&before.report);
                        }
                    }
                }
            }
            if common.json {
                say(json!(answers));
            }
            failed.map_or(Ok(()), Err)
        }
        Command::Schema => {
            let text = serde_json::to_string_pretty(&schema::merged(plugins.infos().map(|info| &**info)));
            say(text.map_err(|error| Failure::input(miette::miette!("{error}")))?);
            Ok(())
        }
        Command::Reference => {
            let text = reference::markdown(plugins.infos().map(|info| &**info));
            say(text.trim_end());
            Ok(())
        }
    }
}

/// Reads a scene and makes its sea, because modules look at what no schema says; the scene's name.
fn check(common: &Common, path: &Path, plugins: &Registry) -> Result<String, Failure> {
    let scene = open::scene(common, path, plugins)?;
    let name = scene.name.clone();
    let options = Options { seed: common.seed, ..Options::default() };
    World::new(scene, plugins, &options).map_err(Failure::input)?;
    Ok(name)
}
