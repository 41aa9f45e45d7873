//! `reef render`: frames of a scene to a picture, a folder of pictures or a video.

use std::{path::PathBuf, time::Instant};

use reef_command::{Common, open};
use reef_files::InOrder;
use reef_gpu::{Gpu, GpuOptions, Validation};
use reef_render::{Quality, Settings, Studio};
use reef_report::{
    failure::{Failure, Outcome},
    say::{self, say, shown},
};
use serde_json::json;

use super::{show::Show, sink::Sink};

/// Greatest side of a picture [px].
const MOST_PIXELS: u32 = 8192;
/// Size of a picture when none is asked for.
const SIZE: (u32, u32) = (1280, 720);

/// Options of `reef render`.
#[derive(clap::Args, Clone, Debug)]
pub struct Args {
    /// Scene to render: a file, or the name of one in assets/scenes.
    pub scene: PathBuf,
    /// How many frames.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    pub frames: u64,
    /// file.png (the last frame), a folder (all), file.mp4 or file.webm (through ffmpeg).
    #[arg(long, value_name = "P")]
    pub out: PathBuf,
    /// Frames a second of the result.
    #[arg(long, value_name = "F", default_value_t = 60.0, value_parser = rate)]
    pub fps: f64,
    /// Second of the scene at which the first frame is taken.
    #[arg(long, value_name = "T", default_value_t = 0.0, value_parser = moment)]
    pub from: f64,
    /// Size of the picture in pixels.
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<(u32, u32)>,
    /// `low` draws quickly, with simpler water, ground and thin things.
    #[arg(long, value_name = "Q", value_enum, default_value_t = Quality::High)]
    pub quality: Quality,
}

/// Parses `WxH`.
pub fn size(text: &str) -> Result<(u32, u32), String> {
    let parsed = text.split_once(['x', 'X']).and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    match parsed {
        Some((w, h)) if (1..=MOST_PIXELS).contains(&w) && (1..=MOST_PIXELS).contains(&h) => Ok((w, h)),
        Some(_) => Err(format!("each side has 1 to {MOST_PIXELS} pixels")),
        None => Err("a size looks like 1280x720".to_owned()),
    }
}

fn rate(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(rate) if (0.01..=1000.0).contains(&rate) => Ok(rate),
        _ => Err("0.01 to 1000 frames a second".to_owned()),
    }
}

/// Parses a second of the sea.
pub fn moment(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(time) if (0.0..=86_400.0).contains(&time) => Ok(time),
        _ => Err("0 to 86400 seconds".to_owned()),
    }
}

/// Renders the frames.
pub fn run(common: &Common, args: &Args) -> Outcome {
    let in_order = reef_files::in_order();
    let size = args.size.unwrap_or(SIZE);
    // The place of the result is looked at first: nobody should wait for pictures that cannot be kept.
    let mut sink = Sink::open(&args.out, size, args.fps)?;
    let world = open::world(common, &args.scene, reef_sea::Options::default())?;
    let options = GpuOptions::from_environment(common.device.clone(), Validation::Off);
    let gpu = Gpu::open(&options)?;
    let outcome = frames(common, args, size, Show::new(world), &gpu, &mut sink, &in_order);
    gpu.close();
    let Drawn { frames, milliseconds } = match (outcome, in_order.asked()) {
        (Ok(drawn), _) if drawn.frames == args.frames => drawn,
        // A terminal's signal reaches the encoder, too: what it then says is no fault of its own.
        (outcome, Some(signal)) => return cut_short(args, outcome.ok(), sink, signal),
        (outcome, None) => outcome?,
    };
    match (sink.finish(), in_order.asked()) {
        (Err(_), Some(signal)) => return not_written(args, signal),
        (finished, _) => finished?,
    }
    if common.json {
        say(json!({
            "out": shown(&args.out),
            "frames": frames,
            "width": size.0,
            "height": size.1,
            "milliseconds_per_frame": milliseconds,
        }));
    } else {
        say(format_args!(
            "{}: {} of {}x{}, {milliseconds:.1} ms each",
            args.out.display(),
            if frames == 1 { "1 frame".to_owned() } else { format!("{frames} frames") },
            size.0,
            size.1,
        ));
    }
    Ok(())
}

/// What was drawn.
struct Drawn {
    frames: u64,
    /// Mean time of a frame [ms].
    milliseconds: f64,
}

/// Keeps what is whole after a signal: the frames of a folder. Half a film is none, and a single picture is
/// the last one.
fn cut_short(args: &Args, drawn: Option<Drawn>, sink: Sink, signal: &str) -> Outcome {
    let frames = drawn.map_or(0, |drawn| drawn.frames);
    if frames == 0 || !matches!(sink, Sink::Folder { .. }) {
        return not_written(args, signal);
    }
    sink.finish()?;
    tracing::warn!("ended by {signal}: {} has {frames} of {} frames", args.out.display(), args.frames);
    Ok(())
}

fn not_written(args: &Args, signal: &str) -> Outcome {
    tracing::warn!("ended by {signal}: {} is not written", args.out.display());
    Ok(())
}

/// Renders all frames into the sink, or as many as there is time for before a signal.
fn frames(
    common: &Common,
    args: &Args,
    size: (u32, u32),
    mut show: Show,
    gpu: &Gpu,
    sink: &mut Sink,
    in_order: &InOrder,
) -> Result<Drawn, Failure> {
    let mut studio = Studio::new(gpu, size)?;
    let settings =
        Settings { detail: Settings::of(args.quality).detail, quality: args.quality, ..show.settings() };
    let going_on = || in_order.asked().is_none();
    let bar = say::progress(show.steps_to(args.from), "steps", !common.json);
    show.go_to_while(args.from, || {
        bar.inc(1);
        going_on()
    });
    bar.finish_and_clear();
    let bar = say::progress(args.frames, "frames", !common.json);
    let began = Instant::now();
    let mut drawn = 0;
    while drawn < args.frames {
        show.go_to_while(args.from + drawn as f64 / args.fps, going_on);
        if !going_on() {
            break;
        }
        drawn += 1;
        if drawn == args.frames || sink.wants_all() {
            sink.take(studio.shoot(&show.shot(), &settings)?)?;
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(Drawn { frames: drawn, milliseconds: began.elapsed().as_secs_f64() * 1e3 / drawn.max(1) as f64 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_checked() {
        assert_eq!(size("640x360"), Ok((640, 360)));
        for wrong in ["", "640", "0x5", "5x0", "640x99999", "-1x4", "axb", "1x2x3"] {
            assert!(size(wrong).is_err(), "{wrong}");
        }
    }
}
