//! The window: events, camera, the panel.

pub mod camera;
#[cfg(target_os = "linux")]
mod connection;
mod gui;
pub mod input;
mod overlay;
pub mod panel;
pub mod pick;
mod screenshot;
mod sea;
mod stage;
mod stir;
mod window;

use std::path::{Path, PathBuf};

use winit::event_loop::EventLoop;
#[cfg(target_os = "linux")]
use winit::platform::x11::EventLoopBuilderExtX11;

#[cfg(target_os = "linux")]
use connection::{Environment, System};
use reef_command::open;
use reef_gpu::packages;
use reef_report::{
    failure::{Failure, Outcome},
    say,
};
use sea::Sea;
use window::{Shell, Wishes};

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
    /// Write the input journal to this file; with --json also the hash that a replay of it must have.
    #[arg(long, value_name = "F")]
    pub journal: Option<PathBuf>,
    /// What is remembered of the past.
    #[command(flatten)]
    pub past: reef_command::Past,
}

/// Largest side of a window [px]: what every Vulkan device can draw.
const LARGEST: u32 = 4096;

/// Opens the window and runs until it is closed.
pub fn run(common: &reef_command::Common, args: &Args) -> Outcome {
    let size = args.size.as_deref().map(parse_size).transpose()?;
    let scene = args.scene.as_deref().unwrap_or(Path::new(open::DEFAULT_SCENE));
    // Nobody compares a run that cannot be replayed.
    let hashed = common.json && args.journal.is_some();
    let sea = Sea::new(common, scene, args.journal.as_deref(), hashed, args.past.bytes())?;
    let event_loop = event_loop()?;
    let wishes = Wishes { frames: args.frames, size, device: common.device.clone() };
    let mut shell = Shell::new(wishes, sea);
    let ran = event_loop.run_app(&mut shell);
    let (sea, frames, failure) = shell.finish();
    let summary = sea.finish(frames)?;
    if let Some(failure) = failure {
        return Err(failure);
    }
    ran.map_err(|error| Failure::machine(miette::miette!("the window system failed: {error}")))?;
    if common.json {
        say::say(serde_json::json!(summary));
    }
    Ok(())
}

/// Connects to the display.
fn event_loop() -> Result<EventLoop<()>, Failure> {
    #[cfg(target_os = "linux")]
    let environment = Environment {
        variable: &|name| std::env::var_os(name),
        answers: &|socket| std::os::unix::net::UnixStream::connect(socket).is_ok(),
    };
    #[cfg(target_os = "linux")]
    let system = environment.system();
    #[cfg(target_os = "linux")]
    if system == Some(System::X11)
        && let Some(wrong) = environment.wrong_scale()
    {
        return Err(Failure::input(miette::miette!(help = connection::SCALES, "{wrong}")));
    }
    // winit panics where it finds a display but not these.
    #[cfg(target_os = "linux")]
    for library in ["libxkbcommon.so.0", "libxkbcommon-x11.so.0"] {
        let needed = library == "libxkbcommon.so.0" || system == Some(System::X11);
        // SAFETY: these libraries run nothing of their own when they are loaded.
        if needed && let Err(error) = unsafe { libloading::Library::new(library) } {
            return Err(no_window(&error));
        }
    }
    let mut builder = EventLoop::builder();
    #[cfg(target_os = "linux")]
    if system == Some(System::X11) {
        EventLoopBuilderExtX11::with_x11(&mut builder);
    }
    builder.build().map_err(|error| no_window(&error))
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
