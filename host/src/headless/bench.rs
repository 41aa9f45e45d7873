//! `reef bench`: the measured figures of this machine.

use crate::{
    cli::Common,
    failure::{Failure, Outcome},
};

/// Options of `reef bench`.
#[derive(clap::Args, Clone, Debug)]
pub struct Args {
    /// Which bench; all without a name.
    pub name: Option<String>,
}

/// Measures and prints.
pub fn run(common: &Common, args: &Args) -> Outcome {
    let _ = (common, args);
    Err(Failure::machine(miette::miette!("not built yet")))
}
