//! `reef bench meshes`: what meshes add to a frame at 640×360 — swaying plants, swimming bodies, pulsing
//! bells — with levels of detail and without.
//!
//! The seas are fixed here, not in files, because they are a measure: things of `reef_render::meshes::sample`
//! over the lit bed of `render::sample`, from near to far.

use std::time::Instant;

use glam::DVec3;
use reef_command::Common;
use reef_gpu::{Gpu, GpuOptions, Validation};
use reef_render::{
    Quality, Settings, Shot, Studio,
    meshes::{sample::Models, twin},
    sample,
    view::Lens,
};
use reef_report::failure::Failure;
use reef_streams::{Outputs, environment::Environment, frame::Frame};

use super::{
    measure::median,
    report::{Bar, Report},
};

/// Picture [px].
const SIZE: (u32, u32) = (640, 360);
/// Share of the time without levels of detail that is allowed with them, where the processor draws.
const RATIO: f64 = 0.4;
/// Rounds in which all take their turn.
const ROUNDS: usize = 5;
/// Frames of a turn.
const FRAMES: usize = 3;

/// Things of one kind.
struct Subject {
    name: &'static str,
    count: usize,
    /// Bar for what they add to a frame where the processor draws, and where a device does [ms].
    bars: [Option<f64>; 2],
    eye: DVec3,
    target: DVec3,
    put: fn(&Models, &mut Outputs, usize, f32),
}

const SUBJECTS: [Subject; 4] = [
    Subject {
        name: "plants",
        count: 300,
        bars: [Some(12.0), None],
        eye: DVec3::new(0.0, -3.3, 1.6),
        target: DVec3::new(0.0, -3.6, -1.0),
        put: |models, outputs, i, time| {
            let [u, v] = even(i);
            let z = -14.0 * v;
            models.plant(outputs, [(u - 0.5) * (2.5 - z), -4.0, z], 0.5 + 0.4 * v as f32, time);
        },
    },
    Subject {
        name: "bodies",
        count: 10_000,
        bars: [Some(25.0), None],
        eye: DVec3::new(0.0, -3.0, 2.0),
        target: DVec3::new(0.0, -3.1, 0.0),
        put: fish,
    },
    Subject {
        name: "bells",
        count: 64,
        bars: [Some(30.0), None],
        eye: DVec3::new(0.0, -2.9, 1.6),
        target: DVec3::new(0.0, -2.9, 0.0),
        put: |models, outputs, i, time| {
            // Every eighth is near.
            let [u, v] = even(i);
            let far = if i.is_multiple_of(8) { 0.1 * i as f64 / 8.0 } else { 3.0 + 8.0 * v };
            let at = [(u - 0.5) * (1.8 + far), -3.2 + (v - 0.3) * 0.4 * far.min(2.0), -far];
            models.bell(outputs, at, 1.0, time + 0.37 * i as f32);
        },
    },
    Subject {
        name: "bodies",
        count: 100_000,
        bars: [None, Some(4.0)],
        eye: DVec3::new(0.0, -3.0, 2.0),
        target: DVec3::new(0.0, -3.1, 0.0),
        put: fish,
    },
];

fn fish(models: &Models, outputs: &mut Outputs, i: usize, time: f32) {
    let [u, v] = even(i);
    // More of them the farther away: most are under 20 px.
    let far = 1.2 + 16.0 * v.sqrt();
    let w = (i as f64 * 0.437_013_2).fract();
    let at = [(u - 0.5) * 1.6 * far, -3.1 + (w - 0.5) * 0.7 * far.min(3.0), 2.0 - far];
    models.fish(outputs, at, 6.3 * w as f32, time + 0.01 * i as f32);
}

/// The i-th of points that fill a square evenly.
fn even(i: usize) -> [f64; 2] {
    [0.754_877_666_25, 0.569_840_290_998].map(|step| ((i as f64 + 0.5) * step).fract())
}

/// Measures.
pub fn run(common: &Common) -> Result<Report, Failure> {
    let gpu = Gpu::open(&GpuOptions::from_environment(common.device.clone(), Validation::Off))?;
    let mut report = Report::default();
    let models = Models::default();
    let slow = gpu.info().kind == "cpu";
    let measured = SUBJECTS
        .iter()
        .filter(|subject| !slow || subject.bars[0].is_some())
        .try_for_each(|subject| measure(&gpu, subject, &models, &mut report));
    report.note(format!(
        "{} on {}; low quality, {}x{}, two frames in flight, medians of {ROUNDS} rounds of {FRAMES} frames. What is added is the frame \
         with them less the same view without them.",
        gpu.info().name,
        gpu.info().driver,
        SIZE.0,
        SIZE.1,
    ));
    gpu.close();
    measured?;
    Ok(report)
}

fn steps(subject: &Subject, models: &Models) -> [Frame; 2] {
    let camera = sample::looking_at(subject.eye, subject.target);
    [(1, 1.0), (2, 1.02)].map(|(step, time)| {
        let mut outputs = models.empty();
        (0..subject.count).for_each(|i| (subject.put)(models, &mut outputs, i, time));
        sample::frame(step, camera, outputs)
    })
}

fn shot<'a>(subject: &Subject, steps: &'a [Frame; 2], environment: &'a Environment) -> Shot<'a> {
    let camera = sample::looking_at(subject.eye, subject.target);
    Shot { previous: &steps[0], current: &steps[1], alpha: 0.5, camera, environment }
}

fn measure(gpu: &Gpu, subject: &Subject, models: &Models, report: &mut Report) -> Result<(), Failure> {
    let environment = sample::environment();
    let full = steps(subject, models);
    let bare = steps(&Subject { count: 0, ..*subject }, models);
    let with = Settings::of(Quality::Low);
    let without = Settings { detail: None, ..with };
    let [full_shot, bare_shot] = [&full, &bare].map(|steps| shot(subject, steps, &environment));
    let turns = [(&full_shot, with), (&full_shot, without), (&bare_shot, with)];
    let mut studio = Studio::new(gpu, SIZE)?;
    // Warm: pipelines, buffers, caches.
    for (shot, settings) in &turns {
        studio.run(shot, settings)?;
    }
    let mut times = [const { Vec::new() }; 3];
    for _ in 0..ROUNDS {
        for (times, (shot, settings)) in times.iter_mut().zip(&turns) {
            let start = Instant::now();
            studio.stream(shot, settings, FRAMES)?;
            times.push(start.elapsed().as_secs_f64() * 1e3 / FRAMES as f64);
        }
    }
    let name = format!("{} {}", subject.count, subject.name);
    let added = times[0].iter().zip(&times[2]).map(|(with, bare)| with - bare).collect();
    let added_full = times[1].iter().zip(&times[2]).map(|(without, bare)| without - bare).collect();
    let [added, added_full] = [median(added), median(added_full)];
    let slow = gpu.info().kind == "cpu";
    match subject.bars[usize::from(!slow)] {
        Some(bar) => report.judged(format!("{name} add"), added, "ms a frame", Bar::AtMost(bar)),
        None => report.figure(format!("{name} add"), added, "ms a frame"),
    }
    report.figure(format!("{name}, without levels of detail"), added_full, "ms a frame");
    if slow {
        let ratio = added / added_full.max(1e-6);
        report.judged(format!("{name}, with over without"), ratio, "×", Bar::AtMost(RATIO));
    }
    report.figure(format!("{name}, a step"), bytes(&full[1]) as f64 / 1e6, "MB");
    report.figure(format!("{name}, under 20 px"), small(subject, &full) * 100.0, "%");
    let mut passes: Vec<(String, Vec<f64>)> = Vec::new();
    for _ in 0..ROUNDS {
        studio.run(&full_shot, &with)?;
        for (i, pass) in studio.timings().passes.iter().filter(|p| p.name.starts_with("meshes")).enumerate() {
            if i == passes.len() {
                passes.push((pass.name.clone(), Vec::new()));
            }
            passes[i].1.push(pass.milliseconds);
        }
    }
    let counts = studio.renderer().meshes().counts()?;
    report.figure(format!("{name}, vertices"), f64::from(counts.vertices) / 1e3, "k");
    report.figure(format!("{name}, triangles"), f64::from(counts.triangles) / 1e3, "k");
    for (pass, times) in passes {
        report.figure(format!("{name}, pass {pass}"), median(times), "ms on the device");
    }
    Ok(())
}

/// What a step emits.
fn bytes(frame: &Frame) -> usize {
    let of = |o: &Outputs| {
        size_of_val(&o.objects[..])
            + size_of_val(&o.skinned[..])
            + size_of_val(&o.joints[..])
            + size_of_val(&o.mesh_draws[..])
            + size_of_val(&o.draw_vertices[..])
    };
    frame.outputs.iter().map(|outputs| of(outputs)).sum()
}

/// Share of the instances that are under 20 px.
fn small(subject: &Subject, steps: &[Frame; 2]) -> f64 {
    let lens = Lens::new(&sample::looking_at(subject.eye, subject.target), [SIZE.0, SIZE.1], 60.0);
    let sizes = twin::sizes(&steps[0], &steps[1], &lens);
    sizes.iter().filter(|size| **size < 20.0).count() as f64 / sizes.len().max(1) as f64
}
