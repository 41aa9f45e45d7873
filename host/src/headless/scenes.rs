//! `reef scene`: errors without running, and the JSON Schema for editors.

use crate::{
    cli::Common,
    failure::{Failure, Outcome},
};

use std::path::PathBuf;

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
    /// Checks scenes without running them.
    Check {
        /// Scenes to check.
        #[arg(required = true)]
        scenes: Vec<PathBuf>,
    },
    /// Prints the JSON Schema of scenes.
    Schema,
}

/// Runs the subcommand.
pub fn run(common: &Common, args: &Args) -> Outcome {
    let _ = (common, args);
    Err(Failure::machine(miette::miette!("not built yet")))
}
