//! `reef render`: frames of a scene to a picture, a folder of pictures or a video.

use crate::{
    cli::Common,
    failure::{Failure, Outcome},
};

use std::path::PathBuf;

/// Options of `reef render`.
#[derive(clap::Args, Clone, Debug)]
pub struct Args {
    /// Scene to render.
    pub scene: PathBuf,
    /// How many frames.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub frames: u64,
    /// file.png (the last frame), a folder (all), file.mp4 or file.webm (through ffmpeg).
    #[arg(long, value_name = "P")]
    pub out: PathBuf,
    /// Frames a second of the result.
    #[arg(long, value_name = "F", default_value_t = 60.0)]
    pub fps: f64,
    /// Second of the scene at which the first frame is taken.
    #[arg(long, value_name = "T", default_value_t = 0.0)]
    pub from: f64,
    /// Size of the picture in pixels.
    #[arg(long, value_name = "WxH")]
    pub size: Option<String>,
}

/// Renders the frames.
pub fn run(common: &Common, args: &Args) -> Outcome {
    let _ = (common, args);
    Err(Failure::machine(miette::miette!("not built yet")))
}
