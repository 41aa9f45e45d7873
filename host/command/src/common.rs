//! What every command may be asked for.

use std::{path::PathBuf, time::Duration};

/// Options that every command understands.
#[derive(clap::Args, Clone, Debug, Default)]
pub struct Common {
    /// Machine-readable answer on standard output.
    #[arg(long, global = true)]
    pub json: bool,
    /// Look for plugins in this folder, too (before those beside the program).
    #[arg(long, global = true, value_name = "DIR")]
    pub plugin_dir: Vec<PathBuf>,
    /// Vulkan device: its index or a part of its name, as `reef doctor` lists them.
    #[arg(long, global = true, value_name = "DEVICE")]
    pub device: Option<String>,
    /// Threads that simulate; all cores without it.
    #[arg(long, global = true, value_name = "N", value_parser = workers)]
    pub workers: Option<usize>,
    /// Seed in place of the scene's.
    #[arg(long, global = true, value_name = "S")]
    pub seed: Option<u64>,
    /// Folder of assets; found beside the program or the workspace without it.
    #[arg(long, global = true, value_name = "DIR")]
    pub assets: Option<PathBuf>,
    /// Stop a plugin's step after it worked for so long; 0.25 in the window and with --watch, 60 in runs
    /// without hurry.
    #[arg(long, global = true, value_name = "SECONDS", value_parser = patience)]
    pub patience: Option<Duration>,
}

/// Memory for a sea's past, where nothing else is asked for [MB].
pub const REMEMBER: u64 = 256;

/// What commands that go to other moments may be asked for.
#[derive(clap::Args, Clone, Copy, Debug)]
pub struct Past {
    /// Memory for states of the past, in megabytes: jumps in time begin at the nearest. 0: at the start.
    #[arg(long, value_name = "MB", default_value_t = REMEMBER, value_parser = clap::value_parser!(u64).range(0..=65_536))]
    pub remember: u64,
}

impl Past {
    /// In bytes.
    pub fn bytes(self) -> usize {
        usize::try_from(self.remember << 20).unwrap_or(usize::MAX)
    }
}

/// A number of workers that a machine can have.
fn workers(text: &str) -> Result<usize, String> {
    let most = reef_plugin::generation::MAX_WORKERS;
    match text.parse() {
        Ok(workers) if (1..=most).contains(&workers) => Ok(workers),
        _ => Err(format!("a whole number from 1 to {most} is wanted")),
    }
}

/// How long a step may take.
fn patience(text: &str) -> Result<Duration, String> {
    match text.parse::<f64>() {
        Ok(seconds) if (0.001..=1e6).contains(&seconds) => Ok(Duration::from_secs_f64(seconds)),
        _ => Err("0.001 to 1000000 seconds".to_owned()),
    }
}
