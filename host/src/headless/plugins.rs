//! `reef plugin`: what is loaded.

use crate::{
    cli::Common,
    failure::{Failure, Outcome},
};

/// Options of `reef plugin`.
#[derive(clap::Args, Clone, Debug)]
pub struct Args {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// Subcommands of `reef plugin`.
#[derive(clap::Subcommand, Clone, Debug)]
pub enum Command {
    /// Lists the plugins that are found, with their parameters.
    List,
}

/// Runs the subcommand.
pub fn run(common: &Common, args: &Args) -> Outcome {
    let _ = (common, args);
    Err(Failure::machine(miette::miette!("not built yet")))
}
