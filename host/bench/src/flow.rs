//! `reef bench flow`: a step of figure 13's anemones in a sea with ten thousand singularities, each of an
//! object of its own, beside the same step with one; and what a query of many points with owners costs.
//!
//! The singularities are a small module's of this file, linked into the program, as fish would carry them:
//! they go the way of a step's outputs and input.

use std::path::Path;

use reef_anemone_model::Anemones;
use reef_command::{Common, open};
use reef_flow::{
    Field, Level, Packed,
    random::Random,
    sample::{Owner, Points, Velocities, sample_field},
};
use reef_report::failure::Failure;
use reef_sdk::prelude::*;
use reef_sea::{
    Options, World,
    scene::{assets, error::Source, load_text},
};

use super::{
    cells::times_of,
    fibre::running,
    measure::{best, median, rounds},
    report::{Bar, Report},
};

/// The scene of the anemones.
const SCENE: &str = "anemone-fig13-36-anemones";
/// Singularities, and the box that they are spread over [m]: the scene's ground, and the water over it.
const MANY: u32 = 10_000;
const LOW: [f64; 3] = [-12.0, -5.0, -12.0];
const HIGH: [f64; 3] = [12.0, -1.0, 12.0];
/// How far one acts [m]: a fish's length or two.
const REACH: f32 = 0.3;
/// Steps before anything is measured, and steps that are.
const WARM_STEPS: usize = 30;
const STEPS: usize = 200;
/// Of the queries' singularities, where the command line names no seed.
const SEED: u64 = 13;
/// Rounds of the queries.
const ROUNDS: usize = 40;

/// Measures.
pub fn run(common: &Common) -> Result<Report, Failure> {
    let (mut one, mut many) = (world(common, 1)?, world(common, MANY)?);
    let mut seen = [(); 4].map(|()| Vec::with_capacity(STEPS));
    for step in 0..WARM_STEPS + STEPS {
        for (world, [own, whole]) in [(&mut one, [0, 1]), (&mut many, [2, 3])] {
            let start = std::time::Instant::now();
            world.step();
            if step >= WARM_STEPS {
                let times = times_of(world, Anemones::ID).unwrap_or_default();
                seen[own].push(1e3 * times.code.as_secs_f64());
                seen[whole].push(1e3 * start.elapsed().as_secs_f64());
            }
        }
    }
    running(&mut one)?;
    running(&mut many)?;
    let [own, whole, own_of_many, whole_of_many] = seen.map(median);

    let mut report = Report::default();
    report.figure("the anemones' step with one singularity", own, "ms");
    report.figure(format!("the anemones' step with {MANY}"), own_of_many, "ms");
    report.judged("ten thousand over one", own_of_many / own, "×", Bar::AtMost(1.5));
    report.figure("the whole sea's step with one", whole, "ms");
    report.figure(format!("the whole sea's step with {MANY}"), whole_of_many, "ms");
    queries(&mut report, common.seed.unwrap_or(SEED));
    report.note(format!(
        "Figure 13: 36 anemones, 14 760 nodes. {MANY} sources of {REACH} m reach, each of an object of its own, spread over the \
         scene's water; medians of {STEPS} steps in turns. The anemones' step is the library's call alone; the whole sea's \
         has the host's lists of all primitives in it, one for those who emit and one for the others."
    ));
    Ok(report)
}

/// A point in the middle of each singularity, which does not feel its own: by one query, and by one each.
fn queries(report: &mut Report, seed: u64) {
    let flows = spread(MANY, seed);
    let mut field = Field::new();
    field.refill(&flows);
    let of = |way: usize| -> Vec<f32> { flows.iter().map(|flow| flow.position[way] as f32).collect() };
    let [x, y, z] = [of(0), of(1), of(2)];
    let owners: Vec<u64> = flows.iter().map(|flow| flow.owner).collect();
    let points = Points { x: &x, y: &y, z: &z };
    let mut out = [(); 3].map(|()| vec![0.0; x.len()]);
    let mut packed = Packed::new();
    let level = Level::best();
    let each = Box::new(|| {
        let [x, y, z] = &mut out;
        let out = Velocities { x, y, z };
        sample_field(level, &field, &mut packed, [0.0; 3], Owner::Each(&owners), points, out);
    });
    let seen = rounds(vec![each], ROUNDS);
    report.figure(format!("a query of {MANY} points with an owner each"), 1e3 * best(&seen, 0), "ms");
}

/// The scene's sea with so many singularities more.
fn world(common: &Common, count: u32) -> Result<World, Failure> {
    let mut plugins = open::plugins(common)?;
    plugins
        .add_linked(reef_sdk::entry::<Crowd>(), open::workers(common))
        .map_err(|refusal| Failure::check(miette::miette!("the bench's own module: {refusal}")))?;
    let folder = open::assets_folder(common)?;
    let path = assets::scene(Path::new(SCENE), &folder);
    let text = std::fs::read_to_string(&path)
        .map_err(|error| Failure::input(miette::miette!("{}: {error}", path.display())))?;
    let text = format!("{text}\n[modules.crowd]\nuse = \"{}\"\ncount = {count}\n", Crowd::ID);
    let source = Source { name: SCENE.into(), text: text.into() };
    let scene = load_text(&path, source, &folder, &plugins).map_err(Failure::input)?;
    World::new(scene, &plugins, &Options { seed: common.seed, ..Options::default() }).map_err(Failure::input)
}

/// Sources over the box, by a chance that is the same each time.
fn spread(count: u32, seed: u64) -> Vec<abi::Flow> {
    let mut random = Random::new(seed, u64::from_le_bytes(*b"sources\0"));
    (1..=u64::from(count))
        .map(|owner| abi::Flow {
            owner,
            kind: abi::FLOW_SOURCE,
            position: core::array::from_fn(|way| random.between(LOW[way], HIGH[way])),
            strength: 2e-3,
            peak: 0.3,
            core: 0.02,
            reach: REACH,
            fade: 0.5,
            ..abi::Flow::default()
        })
        .collect()
}

/// The load's module: what emits and is not seen.
struct Crowd(Vec<abi::Flow>);

#[derive(serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
struct Config {
    /// Singularities.
    count: u32,
}

impl Plugin for Crowd {
    const ID: &'static str = "reef.bench-flow";
    const NAME: &'static str = "The load of reef bench flow";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const VENDOR: &'static str = "Reef";
    const DESCRIPTION: &'static str = "Singularities that nobody sees.";
    const STATE_VERSION: u32 = 1;
    const STATE_MIN_VERSION: u32 = 1;
    type Config = Config;

    fn create(_: &Host, scene: &SceneInfo, config: Config) -> Result<Self, ConfigError> {
        Ok(Self(spread(config.count, scene.seed)))
    }

    fn step(&mut self, _: &StepInput, output: &mut Output) -> Result<Status, StepError> {
        output.emit(&self.0)?;
        Ok(Status::Ok)
    }

    fn save(&self, _: &mut StateWriter) {}

    fn load(&mut self, _: &mut StateReader) -> Result<(), StateError> {
        Ok(())
    }
}
