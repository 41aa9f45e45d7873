//! `reef bench render`: milliseconds a frame for 1000, 2000 and 4000 tentacles over a lit bed at 640×360,
//! with levels of detail and without, and where the time goes.
//!
//! The scene is fixed here, not in a file, because it is a measure: two beds of tentacles ([`NEAR`], [`FAR`])
//! on the lit bed of `reef_render::sample`. The nearer half stands before the camera; the other half stands
//! so far away that it is small in the picture.

use std::time::Instant;

use glam::DVec3;
use reef_command::Common;
use reef_gpu::{Gpu, GpuOptions, Validation};
use reef_render::{Quality, Settings, Shot, Studio, lod::Thresholds, sample};
use reef_report::failure::Failure;
use reef_streams::{
    Outputs,
    frame::{CameraPose, Frame},
};

use super::{
    measure::median,
    report::{Bar, Report},
};

/// Picture [px].
const SIZE: (u32, u32) = (640, 360);
/// Where the camera stands, and what it looks at [m]; its field of view is one radian high.
const EYE: DVec3 = DVec3::new(0.0, -3.42, 0.32);
const TARGET: DVec3 = DVec3::new(0.0, -3.68, -0.45);
/// The half that is before the camera: 110 to 50 px long.
const NEAR: Bed = Bed { side: 0.5, y: -3.86, z: 0.0, length: 0.13, radius: 0.0065 };
/// The half that is small in the picture: 20 to 7 px long.
const FAR: Bed = Bed { side: 3.2, y: -3.9, z: -2.6, length: 0.12, radius: 0.004 };
/// Tentacles, and the bar for a frame with levels of detail [ms].
const BEDS: [(usize, f64); 3] = [(1000, 20.0), (2000, 35.0), (4000, 60.0)];
/// Share of the time without levels of detail that is allowed with them, where the processor draws: on
/// hardware such a frame takes less than a millisecond, most of which is spent on handing it over.
const RATIO: f64 = 0.5;
/// Rounds in which both take their turn.
const ROUNDS: usize = 3;
/// Frames of a turn.
const FRAMES: usize = 3;

/// A bed of tentacles of 16 rings and 8 sides at full detail, on about a square, as many as are asked for.
struct Bed {
    /// Side of the square [m].
    side: f32,
    /// y of the roots, z of the row that is nearest to the camera [m].
    y: f64,
    z: f64,
    /// Length and greatest radius of a tentacle [m].
    length: f32,
    radius: f32,
}

/// Measures.
pub fn run(common: &Common) -> Result<Report, Failure> {
    let gpu = Gpu::open(&GpuOptions::from_environment(common.device.clone(), Validation::Off))?;
    let mut report = Report::default();
    let measured = BEDS.iter().try_for_each(|&(count, bar)| measure(&gpu, count, bar, &mut report));
    report.note(format!(
        "{} on {}; low quality, {}x{}, two frames in flight, medians of {ROUNDS} rounds of {FRAMES} frames. Scene and camera \
         are in host/bench/src/render.rs; small: drawn with fewer sides than at full detail.",
        gpu.info().name,
        gpu.info().driver,
        SIZE.0,
        SIZE.1,
    ));
    gpu.close();
    measured?;
    Ok(report)
}

fn measure(gpu: &Gpu, count: usize, bar: f64, report: &mut Report) -> Result<(), Failure> {
    let environment = sample::environment();
    let camera = sample::looking_at(EYE, TARGET);
    let [previous, current] = [0.0, 0.05].map(|sway| frame(count, sway, camera));
    let shot = Shot { previous: &previous, current: &current, alpha: 0.5, camera, environment: &environment };
    let with = Settings::of(Quality::Low);
    let without = Settings { detail: None, ..with };
    let mut studio = Studio::new(gpu, SIZE)?;
    // Warm: pipelines, buffers, caches.
    let mut brought = Vec::new();
    for settings in [&with, &without] {
        studio.run(&shot, settings)?;
        brought.push(studio.renderer().brought() as f64 * 1e-6);
    }
    for (name, megabytes) in ["both steps", "the next picture between them"].iter().zip(brought) {
        report.figure(format!("{count}, streams brought, {name}"), megabytes, "MB");
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
    let (name, ratio) = (format!("{count}, with over without"), median(ratios));
    if gpu.info().kind == "cpu" {
        report.judged(name, ratio, "×", Bar::AtMost(RATIO));
    } else {
        report.figure(name, ratio, "×");
    }

    let [small, outside] = small(&previous, &current, camera);
    report.figure(format!("{count}, small in the picture"), small * 100.0, "% of the tentacles");
    report.figure(format!("{count}, outside of the picture"), outside * 100.0, "% of the tentacles");
    let mut passes: Vec<(String, Vec<f64>)> = Vec::new();
    for _ in 0..ROUNDS * FRAMES {
        studio.run(&shot, &with)?;
        for (i, pass) in studio.timings().passes.iter().enumerate() {
            if i == passes.len() {
                passes.push((pass.name.clone(), Vec::new()));
            }
            passes[i].1.push(pass.milliseconds);
        }
    }
    let counts = studio.renderer().fibres().counts()?;
    let vertices = counts.vertices + counts.solid.vertices + counts.thin.vertices;
    report.figure(format!("{count}, vertices"), f64::from(vertices) / 1e3, "k");
    for (name, times) in passes {
        report.figure(format!("{count}, pass {name}"), median(times), "ms on the device");
    }
    Ok(())
}

/// Shares of the tentacles that are drawn with fewer sides than at full detail, and that are outside of the
/// picture.
fn small(previous: &Frame, current: &Frame, camera: CameraPose) -> [f64; 2] {
    use reef_render::{gather, twin, view::Lens};
    let lens = Lens::new(&camera, [SIZE.0, SIZE.1], 60.0);
    let gathered = gather::gather(previous, current, 0.5, &lens, 0);
    let limits = Thresholds::default();
    let [mut small, mut outside] = [0_usize; 2];
    for fibre in &gathered.fibres {
        match twin::rings(&gathered, fibre, &lens, Some(&limits)) {
            Some((detail, _)) => small += usize::from(detail.side_level > 0),
            None => outside += 1,
        }
    }
    [small, outside].map(|n| n as f64 / gathered.fibres.len().max(1) as f64)
}

fn frame(count: usize, sway: f32, camera: CameraPose) -> Frame {
    let half = count / 2;
    let bed = |bed: &Bed| sample::Bed {
        count: half,
        spacing: bed.side / (half as f32).sqrt(),
        per_row: (half as f32 * 1.4).sqrt() as usize,
        y: bed.y,
        length: bed.length,
        radius: bed.radius,
    };
    let mut outputs = sample::tentacles(&bed(&NEAR), sway);
    append(&mut outputs, sample::tentacles(&bed(&FAR), sway), FAR.z);
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

#[cfg(test)]
mod tests {
    use super::*;
    use reef_render::pictures::write_png;

    #[test]
    fn about_half_of_the_tentacles_are_small_and_none_is_outside_of_the_picture() {
        let camera = sample::looking_at(EYE, TARGET);
        for (count, _) in BEDS {
            let [previous, current] = [0.0, 0.05].map(|sway| frame(count, sway, camera));
            let [small, outside] = small(&previous, &current, camera);
            assert!((0.47..0.53).contains(&small) && outside == 0.0, "{count}: {small}, {outside}");
        }
    }

    /// With REEF_TEST_PICTURES=DIR the pictures are kept for looking at.
    #[test]
    fn levels_of_detail_change_little_in_the_measured_picture() {
        let gpu = match Gpu::open(&GpuOptions { validation: Validation::Off, ..GpuOptions::default() }) {
            Ok(gpu) => gpu,
            Err(error) if std::env::var("REEF_REQUIRE").as_deref() == Ok("all") => panic!("{error}"),
            Err(error) => return eprintln!("skipped: {error}"),
        };
        let mut studio = Studio::new(&gpu, SIZE).expect("a studio");
        let environment = sample::environment();
        let camera = sample::looking_at(EYE, TARGET);
        for (count, _) in [BEDS[0], BEDS[2]] {
            let [previous, current] = [0.0, 0.05].map(|sway| frame(count, sway, camera));
            let shot = Shot {
                previous: &previous,
                current: &current,
                alpha: 0.5,
                camera,
                environment: &environment,
            };
            let with = Settings::of(Quality::Low);
            let [seen, full] = [with, Settings { detail: None, ..with }]
                .map(|settings| studio.shoot(&shot, &settings).expect("a picture"));
            if let Ok(folder) = std::env::var("REEF_TEST_PICTURES") {
                for (name, picture) in [("with", &seen), ("without", &full)] {
                    let path = std::path::Path::new(&folder).join(format!("bench-{count}-{name}.png"));
                    write_png(&path, picture).expect("written");
                }
            }
            let difference: u64 =
                seen.rgba.iter().zip(&full.rgba).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
            let difference = difference as f64 / (seen.rgba.len() / 4 * 3) as f64;
            assert!(difference < 4.0, "{count}: {difference} of 255 in the mean");
        }
        drop(studio);
        assert_eq!(gpu.close(), Vec::<String>::new());
    }
}
