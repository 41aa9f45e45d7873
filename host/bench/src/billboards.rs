//! `reef bench billboards`: milliseconds a frame at 1280×720 for a still sea, the same with 100 000 sprites
//! that are all in the picture, and with 100 000 around the eye, of which a part is.
//!
//! No figure has a bar: what a picture takes is the device's. The parts say where the time goes: looking at
//! the sprites (culling, sorting) on the processor, and the pass that draws them on the device.

use std::time::Instant;

use glam::DVec3;
use reef_command::Common;
use reef_gpu::{Gpu, GpuOptions, Validation};
use reef_render::{Quality, Settings, Shot, Studio, sample};
use reef_report::failure::Failure;
use reef_streams::{Outputs, frame::CameraPose};

use super::{measure::median, report::Report};

/// Picture [px].
const SIZE: (u32, u32) = (1280, 720);
/// Sprites in the sea.
const COUNT: usize = 100_000;
/// Rounds in which each sea takes its turn.
const ROUNDS: usize = 5;
/// Frames of a turn.
const FRAMES: usize = 3;

/// Measures.
pub fn run(common: &Common) -> Result<Report, Failure> {
    let gpu = Gpu::open(&GpuOptions::from_environment(common.device.clone(), Validation::Off))?;
    let mut report = Report::default();
    let measured =
        [Quality::Low, Quality::High].into_iter().try_for_each(|quality| measure(&gpu, quality, &mut report));
    report.note(format!(
        "{} on {}; two frames in flight, medians of {ROUNDS} rounds of {FRAMES} frames.",
        gpu.info().name,
        gpu.info().driver
    ));
    gpu.close();
    measured?;
    Ok(report)
}

fn camera() -> CameraPose {
    sample::looking_at(DVec3::new(0.0, -2.4, 0.0), DVec3::new(0.0, -2.5, -5.0))
}

/// The seas: without sprites, all in the picture, around the eye.
fn seas() -> [(&'static str, Outputs); 3] {
    let before = [DVec3::new(-1.5, -3.2, -8.0), DVec3::new(1.5, -1.6, -3.0)];
    let around = [DVec3::new(-8.0, -3.9, -8.0), DVec3::new(8.0, -0.5, 8.0)];
    [
        ("no sprites", Outputs::default()),
        ("all before the eye", sample::snow(COUNT, before, 0.012)),
        ("all around the eye", sample::snow(COUNT, around, 0.012)),
    ]
}

fn measure(gpu: &Gpu, quality: Quality, report: &mut Report) -> Result<(), Failure> {
    let environment = sample::environment();
    let camera = camera();
    let frames = seas().map(|(name, outputs)| (name, sample::frame(1, camera, outputs)));
    let settings = Settings { quality, ..Settings::default() };
    let mut studio = Studio::new(gpu, SIZE)?;
    let mut times = [Vec::new(), Vec::new(), Vec::new()];
    let name = format!("{quality:?}").to_lowercase();
    for round in 0..=ROUNDS {
        for ((_, frame), times) in frames.iter().zip(&mut times) {
            let shot =
                Shot { previous: frame, current: frame, alpha: 1.0, camera, environment: &environment };
            if round == 0 {
                // Warm: pipelines, buffers, caches.
                studio.run(&shot, &settings)?;
                continue;
            }
            let start = Instant::now();
            studio.stream(&shot, &settings, FRAMES)?;
            times.push(start.elapsed().as_secs_f64() * 1e3 / FRAMES as f64);
        }
    }
    for ((sea, frame), times) in frames.iter().zip(times) {
        report.figure(format!("{name}, {sea}"), median(times), "ms a frame");
        if frame.outputs[0].billboards.is_empty() {
            continue;
        }
        let shot = Shot { previous: frame, current: frame, alpha: 1.0, camera, environment: &environment };
        let (mut looks, mut passes) = (Vec::new(), Vec::new());
        for _ in 0..ROUNDS {
            studio.run(&shot, &settings)?;
            looks.push(studio.renderer().billboards().seen().milliseconds());
            let sprites = studio.timings().passes.iter().filter(|pass| pass.name == "sprites");
            passes.push(sprites.map(|pass| pass.milliseconds).sum());
        }
        let drawn = studio.renderer().billboards().seen().count();
        report.figure(format!("{name}, {sea}, drawn"), drawn as f64 / 1e3, "k sprites");
        report.figure(format!("{name}, {sea}, culled and sorted in"), median(looks), "ms");
        report.figure(format!("{name}, {sea}, pass"), median(passes), "ms on the device");
    }
    Ok(())
}
