//! `reef bench demo`: the window's own loop without a window: the default sea runs in real time, and as many
//! pictures are drawn of it as the machine can.
//!
//! The loop takes turns with one that waits for each picture before the sea goes on: what it is ahead of that
//! is what steps gain that run while the device draws.

use std::{path::Path, time::Instant};

use reef_command::{Common, Past, REMEMBER, open};
use reef_gpu::{Gpu, GpuError, GpuOptions, Validation};
use reef_plugin::bare::process::processor_time_of_all;
use reef_render::{Quality, Settings, Shot, Studio};
use reef_report::failure::Failure;
use reef_sea::{Options, Timeline, World, reload};

use super::{measure::median, report::Report};

/// Picture [px].
const SIZE: (u32, u32) = (640, 360);
/// Rounds in which both loops take their turn.
const ROUNDS: usize = 5;
/// Real time of a turn [s].
const TURN: f64 = 2.0;

/// What a turn showed.
#[derive(Default)]
struct Turn {
    /// Pictures a second.
    pictures: f64,
    /// Steps a second.
    steps: f64,
    /// Share of the time that went into steps, on the loop's own thread.
    stepping: f64,
    /// Cores that were busy, in the mean.
    cores: f64,
    /// What was brought of steps [MB a picture].
    brought: f64,
}

/// Measures.
pub fn run(common: &Common) -> Result<Report, Failure> {
    let gpu = Gpu::open(&GpuOptions::from_environment(common.device.clone(), Validation::Off))?;
    let measured = measure(&gpu, common);
    gpu.close();
    measured
}

fn measure(gpu: &Gpu, common: &Common) -> Result<Report, Failure> {
    let plugins = open::plugins(common)?;
    let scene = open::scene(common, Path::new(open::DEFAULT_SCENE), &plugins)?;
    let history = Past { remember: REMEMBER }.bytes();
    let options =
        Options { seed: common.seed, remember: Some(reload::REMEMBER), history, ..Options::default() };
    let mut timeline = Timeline::new(World::new(scene, &plugins, &options).map_err(Failure::input)?);
    let mut studio = Studio::new(gpu, SIZE)?;
    // Warm: pipelines, buffers, caches.
    turn(&mut timeline, &mut studio, true)?;
    let (mut turns, mut ratios) = (Vec::new(), Vec::new());
    let mut passes: Vec<(String, Vec<f64>)> = Vec::new();
    for _ in 0..ROUNDS {
        let waits = turn(&mut timeline, &mut studio, true)?;
        let runs = turn(&mut timeline, &mut studio, false)?;
        ratios.push(runs.pictures / waits.pictures);
        turns.push(runs);
        for (at, pass) in studio.timings().passes.iter().enumerate() {
            if at == passes.len() {
                passes.push((pass.name.clone(), Vec::new()));
            }
            passes[at].1.push(pass.milliseconds);
        }
    }
    let of = |what: fn(&Turn) -> f64| median(turns.iter().map(what).collect());
    let mut report = Report::default();
    report.figure("pictures", of(|turn| turn.pictures), "a second");
    report.figure("the same, over waiting for each before the sea goes on", median(ratios), "×");
    report.figure("steps", of(|turn| turn.steps), "a second");
    report.figure("steps, share of the loop's time", of(|turn| turn.stepping) * 100.0, "%");
    report.figure("streams brought to the device", of(|turn| turn.brought), "MB a picture");
    report.figure("cores that are busy", of(|turn| turn.cores), "");
    for (name, times) in passes {
        report.figure(format!("pass {name}"), median(times), "ms on the device");
    }
    report.note(format!(
        "{} on {}; the default sea at {}x{}, low quality, medians of {ROUNDS} turns of {TURN} s. In real \
         time a second has {:.0} steps; the sea runs slower where pictures take longer than so many steps \
         as one may have.",
        gpu.info().name,
        gpu.info().driver,
        SIZE.0,
        SIZE.1,
        1.0 / timeline.world.clock().dt,
    ));
    Ok(report)
}

/// Runs the loop for a while. `waits`: for each picture, before the sea goes on.
fn turn(timeline: &mut Timeline, studio: &mut Studio, waits: bool) -> Result<Turn, GpuError> {
    let settings = Settings::of(Quality::Low);
    let (began, busy, first) = (Instant::now(), processor_time_of_all(), timeline.world.clock().step);
    let (mut last, mut stepping, mut pictures, mut brought) = (began, 0.0, 0_u32, 0);
    while began.elapsed().as_secs_f64() < TURN {
        let now = Instant::now();
        timeline.advance(now.duration_since(last).as_secs_f64());
        stepping += now.elapsed().as_secs_f64();
        last = now;
        let blend = timeline.blend();
        let shot = Shot {
            previous: &blend.previous,
            current: &blend.current,
            alpha: blend.alpha,
            camera: blend.current.camera,
            environment: timeline.world.environment(),
        };
        studio.submit(&shot, &settings)?;
        brought += studio.renderer().brought();
        if waits {
            studio.wait()?;
        }
        pictures += 1;
    }
    studio.wait()?;
    let seconds = began.elapsed().as_secs_f64();
    Ok(Turn {
        brought: brought as f64 * 1e-6 / f64::from(pictures),
        pictures: f64::from(pictures) / seconds,
        steps: (timeline.world.clock().step - first) as f64 / seconds,
        stepping: stepping / seconds,
        cores: (processor_time_of_all() - busy) as f64 * 1e-9 / seconds,
    })
}
