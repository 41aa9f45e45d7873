//! `reef bench render`: milliseconds a frame for 1000, 2000 and 4000 tentacles over a lit bed at 640×360, with levels of
//! detail and without, and where the time goes.
//!
//! The scene is fixed here, not in a file, because it is a measure: two beds of tentacles of 16 rings and 8 sides at full
//! detail. The nearer half stands before the camera; the other half stands so far away that it is small in the picture.

use std::time::Instant;

use glam::DVec3;

use super::{
    measure::median,
    report::{Bar, Report},
};
use crate::{
    cli::Common,
    failure::Failure,
    gpu::{Gpu, GpuOptions, Validation},
    headless::studio::Studio,
    plugin::streams::Outputs,
    render::{Quality, Settings, Shot, lod::Thresholds, sample},
    world::frame::{CameraPose, Frame},
};

/// Picture [px].
const SIZE: (u32, u32) = (640, 360);
/// Tentacles, and the bar for a frame with levels of detail [ms].
const BEDS: [(usize, f64); 3] = [(1000, 20.0), (2000, 35.0), (4000, 60.0)];
/// Share of the time without levels of detail that is allowed with them.
const RATIO: f64 = 0.5;
/// Rounds in which both take their turn.
const ROUNDS: usize = 3;
/// Frames of a turn.
const FRAMES: usize = 3;

/// Measures.
pub fn run(common: &Common) -> Result<Report, Failure> {
    let gpu = Gpu::open(&GpuOptions::from_environment(common.device.clone(), Validation::Off))?;
    let mut report = Report::default();
    let measured = BEDS.iter().try_for_each(|&(count, bar)| measure(&gpu, count, bar, &mut report));
    report.note(format!(
        "{} on {}; low quality, two frames in flight, medians of {ROUNDS} rounds of {FRAMES} frames.",
        gpu.info().name,
        gpu.info().driver
    ));
    gpu.close();
    measured?;
    Ok(report)
}

fn measure(gpu: &Gpu, count: usize, bar: f64, report: &mut Report) -> Result<(), Failure> {
    let environment = sample::environment();
    let camera = camera();
    let [previous, current] = [0.0, 0.05].map(|sway| frame(count, sway, camera));
    let shot = Shot { previous: &previous, current: &current, alpha: 0.5, camera, environment: &environment };
    let with = Settings { quality: Quality::Low, ..Settings::default() };
    let without = Settings { detail: None, ..with };
    let mut studio = Studio::new(gpu, SIZE)?;
    // Warm: pipelines, buffers, caches.
    for settings in [&with, &without] {
        studio.run(&shot, settings)?;
    }
    let mut times = [Vec::new(), Vec::new()];
    for _ in 0..ROUNDS {
        for (times, settings) in times.iter_mut().zip([&with, &without]) {
            let start = Instant::now();
            studio.stream(&shot, settings, FRAMES)?;
            times.push(start.elapsed().as_secs_f64() * 1e3 / FRAMES as f64);
        }
    }
    let ratios = times[0].iter().zip(&times[1]).map(|(with, without)| with / without).collect();
    let [with_ms, without_ms] = times.map(median);
    report.judged(format!("{count} tentacles"), with_ms, "ms a frame", Bar::AtMost(bar));
    report.figure(format!("{count} without levels of detail"), without_ms, "ms a frame");
    report.judged(format!("{count}, with over without"), median(ratios), "×", Bar::AtMost(RATIO));

    studio.run(&shot, &with)?;
    let counts = studio.renderer().fibres().counts()?;
    let small = small(&previous, &current, camera);
    report.figure(format!("{count}, small in the picture"), small * 100.0, "% of the tentacles");
    report.figure(format!("{count}, vertices"), f64::from(counts.vertices) / 1e3, "k");
    for pass in &studio.timings().passes {
        report.figure(format!("{count}, pass {}", pass.name), pass.milliseconds, "ms on the device");
    }
    Ok(())
}

/// Share of the tentacles that are drawn with fewer sides than at full detail or not at all.
fn small(previous: &Frame, current: &Frame, camera: CameraPose) -> f64 {
    use crate::render::{gather, twin, view::Lens};
    let lens = Lens::new(&camera, [SIZE.0, SIZE.1], 60.0);
    let gathered = gather::gather(previous, current, 0.5, &lens, 0);
    let limits = Thresholds::default();
    let full = gathered
        .fibres
        .iter()
        .filter(|fibre| {
            twin::rings(&gathered, fibre, &lens, Some(&limits))
                .is_some_and(|(detail, _)| detail.side_level == 0)
        })
        .count();
    1.0 - full as f64 / gathered.fibres.len().max(1) as f64
}

fn camera() -> CameraPose {
    sample::looking_at(DVec3::new(0.0, -3.45, 0.35), DVec3::new(0.0, -3.75, -0.7))
}

fn frame(count: usize, sway: f32, camera: CameraPose) -> Frame {
    let near = sample::Bed {
        count: count / 2,
        spacing: 0.9 / ((count / 2) as f32).sqrt(),
        per_row: ((count / 2) as f32 * 1.4).sqrt() as usize,
        y: -3.86,
        length: 0.13,
        radius: 0.0065,
    };
    let far = sample::Bed {
        spacing: 3.2 / ((count / 2) as f32).sqrt(),
        y: -3.9,
        length: 0.12,
        radius: 0.004,
        ..near
    };
    let mut outputs = sample::tentacles(&near, sway);
    append(&mut outputs, sample::tentacles(&far, sway), -2.6);
    sample::frame(if sway == 0.0 { 1 } else { 2 }, camera, outputs)
}

/// Puts a second bed behind the first.
fn append(outputs: &mut Outputs, mut more: Outputs, z: f64) {
    let (objects, nodes) = (outputs.objects.len() as u32, outputs.fibre_nodes.len() as u32);
    for object in &mut more.objects {
        object.id += u64::from(objects);
        object.origin[2] += z;
    }
    for fibre in &mut more.fibres {
        fibre.object += objects;
        fibre.first_node += nodes;
    }
    outputs.objects.append(&mut more.objects);
    outputs.fibres.append(&mut more.fibres);
    outputs.fibre_nodes.append(&mut more.fibre_nodes);
}
