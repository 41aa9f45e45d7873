//! `reef bench seaweed`: joint-steps a second of the seaweeds, through a scene as every other scene runs —
//! file, world, dynamic library, streams — beside a bare kernel over hot data in the same rounds.

use reef_command::{Common, open};
use reef_flow::Level;
use reef_report::failure::Failure;
use reef_sea::World;
use reef_seaweed_model::bare::Bare;
use serde_json::json;

use super::{
    cells::{figure, set, warm, world},
    fibre::running,
    measure::{Work, best, rounds},
    report::{Bar, Report},
};

/// Plants that differ, in a uniform current.
const SCENE: &str = "seaweed-table2";
/// So many on a square metre of its ground of 400 m², 3000 in all: what they are costs more than what a step
/// costs by itself.
const DENSITY: f64 = 7.5;
/// Segments of the bare kernel's blades, as many as the scene's plants have.
const SEGMENTS: usize = 14;
/// Rounds in which everything takes its turn.
const ROUNDS: usize = 80;
/// Steps before anything is measured.
const WARM_STEPS: usize = 60;

/// A crowd: so many plants of so many segments.
const CROWD: (usize, usize) = (10_000, 100);
/// The ground that it stands on, along x and z [m].
const CROWDED: [f64; 2] = [60.0, 70.0];
/// Rounds in which the crowd takes its turns.
const CROWD_ROUNDS: usize = 12;

/// Measures.
pub fn run(common: &Common) -> Result<Report, Failure> {
    let level = Level::best();
    let (mut bare, mut twin) = (Bare::new(SEGMENTS), Bare::new(SEGMENTS));
    let mut one = sea(common, 1, Waves::None, false)?;
    let mut two = sea(common, 2, Waves::None, false)?;
    let mut waves = sea(common, 1, Waves::All, false)?;
    let mut levels = sea(common, 1, Waves::All, true)?;
    let joints = bare.joints() as f64;
    let things: Vec<Work<'_>> = vec![
        Box::new(|| bare.step(level)),
        Box::new(|| one.step()),
        Box::new(|| two.step()),
        Box::new(|| waves.step()),
        Box::new(|| levels.step()),
        Box::new(|| twin.step(Level::scalar())),
    ];
    let seen = rounds(things, ROUNDS);
    for world in [&mut one, &mut two, &mut waves, &mut levels] {
        running(world)?;
    }
    let computed = |world: &World| figure(world, "joints computed in a step");
    let rate = |column: usize, joints: f64| joints / best(&seen, column) / 1e6;
    let mut report = Report::default();
    const UNIT: &str = "M joint-steps/s";
    let ceiling = rate(0, joints);
    report.figure(format!("bare kernel, one core, {}: the ceiling", level.name()), ceiling, UNIT);
    report.figure(format!("the same, {}", Level::scalar().name()), rate(5, joints), UNIT);
    report.figure("through the scene, one worker", rate(1, computed(&one)), UNIT);
    report.figure("through the scene, two workers", rate(2, computed(&two)), UNIT);
    let share = 100.0 * rate(1, computed(&one)) / ceiling;
    report.judged("the scene's share of the ceiling", share, "%", Bar::AtLeast(50.0));
    report.two_workers(best(&seen, 1) / best(&seen, 2));
    report.figure("under wave trains, one worker", rate(3, computed(&waves)), UNIT);
    report.figure("a step under wave trains, no levels of detail", 1e3 * best(&seen, 3), "ms");
    report.figure("the same with levels of detail", 1e3 * best(&seen, 4), "ms");
    report.figure("joints computed then", computed(&levels), "");
    report.figure("joints drawn then", figure(&levels, "joints drawn"), "");
    report.judged("memory of a joint", figure(&one, "bytes a joint"), "B", Bar::AtMost(160.0));
    crowd(common, &mut report)?;
    report.note(format!(
        "A joint-step: both angles of one segment, for one step, in a uniform current. {ROUNDS} short rounds in which all \
         take turns of some steps; each one's best counts. The bare kernel: unbranched blades in water that is the same \
         everywhere, without surface, contacts and streams."
    ));
    Ok(report)
}

/// Measures the crowd on two workers.
fn crowd(common: &Common, report: &mut Report) -> Result<(), Failure> {
    let mut levels = crowded(common, true)?;
    let mut whole = crowded(common, false)?;
    let things: Vec<Work<'_>> = vec![Box::new(|| levels.step()), Box::new(|| whole.step())];
    let seen = rounds(things, CROWD_ROUNDS);
    for world in [&mut levels, &mut whole] {
        running(world)?;
    }
    let (plants, segments) = CROWD;
    let name = format!("{plants} plants of {segments} joints under wave trains, two workers");
    report.judged(format!("{name}, with levels of detail"), 1e3 * best(&seen, 0), "ms", Bar::AtMost(16.7));
    report.figure("the same without", 1e3 * best(&seen, 1), "ms");
    report.figure("joints computed with levels of detail", figure(&levels, "joints computed in a step"), "");
    report.figure("joints computed without", figure(&whole, "joints computed in a step"), "");
    let joints = (plants * segments) as f64;
    report.judged(
        "memory of a million joints",
        joints * figure(&whole, "bytes a joint") / 1e6,
        "MB",
        Bar::AtMost(200.0),
    );
    Ok(())
}

/// The crowd's sea: the scene's plants with more segments, on more ground.
fn crowded(common: &Common, levels: bool) -> Result<World, Failure> {
    let common = Common { workers: Some(2), ..common.clone() };
    let plugins = open::plugins(&common)?;
    let (plants, segments) = CROWD;
    let mut world = world(&common, &plugins, SCENE, |scene| {
        scene.modules.retain(|module| module.plugin == "reef.seaweed");
        for module in &mut scene.modules {
            let tables = module.species.values_mut().filter_map(|species| species.table.get_mut("stem"));
            tables.for_each(|stem| stem["segments"] = segments.into());
            if let Some(bed) = module.config.pointer_mut("/beds/0") {
                let [wide, long] = CROWDED;
                bed["density"] = (plants as f64 / (wide * long)).into();
                (bed["center"], bed["size"]) = (json!([0.0, 2.0 - 0.55 * long]), json!([wide, long]));
            }
        }
    })?;
    set(&mut world, |_, key| match key {
        "segments" | "whole" | "visible" | "trains" => Some(f64::from(levels)),
        _ => None,
    });
    warm(&mut world, WARM_STEPS)?;
    Ok(world)
}

/// Which waves there are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Waves {
    None,
    All,
}

/// The scene's sea on `workers` threads.
fn sea(common: &Common, workers: usize, waves: Waves, levels: bool) -> Result<World, Failure> {
    let common = Common { workers: Some(workers), ..common.clone() };
    let plugins = open::plugins(&common)?;
    let mut world = world(&common, &plugins, SCENE, |scene| {
        scene.modules.retain(|module| module.plugin == "reef.seaweed");
        let beds = scene.modules.iter_mut();
        for density in beds.filter_map(|module| module.config.pointer_mut("/beds/0/density")) {
            *density = DENSITY.into();
        }
    })?;
    set(&mut world, |_, key| match key {
        "segments" | "whole" | "visible" | "trains" => Some(f64::from(levels)),
        "waves" => Some(f64::from(waves == Waves::All)),
        // A uniform current alone, as in the paper.
        "sources" | "shelter" => Some(0.0),
        _ => None,
    });
    warm(&mut world, WARM_STEPS)?;
    Ok(world)
}
