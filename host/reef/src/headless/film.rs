//! Films, through ffmpeg: heard while it works, and looked at before they take the place of older ones.

use std::{
    io::{self, Write},
    path::Path,
    process::{Child, Command, ExitStatus, Stdio},
    sync::{Arc, Mutex, PoisonError, mpsc::Receiver},
    thread,
    time::{Duration, Instant},
};

use reef_files::Writing;
use reef_gpu::{Picture, packages};
use reef_report::{
    failure::{Failure, Outcome},
    listen::{last_lines, listen},
};

use super::container::{self, Container};

/// How long ffmpeg may take to end after it gave up reading pictures [s].
const PATIENCE: Duration = Duration::from_secs(5);
/// How many of its last lines are told.
const TOLD: usize = 5;

/// A film on its way. Dropped before [`Film::finish`], it leaves nothing behind.
#[derive(Debug)]
pub struct Film {
    ffmpeg: Child,
    said: Arc<Mutex<Vec<u8>>>,
    silent: Receiver<()>,
    out: Option<Writing>,
    container: Container,
    name: String,
}

impl Film {
    /// Begins a film of pictures of this size [px], `fps` a second.
    pub fn create(path: &Path, container: Container, size: (u32, u32), fps: f64) -> Result<Self, Failure> {
        let program = packages::program("ffmpeg").map_err(|barred| match barred {
            Some(path) => Failure::machine(miette::miette!(
                help = "ffmpeg is needed to write a video: `chmod +x` it, or put a folder with another one first in PATH",
                "{} cannot be run: it is not marked as a program",
                path.display()
            )),
            None => Failure::machine(miette::miette!(
                help = packages::advice(&["video"]),
                "ffmpeg is needed to write a video, and PATH does not reach it"
            )),
        })?;
        let out = Writing::create_seekable(path).map_err(Failure::input)?;
        let codec: &[&str] = match container {
            Container::Webm => &["-c:v", "libvpx-vp9", "-b:v", "0", "-crf", "24", "-row-mt", "1"],
            Container::Mp4 => {
                &["-c:v", "libx264", "-preset", "medium", "-crf", "17", "-movflags", "+faststart"]
            }
        };
        let started = Command::new(&program)
            .args(["-hide_banner", "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgba"])
            .args(["-s", &format!("{}x{}", size.0, size.1), "-r", &fps.to_string(), "-i", "-"])
            // Half the colour's resolution needs even sides.
            .args(["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p"])
            .args(codec)
            .args(["-f", container.name()])
            .arg(out.part())
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn();
        let mut ffmpeg = started.map_err(|error| cannot_run(&program, &error))?;
        let Some(stderr) = ffmpeg.stderr.take() else {
            // It was asked for above.
            return Err(Failure::machine(miette::miette!("{}: ffmpeg has no voice", path.display())));
        };
        let (said, silent) = listen(stderr);
        let name = path.display().to_string();
        Ok(Self { ffmpeg, said, silent, out: Some(out), container, name })
    }

    /// Adds a picture.
    pub fn take(&mut self, picture: &Picture) -> Outcome {
        let written = self.ffmpeg.stdin.as_mut().map(|pipe| pipe.write_all(&picture.rgba));
        if matches!(written, Some(Ok(()))) && !self.speaks() {
            return Ok(());
        }
        Err(self.failed())
    }

    /// Ends the film and puts it in its place, when it is one.
    pub fn finish(mut self) -> Outcome {
        drop(self.ffmpeg.stdin.take());
        // The last pictures take their time. One that speaks has failed, whether it ends or not.
        let status = self.wait_or(Self::speaks);
        let ended_well = matches!(status, Ok(Some(status)) if status.success());
        if !ended_well || !self.words().is_empty() {
            return Err(self.failed());
        }
        let Some(out) = self.out.take() else { return Ok(()) };
        container::look(out.part(), self.container).map_err(|fault| {
            Failure::machine(miette::miette!(
                help = "the disk may be full; nothing was put in the film's place",
                "{}: ffmpeg ended well, and what it wrote is no film: {fault}",
                self.name
            ))
        })?;
        out.finish().map_err(Failure::input)
    }

    /// Waits until it ends, or until this is enough.
    fn wait_or(&mut self, enough: impl Fn(&Self) -> bool) -> io::Result<Option<ExitStatus>> {
        loop {
            let status = self.ffmpeg.try_wait();
            if !matches!(status, Ok(None)) || enough(self) {
                return status;
            }
            thread::sleep(Duration::from_millis(5));
        }
    }

    /// Whatever it says is an error: nothing else was asked for.
    fn speaks(&self) -> bool {
        !self.said.lock().unwrap_or_else(PoisonError::into_inner).is_empty()
    }

    /// All that it said.
    fn words(&self) -> String {
        // What was said before the end may be on its way still; something that it started may hold the stream
        // open.
        let _ = self.silent.recv_timeout(Duration::from_secs(1));
        last_lines(&self.said.lock().unwrap_or_else(PoisonError::into_inner), TOLD)
    }

    fn failed(&mut self) -> Failure {
        drop(self.ffmpeg.stdin.take());
        let end = Instant::now() + PATIENCE;
        let status = self.wait_or(|_| Instant::now() >= end);
        let how = match status {
            Ok(Some(status)) if status.success() => "ffmpeg failed".to_owned(),
            Ok(Some(status)) => format!("ffmpeg failed ({status})"),
            _ => "ffmpeg failed, and did not end".to_owned(),
        };
        let words = self.words();
        let words = if words.is_empty() { "it did not say why" } else { &words };
        Failure::machine(miette::miette!("{}: {how}: {words}", self.name))
    }
}

impl Drop for Film {
    fn drop(&mut self) {
        // It must not make its file once more after that is gone. One that ended is not there to be killed.
        let _ = self.ffmpeg.kill();
        let _ = self.ffmpeg.wait();
    }
}

fn cannot_run(program: &Path, error: &io::Error) -> Failure {
    let help = match error.kind() {
        io::ErrorKind::NotFound => "what it is run by (its interpreter or loader) is missing",
        _ => "ffmpeg is needed to write a video: mend it, or put a folder with another one first in PATH",
    };
    Failure::machine(miette::miette!(help = help, "{} cannot be run: {error}", program.display()))
}
