//! `reef render`: frames of a scene to a picture, a folder of pictures or a video.

use std::{
    io::Write,
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    time::Instant,
};

use serde_json::json;

use super::{
    pictures::{write_png, write_png_fast},
    show::Show,
    studio::Studio,
};
use crate::{
    cli::Common,
    failure::{Failure, Outcome},
    gpu::{Gpu, GpuOptions, Picture, Validation, packages},
    open::{self, say, shown},
    render::{Quality, Settings},
};

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

fn moment(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(time) if (0.0..=86_400.0).contains(&time) => Ok(time),
        _ => Err("0 to 86400 seconds".to_owned()),
    }
}

/// Renders the frames.
pub fn run(common: &Common, args: &Args) -> Outcome {
    let size = args.size.unwrap_or(SIZE);
    // The place of the result is looked at first: nobody should wait for pictures that cannot be kept.
    let mut sink = Sink::open(&args.out, size, args.fps)?;
    let world = open::world(common, &args.scene, crate::world::Options::default())?;
    let options = GpuOptions::from_environment(common.device.clone(), Validation::Off);
    let gpu = Gpu::open(&options)?;
    let outcome = frames(common, args, size, Show::new(world), &gpu, &mut sink);
    gpu.close();
    let milliseconds = outcome?;
    sink.finish()?;
    if common.json {
        say(json!({
            "out": shown(&args.out),
            "frames": args.frames,
            "width": size.0,
            "height": size.1,
            "milliseconds_per_frame": milliseconds,
        }));
    } else {
        say(format_args!(
            "{}: {} of {}x{}, {milliseconds:.1} ms each",
            args.out.display(),
            if args.frames == 1 { "1 frame".to_owned() } else { format!("{} frames", args.frames) },
            size.0,
            size.1,
        ));
    }
    Ok(())
}

/// Renders all frames into the sink; returns the mean time of a frame [ms].
fn frames(
    common: &Common,
    args: &Args,
    size: (u32, u32),
    mut show: Show,
    gpu: &Gpu,
    sink: &mut Sink,
) -> Result<f64, Failure> {
    let mut studio = Studio::new(gpu, size)?;
    let settings =
        Settings { detail: Settings::of(args.quality).detail, quality: args.quality, ..show.settings() };
    let bar = open::progress(args.frames, "frames", !common.json);
    let began = Instant::now();
    for n in 0..args.frames {
        show.go_to(args.from + n as f64 / args.fps);
        if n + 1 == args.frames || sink.wants_all() {
            sink.take(studio.shoot(&show.shot(), &settings)?)?;
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(began.elapsed().as_secs_f64() * 1e3 / args.frames as f64)
}

/// Where pictures go. Nothing of it can be seen before [`Sink::finish`].
#[derive(Debug)]
enum Sink {
    /// The last picture.
    Png { path: PathBuf, last: Option<Picture> },
    /// All pictures, in a folder that is filled beside its place.
    Folder { path: PathBuf, beside: tempfile::TempDir, count: u64 },
    /// A video that ffmpeg writes beside its place.
    Video { path: PathBuf, beside: tempfile::TempDir, part: PathBuf, ffmpeg: Child },
}

impl Sink {
    fn open(path: &Path, size: (u32, u32), fps: f64) -> Result<Self, Failure> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        let folder = match path.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder.to_owned(),
            _ => PathBuf::from("."),
        };
        let beside = || {
            tempfile::Builder::new().prefix(".reef-").tempdir_in(&folder).map_err(|error| {
                Failure::input(miette::miette!("{}: the folder cannot be written: {error}", folder.display()))
            })
        };
        match extension.as_deref() {
            _ if path.is_dir() => {
                let mut entries = std::fs::read_dir(path)
                    .map_err(|error| Failure::input(miette::miette!("{}: {error}", path.display())))?;
                if entries.next().is_some() {
                    return Err(Failure::input(miette::miette!(
                        help = "name a folder that is empty or does not exist yet",
                        "{}: the folder is not empty",
                        path.display()
                    )));
                }
                Ok(Sink::Folder { path: path.to_owned(), beside: beside()?, count: 0 })
            }
            None => Ok(Sink::Folder { path: path.to_owned(), beside: beside()?, count: 0 }),
            Some("png") => {
                // Only to see that it can be done.
                beside()?;
                Ok(Sink::Png { path: path.to_owned(), last: None })
            }
            Some(kind @ ("mp4" | "webm")) => {
                let beside = beside()?;
                let part = beside.path().join(format!("video.{kind}"));
                let ffmpeg = start_ffmpeg(&part, kind, size, fps)?;
                Ok(Sink::Video { path: path.to_owned(), beside, part, ffmpeg })
            }
            Some(other) => Err(Failure::input(miette::miette!(
                help =
                    "file.png keeps the last frame, a folder all of them, file.mp4 and file.webm are videos",
                "{}: `.{other}` is none of the kinds that can be written",
                path.display()
            ))),
        }
    }

    fn wants_all(&self) -> bool {
        !matches!(self, Sink::Png { .. })
    }

    fn take(&mut self, picture: Picture) -> Result<(), Failure> {
        match self {
            Sink::Png { last, .. } => *last = Some(picture),
            Sink::Folder { beside, count, .. } => {
                *count += 1;
                let name = format!("frame-{count:06}.png");
                write_png_fast(&beside.path().join(name), &picture).map_err(Failure::input)?;
            }
            Sink::Video { ffmpeg, path, .. } => {
                let written = ffmpeg.stdin.as_mut().map(|pipe| pipe.write_all(&picture.rgba));
                if !matches!(written, Some(Ok(()))) {
                    return Err(ffmpeg_failed(ffmpeg, path));
                }
            }
        }
        Ok(())
    }

    fn finish(self) -> Outcome {
        match self {
            Sink::Png { path, last } => match last {
                Some(picture) => write_png(&path, &picture).map_err(Failure::input),
                None => Ok(()),
            },
            Sink::Folder { path, beside, .. } => place_folder(beside, &path),
            Sink::Video { path, beside, part, mut ffmpeg } => {
                drop(ffmpeg.stdin.take());
                match ffmpeg.wait() {
                    Ok(status) if status.success() => {}
                    _ => return Err(ffmpeg_failed(&mut ffmpeg, &path)),
                }
                std::fs::rename(&part, &path)
                    .map_err(|error| Failure::input(miette::miette!("{}: {error}", path.display())))?;
                drop(beside);
                Ok(())
            }
        }
    }
}

/// Puts a filled folder in its place. An empty folder there gives way.
fn place_folder(beside: tempfile::TempDir, path: &Path) -> Outcome {
    let fail = |error: std::io::Error| Failure::input(miette::miette!("{}: {error}", path.display()));
    open_to_others(beside.path()).map_err(fail)?;
    std::fs::rename(beside.path(), path).map_err(fail)?;
    // What it named is there no more under that name: nothing is left to delete.
    let _ = beside.keep();
    Ok(())
}

/// A temporary folder belongs to its maker alone; the result has the rights of any other folder.
fn open_to_others(folder: &Path) -> std::io::Result<()> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        std::fs::set_permissions(folder, std::fs::Permissions::from_mode(0o755))?;
    }
    let _ = folder;
    Ok(())
}

fn start_ffmpeg(part: &Path, kind: &str, size: (u32, u32), fps: f64) -> Result<Child, Failure> {
    let Some(program) = packages::on_path("ffmpeg") else {
        return Err(Failure::machine(miette::miette!(
            help = packages::advice(&["video"]),
            "ffmpeg is needed to write a video, and PATH does not reach it"
        )));
    };
    let codec: &[&str] = match kind {
        "webm" => &["-c:v", "libvpx-vp9", "-b:v", "0", "-crf", "24", "-row-mt", "1"],
        _ => &["-c:v", "libx264", "-preset", "medium", "-crf", "17", "-movflags", "+faststart"],
    };
    Command::new(program)
        .args(["-hide_banner", "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgba"])
        .args(["-s", &format!("{}x{}", size.0, size.1), "-r", &fps.to_string(), "-i", "-"])
        // Half the colour's resolution needs even sides.
        .args(["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p"])
        .args(codec)
        .arg(part)
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|error| Failure::machine(miette::miette!("ffmpeg could not be started: {error}")))
}

fn ffmpeg_failed(ffmpeg: &mut Child, path: &Path) -> Failure {
    drop(ffmpeg.stdin.take());
    let mut said = String::new();
    if let Some(mut pipe) = ffmpeg.stderr.take() {
        // What it said only adds to the message.
        let _ = std::io::Read::read_to_string(&mut pipe, &mut said);
    }
    let _ = ffmpeg.wait();
    Failure::machine(miette::miette!("{}: ffmpeg failed: {}", path.display(), said.trim()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(v: u8) -> Picture {
        Picture { width: 2, height: 2, rgba: [v, v, v, 255].repeat(4) }
    }

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> = std::fs::read_dir(folder)
            .expect("a folder")
            .flatten()
            .map(|e| e.file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn sizes_are_checked() {
        assert_eq!(size("640x360"), Ok((640, 360)));
        for wrong in ["", "640", "0x5", "5x0", "640x99999", "-1x4", "axb", "1x2x3"] {
            assert!(size(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_folder_gets_all_pictures_and_appears_only_when_it_is_whole() {
        let place = tempfile::tempdir().expect("a folder");
        let out = place.path().join("pictures");
        let mut sink = Sink::open(&out, (2, 2), 60.0).expect("a sink");
        sink.take(picture(1)).expect("taken");
        sink.take(picture(2)).expect("taken");
        assert!(!out.exists());
        sink.finish().expect("finished");
        assert_eq!(names(&out), ["frame-000001.png", "frame-000002.png"]);
        assert_eq!(names(place.path()), ["pictures"]);
    }

    #[test]
    fn what_was_given_up_leaves_nothing_behind() {
        let place = tempfile::tempdir().expect("a folder");
        let mut sink = Sink::open(&place.path().join("pictures"), (2, 2), 60.0).expect("a sink");
        sink.take(picture(1)).expect("taken");
        drop(sink);
        assert!(names(place.path()).is_empty());
    }

    #[test]
    fn a_png_keeps_the_last_picture() {
        let place = tempfile::tempdir().expect("a folder");
        let out = place.path().join("a.png");
        let mut sink = Sink::open(&out, (2, 2), 60.0).expect("a sink");
        sink.take(picture(1)).expect("taken");
        sink.take(picture(9)).expect("taken");
        sink.finish().expect("finished");
        assert_eq!(super::super::pictures::read_png(&out).expect("read"), picture(9));
    }

    #[test]
    fn unwritable_places_and_unknown_kinds_are_bad_input() {
        let place = tempfile::tempdir().expect("a folder");
        std::fs::write(place.path().join("file"), "").expect("written");
        for wrong in ["missing/a.png", "missing/a.mp4", "missing/folder", "a.tiff", "file/a.png"] {
            let failure = Sink::open(&place.path().join(wrong), (2, 2), 60.0).expect_err(wrong);
            assert_eq!(failure.code, 2, "{wrong}");
        }
        let full = place.path().to_owned();
        assert_eq!(Sink::open(&full, (2, 2), 60.0).expect_err("not empty").code, 2);
    }
}
