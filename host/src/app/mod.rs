//! The window: events, camera, the panel.

pub mod camera;
mod gui;
pub mod input;
mod overlay;
pub mod panel;
pub mod pick;
mod screenshot;
mod stir;

use std::path::PathBuf;

use crate::{
    failure::{Failure, Outcome},
    gpu::packages,
};

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

/// Largest side of a window [px]: what every Vulkan device can draw.
const LARGEST: u32 = 4096;

/// Opens the window and runs until it is closed.
pub fn run(common: &crate::cli::Common, args: &Args) -> Outcome {
    let size = args.size.as_deref().map(parse_size).transpose()?;
    let _ = (common, size);
    Err(Failure::machine(miette::miette!("the window is not built yet")))
}

fn parse_size(text: &str) -> Result<[u32; 2], Failure> {
    let sides = text.split_once(['x', 'X']).and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    match sides {
        Some(sides) if sides.iter().all(|side| (1..=LARGEST).contains(side)) => Ok(sides),
        _ => Err(Failure::input(miette::miette!(
            help = format!("WxH in pixels, each from 1 to {LARGEST}: --size 640x360"),
            "--size {text}: this is no size"
        ))),
    }
}

/// No window here: what people can do instead.
fn no_window(reason: &dyn std::fmt::Display) -> Failure {
    let help = format!(
        "a window needs a display (DISPLAY or WAYLAND_DISPLAY) and its libraries:\n{}\nwithout a window: reef render \
         SCENE --frames 120 --out picture.png",
        packages::advice(&["window"])
    );
    Failure::machine(miette::miette!(help = help, "no window can be opened: {reason}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_and_nonsense_is_refused() {
        assert_eq!(parse_size("640x360").unwrap(), [640, 360]);
        assert_eq!(parse_size("1X1").unwrap(), [1, 1]);
        for text in ["", "640", "0x1", "1x4097", "ax1", "1x1x1", "-3x4"] {
            assert_eq!(parse_size(text).unwrap_err().code, 2, "{text}");
        }
    }
}
