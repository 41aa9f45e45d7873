//! `reef bench table1`: the scene of table 1 of Coulais et al. 2005 (§3.4) — 4000 particles, 30 wave trains,
//! a uniform current — seen from five distances, with and without its levels of detail, beside the paper's
//! figures; and what a step of the default sea's particles takes.
//!
//! The paper's rates are frames a second of both, simulation and picture, of a processor and a graphics card
//! of 2003. Here steps and pictures are told apart: what the levels of detail save of the simulation is
//! judged by ratios within one run.

use glam::DVec3;
use reef_command::{Common, open};
use reef_plugin::Registry;
use reef_report::failure::Failure;
use reef_sea::{World, step::camera};
use reef_streams::frame::CameraPose;

use super::{
    cells::{figure, line, pictures, set, warm, world},
    fibre::running,
    measure::{Work, best, rounds},
    report::{Bar, Report},
};

/// The paper's scene.
const SCENE: &str = "particles-table1";
/// The plugin that is measured.
const PLUGIN: &str = "reef.particles";
/// From the eye to the nearest particle [m].
const DISTANCES: [f64; 5] = [0.0, 3.0, 6.0, 9.0, 12.0];
/// The box's nearest face in the scene: z [m].
const FACE: f64 = 5.0;

/// Which trains are evaluated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Trains {
    All,
    /// Those that are left out sum to less than the threshold.
    Sum,
    /// The paper's rule: each of those that are left out is below it.
    Each,
}

/// A row of the table: its name, which trains are evaluated, whether the other levels of detail are on, and
/// the paper's frames a second.
struct Row {
    name: &'static str,
    trains: Trains,
    levels: bool,
    paper: [f64; 5],
}

impl Row {
    const fn new(name: &'static str, trains: Trains, levels: bool, paper: [f64; 5]) -> Self {
        Self { name, trains, levels, paper }
    }
}

/// The paper's second row: trains are selected, and nothing else.
const SELECTED: [f64; 5] = [13.0, 16.0, 21.0, 28.0, 30.0];

const ROWS: [Row; 5] = [
    Row::new("all trains, no levels", Trains::All, false, [11.0; 5]),
    Row::new("all trains, levels", Trains::All, true, [20.0, 23.0, 29.0, 45.0, 97.0]),
    Row::new("trains by their sum, no levels", Trains::Sum, false, SELECTED),
    Row::new("trains by each, no levels", Trains::Each, false, SELECTED),
    Row::new("trains by their sum, levels", Trains::Sum, true, [22.0, 28.0, 38.0, 62.0, 122.0]),
];
/// Rows that are compared.
const NONE: usize = 0;
const BY_SUM: usize = 2;
const BY_EACH: usize = 3;
const BOTH: usize = 4;

/// Rounds in which all cells of the table take their turn.
const ROUNDS: usize = 30;
/// Steps before anything is measured.
const WARM_STEPS: usize = 20;
/// The bar for a step of the default sea's particles [ms].
const DEFAULT_SEA: f64 = 1.0;
/// What the levels of detail have to save at 12 m, as a multiple; the paper's saved 11 times the whole frame.
const SAVED: f64 = 5.0;
/// Trains that the selection has to leave out at 12 m [%], by their sum and by each.
const LEFT_OUT: [f64; 2] = [15.0, 22.0];

/// Measures.
pub fn run(common: &Common) -> Result<Report, Failure> {
    let plugins = open::plugins(common)?;
    let mut cells = Vec::new();
    for row in &ROWS {
        for distance in DISTANCES {
            cells.push(cell(common, &plugins, row, distance)?);
        }
    }
    let things: Vec<Work<'_>> = cells.iter_mut().map(|world| Box::new(|| world.step()) as Work<'_>).collect();
    let seen = rounds(things, ROUNDS);
    for world in &mut cells {
        running(world)?;
    }
    let steps: Vec<f64> = (0..cells.len()).map(|column| best(&seen, column)).collect();
    let trains: Vec<f64> = cells.iter().map(trains_an_orbit).collect();
    let orbits: Vec<f64> = cells.iter().map(|world| figure(world, "orbits in a step")).collect();
    let mut report = Report::default();
    let frames = pictures(common, &cells, &mut report)?;
    let width = DISTANCES.len();
    for (number, row) in ROWS.iter().enumerate() {
        for (at, distance) in DISTANCES.iter().enumerate() {
            let step = steps[number * width + at];
            report.figure(format!("{}, {distance} m", row.name), 1.0 / step, "steps/s");
        }
    }
    report.note(format!("{:<49}{}", "distance [m]", line(&DISTANCES)));
    for (number, row) in ROWS.iter().enumerate() {
        let of = number * width..(number + 1) * width;
        let say = |what: &str, values: Vec<f64>| format!("{:<31}{what:<18}{}", row.name, line(&values));
        report.note(say("orbits", orbits[of.clone()].to_vec()));
        report.note(format!("{:<31}{:<18}{}", row.name, "trains an orbit", tenths(&trains[of.clone()])));
        report.note(say("paper, frames/s", row.paper.to_vec()));
        report.note(say("steps/s", steps[of.clone()].iter().map(|step| 1.0 / step).collect()));
        if let Some(frames) = &frames {
            let both = steps[of.clone()].iter().zip(&frames[of]).map(|(step, frame)| 1.0 / (step + frame));
            report.note(say("frames/s with it", both.collect()));
        }
    }
    let last = width - 1;
    let saved = |row: usize, at: usize| steps[at] / steps[row * width + at];
    report.figure("levels and selection over neither, 0 m", saved(BOTH, 0), "×");
    report.judged("levels and selection over neither, 12 m", saved(BOTH, last), "×", Bar::AtLeast(SAVED));
    for ((row, name), least) in [(BY_SUM, "their sum"), (BY_EACH, "each")].into_iter().zip(LEFT_OUT) {
        report.figure(format!("trains by {name} over all, without levels, 12 m"), saved(row, last), "×");
        let left_out = 100.0 * (1.0 - trains[row * width + last] / trains[NONE * width + last]);
        report.judged(format!("trains left out by {name}, 12 m"), left_out, "%", Bar::AtLeast(least));
    }
    drop(cells);
    default_sea(common, &plugins, &mut report)?;
    report.note(format!(
        "Steps: {} workers, {ROUNDS} short rounds in which all cells take turns; each one's best counts. The paper: Athlon \
         XP 2400+, GeForce FX 5700 LE.",
        open::workers(common)
    ));
    Ok(report)
}

/// The same with a digit behind the point.
fn tenths(values: &[f64]) -> String {
    values.iter().map(|value| format!("{value:>9.1}")).collect()
}

/// Wave trains that the last step evaluated for one orbit, in the mean.
fn trains_an_orbit(world: &World) -> f64 {
    figure(world, "wave trains in them") / figure(world, "orbits in a step").max(1.0)
}

/// The sea of one cell of the table.
fn cell(common: &Common, plugins: &Registry, row: &Row, distance: f64) -> Result<World, Failure> {
    let mut world = world(common, plugins, SCENE, |_| ())?;
    switch(&mut world, row.trains, row.levels);
    let (eye, target) = (DVec3::new(0.3, -1.0, FACE + distance), DVec3::new(0.0, -1.0, 0.0));
    let pose = CameraPose { position: eye, rotation: camera::facing(eye, target), ..world.frame().camera };
    world.set_camera(Some(pose));
    warm(&mut world, WARM_STEPS)?;
    Ok(world)
}

/// Switches the levels of detail of all particles.
fn switch(world: &mut World, trains: Trains, levels: bool) {
    set(world, |_, key| {
        let on = match key {
            "trains" => trains != Trains::All,
            "selection" => trains == Trains::Each,
            "visible" | "masters" | "fog" => levels,
            _ => return None,
        };
        Some(f64::from(on))
    });
}

/// A step of the default sea's particles alone, with levels of detail and without.
fn default_sea(common: &Common, plugins: &Registry, report: &mut Report) -> Result<(), Failure> {
    let load = |levels: bool| -> Result<World, Failure> {
        let mut world = world(common, plugins, open::DEFAULT_SCENE, |scene| {
            scene.modules.retain(|module| module.plugin == PLUGIN);
        })?;
        switch(&mut world, if levels { Trains::Sum } else { Trains::All }, levels);
        warm(&mut world, WARM_STEPS)?;
        Ok(world)
    };
    let (mut with, mut without) = (load(true)?, load(false)?);
    let particles = particles(&with);
    let (shown, all) = (sprites(&with), sprites(&without));
    let things: Vec<Work<'_>> = vec![Box::new(|| with.step()), Box::new(|| without.step())];
    let seen = rounds(things, ROUNDS);
    running(&mut with)?;
    running(&mut without)?;
    let [with, without] = [0, 1].map(|column| 1e3 * best(&seen, column));
    report.figure("particles of the default sea", particles, "");
    report.figure("sprites of it, with levels of detail", shown, "");
    report.figure("sprites of it, without", all, "");
    report.judged("a step of them, with levels of detail", with, "ms", Bar::AtMost(DEFAULT_SEA));
    report.figure("a step of them, without", without, "ms");
    report.figure("levels of detail over none", without / with, "×");
    Ok(())
}

/// Particles of a sea, as its scene counts them.
fn particles(world: &World) -> f64 {
    let boxes = world.scene().modules.iter().filter_map(|module| module.config.get("boxes")?.as_array());
    boxes.flatten().filter_map(|table| table.get("count")?.as_f64()).sum()
}

fn sprites(world: &World) -> f64 {
    world.frame().outputs.iter().map(|output| output.billboards.len() as f64).sum()
}
