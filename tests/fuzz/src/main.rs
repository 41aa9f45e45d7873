//! `cargo xtask fuzz TARGET --minutes N`.

use std::{path::PathBuf, process::ExitCode, time::Duration};

use clap::Parser;
use reef_fuzz::{
    run::{Length, run},
    targets::TARGETS,
};

/// Gives one of the readers of foreign files inputs that nobody would write.
#[derive(Parser, Debug)]
struct Cli {
    /// scenes, species, skeletons, configs, states, journals or plugins.
    #[arg(value_parser = TARGETS.map(|target| target.name))]
    target: String,
    /// For how long.
    #[arg(long, default_value_t = 10.0, value_parser = minutes)]
    minutes: f64,
    /// Of the changes; without it another one each time.
    #[arg(long)]
    seed: Option<u64>,
    /// Try this one input, as it is.
    #[arg(long, conflicts_with = "seed")]
    input: Option<PathBuf>,
    /// Where inputs at fault are kept.
    #[arg(long, default_value = "target/fuzz")]
    findings: PathBuf,
}

fn minutes(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|m| (0.0..=10_000.0).contains(m)).ok_or_else(|| "from 0 to 10000".to_owned())
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    let clock = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    let seed = cli.seed.unwrap_or_else(|| clock.map_or(0, |time| time.as_nanos() as u64));
    let Some(target) = TARGETS.iter().find(|target| target.name == cli.target) else {
        return ExitCode::from(2);
    };
    if let Some(path) = &cli.input {
        let ended = std::fs::read(path).map_err(|error| error.to_string());
        let ended = ended.and_then(|input| (target.try_one)(&input));
        println!("{}: {ended:?}", path.display());
        return if ended.is_ok() { ExitCode::SUCCESS } else { ExitCode::FAILURE };
    }
    let length = Length { time: Duration::from_secs_f64(60.0 * cli.minutes), inputs: u64::MAX };
    let report = run(target, length, seed, &cli.findings);
    println!(
        "{}: {} inputs in {} min (seed {seed}), {} taken, {} skipped, the longest in {:.2} s, {} findings",
        target.name,
        report.inputs,
        cli.minutes,
        report.taken,
        report.skipped,
        report.longest.as_secs_f64(),
        report.findings.len()
    );
    for (problem, path) in &report.findings {
        println!("{}: {problem}", path.display());
    }
    if report.findings.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
