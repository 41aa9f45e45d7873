//! `reef bench waves`: pairs of a particle and a wave train a second, position and velocity of the orbit,
//! beside a bare kernel over hot data in the same rounds.
//!
//! The load is a million particles that a small module of this file carries, linked into the program: the
//! trains come from a scene's wind sea through the step's input, the particles are shared out among the
//! host's workers. Nothing is emitted, culled or drawn.

use reef_command::{Common, open};
use reef_flow::{
    Level,
    sample::Points,
    waves::{
        self, Carried, Trains,
        bare::{Bare, Scalar},
    },
};
use reef_plugin::Registry;
use reef_report::failure::Failure;
use reef_sdk::{Chunks, prelude::*};
use reef_sea::{
    Options, World,
    scene::{error::Source, load_text},
};

use super::{
    fibre::running,
    measure::{Work, best, rounds},
    report::{Bar, Report},
};

/// Rounds in which everything takes its turn.
const ROUNDS: usize = 60;
/// Particles of the load.
const PARTICLES: usize = 1 << 20;
/// Particles that one job carries.
const CHUNK: usize = 4096;

/// The sea of the load: the paper's thirty trains, over water so deep that they are eq. (2) as printed.
const SCENE: &str = "[scene]\nname = 'bench-waves'\n[water]\ndepth = 100\n[waves]\nwind = 5\ntrains = 30\n\
                     [modules.particles]\nuse = 'reef.bench-waves'\n";

/// Measures.
pub fn run(common: &Common) -> Result<Report, Failure> {
    let level = Level::best();
    let mut one = world(common, 1)?;
    let mut two = world(common, 2)?;
    let sea = one.environment().waves.clone();
    let mut bare = Bare::new(&sea);
    let mut scalar = Scalar::new(&sea);
    let [mut deep, mut shelf] = [100.0, 5.0].map(|depth| Hot::new(&sea, depth));
    let load = (PARTICLES * sea.len()) as f64;
    let hot = (CHUNK * sea.len()) as f64;
    let units = [bare.evaluations() as f64, scalar.evaluations() as f64, hot, hot, load, load];
    let things: Vec<Work<'_>> = vec![
        Box::new(|| bare.step(level)),
        Box::new(|| scalar.step()),
        Box::new(|| deep.step(level)),
        Box::new(|| shelf.step(level)),
        Box::new(|| one.step()),
        Box::new(|| two.step()),
    ];
    let seen = rounds(things, ROUNDS);
    running(&mut one)?;
    running(&mut two)?;

    let mut report = Report::default();
    let rate = |column: usize| units[column] / best(&seen, column) / 1e9;
    const UNIT: &str = "G evaluations/s";
    report.figure(format!("bare kernel, one core, {}: the ceiling", level.name()), rate(0), UNIT);
    report.figure("the same in plain scalar code", rate(1), UNIT);
    report.figure("the sea's kernel alone, 100 m of water", rate(2), UNIT);
    report.figure("the sea's kernel alone, 5 m of water", rate(3), UNIT);
    report.figure("a million particles, one worker", rate(4), UNIT);
    report.figure("a million particles, two workers", rate(5), UNIT);
    report.judged("the million's share of the ceiling", 100.0 * rate(4) / rate(0), "%", Bar::AtLeast(60.0));
    report.figure("the million over scalar code", rate(4) / rate(1), "×");
    report.two_workers(rate(5) / rate(4));
    report.note(format!(
        "An evaluation: one particle and one of {} trains, position and velocity. {ROUNDS} short rounds in which all take \
         turns; each one's best counts.",
        sea.len()
    ));
    report.note(
        "The million goes the scene's way — file, wind sea, step input, the host's workers — through a module that is \
         linked into the program and emits nothing. Particles that are culled, selected by distance, put into streams and \
         drawn: reef bench table1.",
    );
    Ok(report)
}

/// The load's world on `workers` threads.
fn world(common: &Common, workers: usize) -> Result<World, Failure> {
    let mut plugins = Registry::new();
    plugins
        .add_linked(reef_sdk::entry::<Particles>(), workers)
        .map_err(|refusal| Failure::check(miette::miette!("the bench's own module: {refusal}")))?;
    let source = Source { name: "bench-waves".into(), text: SCENE.into() };
    let assets = open::assets_folder(common)?;
    let scene = load_text("bench-waves.toml".as_ref(), source, &assets, &plugins).map_err(Failure::input)?;
    World::new(scene, &plugins, &Options { seed: common.seed, ..Options::default() }).map_err(Failure::input)
}

/// Centres over 10 × 1 × 10 m, the paper's box, half a metre below the surface; where they are and how fast.
struct Body {
    center: [Vec<f32>; 3],
    position: [Vec<f32>; 3],
    velocity: [Vec<f32>; 3],
}

impl Body {
    /// The particles from `first` on, by the plastic number's sequence.
    fn new(first: usize) -> Self {
        let spread = |factor: f64, from: f32, size: f32| {
            (first..first + CHUNK).map(|i| from + size * (i as f64 * factor).fract() as f32).collect()
        };
        let center = [
            spread(0.754_877_666_246_692_8, -5.0, 10.0),
            spread(0.618_033_988_749_894_9, -1.5, 1.0),
            spread(0.569_840_290_998_053_3, -5.0, 10.0),
        ];
        let none = || core::array::from_fn(|_| vec![0.0; CHUNK]);
        Self { center, position: none(), velocity: none() }
    }

    fn carry(&mut self, level: Level, trains: &Trains) {
        let [x, y, z] = &self.center;
        let ([px, py, pz], [vx, vy, vz]) = (&mut self.position, &mut self.velocity);
        let out = Carried { position: [px, py, pz], velocity: [vx, vy, vz] };
        waves::carry(level, trains, usize::MAX, Points { x, y, z }, out);
    }
}

/// One job's particles again and again.
struct Hot {
    body: Body,
    trains: Trains,
}

impl Hot {
    fn new(sea: &[reef_abi::Wave], depth: f64) -> Self {
        let mut trains = Trains::new();
        trains.fill(sea, depth, [0.0; 3]);
        Self { body: Body::new(0), trains }
    }

    fn step(&mut self, level: Level) {
        self.body.carry(level, &self.trains);
    }
}

/// The load's module.
struct Particles {
    bodies: Vec<Body>,
    trains: Trains,
}

#[derive(serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
struct Config {}

impl Plugin for Particles {
    const ID: &'static str = "reef.bench-waves";
    const NAME: &'static str = "The load of reef bench waves";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const VENDOR: &'static str = "Reef";
    const DESCRIPTION: &'static str = "A million particles that nobody sees.";
    const STATE_VERSION: u32 = 1;
    const STATE_MIN_VERSION: u32 = 1;
    type Config = Config;

    fn create(_: &Host, _: &SceneInfo, _: Config) -> Result<Self, ConfigError> {
        let bodies = (0..PARTICLES).step_by(CHUNK).map(Body::new).collect();
        Ok(Self { bodies, trains: Trains::new() })
    }

    fn step(&mut self, input: &StepInput, _: &mut Output) -> Result<Status, StepError> {
        self.trains.fill(input.waves(), f64::from(input.water().depth), [0.0; 3]);
        let level = Level::at_most(input.simd_level());
        let trains = &self.trains;
        input.workers().for_each_part(Chunks::new(&mut self.bodies, 1), |_, bodies| {
            for body in bodies {
                body.carry(level, trains);
            }
        });
        Ok(Status::Ok)
    }

    /// Orbits follow from the step's input: there is nothing to remember.
    fn save(&self, _: &mut StateWriter) {}

    fn load(&mut self, _: &mut StateReader) -> Result<(), StateError> {
        Ok(())
    }
}
