//! `reef doctor`: devices, drivers, layers, what is missing and the command that installs it.

use crate::{
    cli::Common,
    failure::{Failure, Outcome},
};

/// Options of `reef doctor`.
#[derive(clap::Args, Clone, Debug)]
pub struct Args {}

/// Looks at the machine and prints what it found.
pub fn run(common: &Common, args: &Args) -> Outcome {
    let _ = (common, args);
    Err(Failure::machine(miette::miette!("not built yet")))
}
