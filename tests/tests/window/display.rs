//! An X display of its own for a test: Xvfb on a free number, hands by xdotool, eyes by ImageMagick.

use std::{
    io::Read,
    path::Path,
    process::{Child, Command, Output, Stdio},
    time::{Duration, Instant},
};

/// Programs without which no window can be tested here.
const PROGRAMS: [&str; 4] = ["Xvfb", "xdotool", "import", "convert"];

/// A running X server.
pub struct Display {
    server: Child,
    /// `:7`.
    pub name: String,
}

impl Display {
    /// Starts a server with one screen of this size. `Err`: what is missing.
    pub fn start(size: &str) -> Result<Self, String> {
        let missing: Vec<_> = PROGRAMS.into_iter().filter(|program| !on_path(program)).collect();
        if !missing.is_empty() {
            return Err(format!("{} not found (packages xvfb, xdotool, imagemagick)", missing.join(", ")));
        }
        let screen = format!("{size}x24");
        // The server chooses a free display and writes its number to descriptor 1.
        let mut server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", &screen, "-nolisten", "tcp", "-noreset"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .map_err(|error| format!("Xvfb does not start: {error}"))?;
        let mut number = Vec::new();
        if let Some(out) = &mut server.stdout {
            let mut byte = [0];
            while out.read(&mut byte).is_ok_and(|n| n == 1) && byte[0] != b'\n' {
                number.push(byte[0]);
            }
        }
        let number = String::from_utf8_lossy(&number).trim().to_owned();
        if number.is_empty() {
            let _ = server.kill();
            let _ = server.wait();
            return Err("Xvfb found no free display".to_owned());
        }
        Ok(Self { server, name: format!(":{number}") })
    }

    /// Runs xdotool; its output, trimmed.
    pub fn hand(&self, args: &[&str]) -> String {
        let output = self.run("xdotool", args);
        assert!(
            output.status.success(),
            "xdotool {}: {}",
            args.join(" "),
            String::from_utf8_lossy(&output.stderr)
        );
        String::from_utf8_lossy(&output.stdout).trim().to_owned()
    }

    /// The window of a process, as soon as it is there.
    pub fn window_of(&self, child: &mut Child) -> String {
        let end = Instant::now() + Duration::from_secs(60);
        while Instant::now() < end {
            if let Ok(Some(status)) = child.try_wait() {
                panic!("reef ended before its window appeared: {status}");
            }
            let output = self.run("xdotool", &["search", "--onlyvisible", "--name", "^Reef"]);
            if let Some(id) = String::from_utf8_lossy(&output.stdout).lines().next() {
                return id.to_owned();
            }
            std::thread::sleep(Duration::from_millis(100));
        }
        panic!("no window within a minute");
    }

    /// Saves what the screen shows.
    pub fn picture(&self, path: &Path) {
        let file = path.display().to_string();
        let output = self.run("import", &["-window", "root", &file]);
        assert!(output.status.success(), "import: {}", String::from_utf8_lossy(&output.stderr));
    }

    fn run(&self, program: &str, args: &[&str]) -> Output {
        let output = Command::new(program).args(args).env("DISPLAY", &self.name).output();
        output.unwrap_or_else(|error| panic!("{program}: {error}"))
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

/// How lively a picture is: standard deviation of its brightness (0..1) and number of distinct colours at 8
/// bits.
pub fn liveliness(picture: &Path) -> (f64, u64) {
    let output = Command::new("convert")
        .arg(picture)
        .args(["-format", "%[fx:standard_deviation] %k", "info:"])
        .output()
        .unwrap_or_else(|error| panic!("convert: {error}"));
    let text = String::from_utf8_lossy(&output.stdout).trim().to_owned();
    let mut parts = text.split_whitespace();
    let deviation = parts.next().and_then(|part| part.parse().ok());
    let colors = parts.next().and_then(|part| part.parse().ok());
    match (deviation, colors) {
        (Some(deviation), Some(colors)) => (deviation, colors),
        _ => panic!("convert said {text:?} {}", String::from_utf8_lossy(&output.stderr)),
    }
}

fn on_path(program: &str) -> bool {
    let path = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&path).any(|folder| folder.join(program).is_file())
}
