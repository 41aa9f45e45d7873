//! `reef validate`: scenes under the validation layers, compared with their golden pictures.

use crate::{
    cli::Common,
    failure::{Failure, Outcome},
};

use std::path::PathBuf;

/// Options of `reef validate`.
#[derive(clap::Args, Clone, Debug)]
pub struct Args {
    /// Scenes; all of assets/scenes without any.
    pub scenes: Vec<PathBuf>,
    /// Write the golden pictures anew.
    #[arg(long)]
    pub bless: bool,
    /// Write an HTML page with expected, actual and difference.
    #[arg(long, value_name = "DIR")]
    pub report: Option<PathBuf>,
}

/// Renders each scene, fails on any message or mismatch.
pub fn run(common: &Common, args: &Args) -> Outcome {
    let _ = (common, args);
    Err(Failure::machine(miette::miette!("not built yet")))
}
