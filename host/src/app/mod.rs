//! The window: events, camera, the panel.

pub mod camera;
pub mod input;
mod overlay;
pub mod panel;
pub mod pick;
mod screenshot;

use std::path::PathBuf;

use crate::failure::Outcome;

/// Options of plain `reef [SCENE]`.
#[derive(clap::Args, Clone, Debug)]
pub struct Args {
    /// Scene to open; the default sea without one.
    pub scene: Option<PathBuf>,
    /// Close by itself after this many frames.
    #[arg(long, value_name = "N")]
    pub frames: Option<u64>,
    /// Size of the window's content in pixels.
    #[arg(long, value_name = "WxH")]
    pub size: Option<String>,
    /// Write the input journal to this file.
    #[arg(long, value_name = "F")]
    pub journal: Option<PathBuf>,
}

/// Opens the window and runs until it is closed.
pub fn run(common: &crate::cli::Common, args: &Args) -> Outcome {
    let _ = (common, args);
    Err(crate::failure::Failure::machine(miette::miette!("the window is not built yet")))
}
