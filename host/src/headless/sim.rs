//! `reef sim`: steps without a GPU; hashes, recordings, states.

use crate::{
    cli::Common,
    failure::{Failure, Outcome},
};

use std::path::PathBuf;

/// Options of `reef sim`.
#[derive(clap::Args, Clone, Debug)]
pub struct Args {
    /// Scene to step.
    pub scene: PathBuf,
    /// How many steps.
    #[arg(long, value_name = "N")]
    pub steps: u64,
    /// Print one chained hash a step over all streams and state.
    #[arg(long)]
    pub hash: bool,
}

/// Steps the scene.
pub fn run(common: &Common, args: &Args) -> Outcome {
    let _ = (common, args);
    Err(Failure::machine(miette::miette!("not built yet")))
}
