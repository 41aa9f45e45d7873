//! `reef bench table2`: the scene of table 2 of Coulais et al. 2005 (§4.5) — 25 to 300 seaweeds on 40 × 10
//! m in a uniform current — with and without levels of detail, beside the paper's figures; and its 100
//! seaweeds with 2 400 particles.
//!
//! As in table 1, steps and pictures are told apart: what the levels of detail save of the simulation is
//! judged by ratios within one run.

use reef_command::{Common, open};
use reef_plugin::Registry;
use reef_report::failure::Failure;
use reef_sea::World;
use serde_json::{Value, json};

use super::{
    cells::{figure, line, pictures, set, warm, world},
    fibre::running,
    measure::{Work, best, rounds},
    report::{Bar, Report},
};

/// The paper's scene.
const SCENE: &str = "seaweed-table2";
/// Plants, and the paper's frames a second without and with levels of detail.
const PLANTS: [f64; 5] = [25.0, 50.0, 100.0, 200.0, 300.0];
const PAPER: [[f64; 5]; 2] = [[63.0, 41.0, 24.0, 13.0, 9.0], [82.0, 59.0, 38.0, 22.0, 16.0]];
/// Their ground [m]: x, and z away from the eye.
const GROUND: [f64; 2] = [10.0, 40.0];
/// Plants and particles together, and the paper's frames a second of them.
const TOGETHER: (f64, u32, f64) = (100.0, 2400, 20.0);

/// Rounds in which all cells of the table take their turn.
const ROUNDS: usize = 30;
/// Steps before anything is measured: plants have gone over to their levels.
const WARM_STEPS: usize = 120;
/// What the levels of detail have to save of a step of 300 plants, as a multiple.
const SAVED: f64 = 1.5;
/// How many times as fast as the paper's simulation a step of 300 plants without levels of detail has to be.
const FASTER: f64 = 100.0;

/// Measures.
pub fn run(common: &Common) -> Result<Report, Failure> {
    let plugins = open::plugins(common)?;
    let mut cells = Vec::new();
    for levels in [false, true] {
        for plants in PLANTS {
            cells.push(cell(common, &plugins, plants, levels, 0)?);
        }
    }
    cells.push(cell(common, &plugins, TOGETHER.0, true, TOGETHER.1)?);
    let things: Vec<Work<'_>> = cells.iter_mut().map(|world| Box::new(|| world.step()) as Work<'_>).collect();
    let seen = rounds(things, ROUNDS);
    for world in &mut cells {
        running(world)?;
    }
    let steps: Vec<f64> = (0..cells.len()).map(|column| best(&seen, column)).collect();
    let mut report = Report::default();
    let frames = pictures(common, &cells, &mut report)?;
    let width = PLANTS.len();
    report.note(format!("{:<31}{}", "plants", line(&PLANTS)));
    for (row, (name, paper)) in ["no levels of detail", "levels of detail"].iter().zip(PAPER).enumerate() {
        let of = row * width..(row + 1) * width;
        for (plants, step) in PLANTS.iter().zip(&steps[of.clone()]) {
            report.figure(format!("{plants} plants, {name}"), 1.0 / step, "steps/s");
        }
        let say =
            |what: &str, values: Vec<f64>| format!("{:<31}{}", format!("{name}, {what}"), line(&values));
        report.note(say("paper", paper.to_vec()));
        let count = |name: &str| cells[of.clone()].iter().map(|world| figure(world, name)).collect();
        report.note(say("joints", count("joints computed in a step")));
        report.note(say("steps/s", steps[of.clone()].iter().map(|step| 1.0 / step).collect()));
        if let Some(frames) = &frames {
            let both = steps[of.clone()].iter().zip(&frames[of]).map(|(step, frame)| 1.0 / (step + frame));
            report.note(say("frames/s", both.collect()));
        }
    }
    let saved = steps[width - 1] / steps[2 * width - 1];
    report.judged("levels of detail over none, 300 plants", saved, "×", Bar::AtLeast(SAVED));
    // What levels of detail save of the paper's frame is simulation: its share is no less.
    let simulated = 1.0 / PAPER[0][width - 1] - 1.0 / PAPER[1][width - 1];
    let faster = simulated / steps[width - 1];
    report.judged("300 plants without levels over the paper's", faster, "×", Bar::AtLeast(FASTER));
    let last = 2 * width;
    let together = format!("{} plants and {} particles", TOGETHER.0, TOGETHER.1);
    report.figure(together.clone(), 1.0 / steps[last], "steps/s");
    if let Some(frames) = &frames {
        report.figure("the same, with their pictures", 1.0 / (steps[last] + frames[last]), "frames/s");
    }
    report.note(format!(
        "Steps: {} workers, {ROUNDS} short rounds in which all cells take turns; each one's best counts. The paper: \
         frames/s of both on an Athlon XP 2400+, GeForce FX 5700 LE; {together} at about {}.",
        open::workers(common),
        TOGETHER.2,
    ));
    Ok(report)
}

/// A plant somewhere on the ground.
fn plant(number: u32) -> Value {
    let share = |ratio: f64| (f64::from(number) * ratio).fract();
    // Two ratios whose multiples fill the ground evenly.
    let position = [GROUND[0] * (share(0.754_877_666) - 0.5), 0.0, -GROUND[1] * share(0.569_840_291)];
    let (scale, yaw) = (0.5 + 0.25 * share(0.618_033_989), 360.0 * share(0.414_213_562));
    json!({ "species": "saccharina", "position": position, "scale": scale, "yaw": yaw, "seed": number })
}

/// The sea of one cell of the table.
fn cell(
    common: &Common,
    plugins: &Registry,
    plants: f64,
    levels: bool,
    particles: u32,
) -> Result<World, Failure> {
    let mut world = world(common, plugins, SCENE, |scene| {
        scene.file.waves = None;
        for module in &mut scene.modules {
            if let Some(beds) = module.config.get_mut("beds") {
                *beds = json!([]);
                module.config["plants"] = (0..plants as u32).map(plant).collect();
            }
            if let Some(count) = module.config.pointer_mut("/boxes/0/count") {
                *count = json!(particles);
            }
        }
        if particles == 0 {
            scene.modules.retain(|module| module.config.pointer("/boxes").is_none());
        }
    })?;
    set(&mut world, |plugin, key| match (plugin, key) {
        ("reef.seaweed", "segments" | "whole" | "visible" | "trains") => Some(f64::from(levels)),
        _ => None,
    });
    warm(&mut world, WARM_STEPS)?;
    Ok(world)
}
