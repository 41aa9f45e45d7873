//! The scene's waves as modules feel them: through the step's input, on any number of workers.

use reef_flow::{
    Level,
    sample::Points,
    waves::{Carried, Trains, carry, reference},
};
use reef_plugin::Registry;
use reef_sdk::{Chunks, prelude::*};
use reef_sea::{
    Options, World,
    scene::{error::Source, load_text},
    step::hash::Chain,
};

/// Corks whose water is carried by the waves.
struct Corks {
    centers: Vec<[f64; 3]>,
    places: Vec<[f64; 3]>,
}

#[derive(serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
struct Config {}

impl Plugin for Corks {
    const ID: &'static str = "test.corks";
    const NAME: &'static str = "Corks";
    const VERSION: &'static str = "1.0.0";
    const VENDOR: &'static str = "Test";
    const DESCRIPTION: &'static str = "Bodies on orbits.";
    const STATE_VERSION: u32 = 1;
    const STATE_MIN_VERSION: u32 = 1;
    type Config = Config;

    fn create(_: &Host, _: &SceneInfo, _: Config) -> Result<Self, ConfigError> {
        let center = |i: usize| [30.0 + 0.7 * i as f64, -0.12 * i as f64, -0.4 * i as f64];
        let centers: Vec<_> = (0..40).map(center).collect();
        Ok(Self { places: centers.clone(), centers })
    }

    fn step(&mut self, input: &StepInput, output: &mut Output) -> Result<Status, StepError> {
        let (waves, depth) = (input.waves(), f64::from(input.water().depth));
        let level = Level::at_most(input.simd_level());
        let centers = &self.centers;
        input.workers().for_each_part(Chunks::new(&mut self.places, 7), |chunk, places| {
            for (i, place) in places.iter_mut().enumerate() {
                // Each cork's own origin.
                let center = centers[7 * chunk + i];
                let mut trains = Trains::new();
                trains.fill(waves, depth, center);
                let mut out = [[0.0_f32; 1]; 6];
                let [px, py, pz, vx, vy, vz] = &mut out;
                let zero = [0.0_f32; 1];
                let carried = Carried { position: [px, py, pz], velocity: [vx, vy, vz] };
                carry(level, &trains, usize::MAX, Points { x: &zero, y: &zero, z: &zero }, carried);
                *place = [0, 1, 2].map(|axis| center[axis] + f64::from(out[axis][0]));
            }
        });
        let objects = output.reserve::<abi::Object>(self.places.len())?;
        for (i, object) in objects.iter_mut().enumerate() {
            *object = abi::Object {
                id: i as u64 + 1,
                origin: self.places[i],
                bounds_radius: 0.1,
                ..Default::default()
            };
        }
        output.commit::<abi::Object>(self.places.len())?;
        Ok(Status::Ok)
    }

    fn save(&self, _: &mut StateWriter) {}

    fn load(&mut self, _: &mut StateReader) -> Result<(), StateError> {
        Ok(())
    }
}

const WINDY: &str = "[scene]\nseed = 3\n[waves]\nwind = 4\ndirection = 30\n\
                     [[wave]]\namplitude = 0.2\nwavelength = 25\n[modules.corks]\nuse = 'test.corks'\n";

fn world(text: &str, workers: usize, simd_level: Option<u32>) -> World {
    let mut plugins = Registry::new();
    plugins.add_linked(reef_sdk::entry::<Corks>(), workers).expect("the linked plugin is sound");
    let path = std::path::Path::new("waves.toml");
    let source = Source { name: "waves".into(), text: text.into() };
    let scene = load_text(path, source, path, &plugins).expect("a good scene");
    World::new(scene, &plugins, &Options { simd_level, ..Options::default() }).expect("a sea")
}

fn places(world: &World) -> Vec<[f64; 3]> {
    world.frame().outputs[0].objects.iter().map(|object| object.origin).collect()
}

fn center(i: usize) -> [f64; 3] {
    [30.0 + 0.7 * i as f64, -0.12 * i as f64, -0.4 * i as f64]
}

#[test]
fn every_module_feels_the_trains_that_the_caustics_see_at_the_time_of_its_step() {
    let mut world = world(WINDY, 2, None);
    let (start, depth) = (world.environment().waves.clone(), world.scene().file.water.depth);
    assert_eq!(start.len(), 31, "thirty of the wind's and one of the list");
    let mut moved: f64 = 0.0;
    for step in 0..=300 {
        let time = f64::from(step) / 60.0;
        let waves: Vec<abi::Wave> = start
            .iter()
            .map(|wave| abi::Wave {
                phase: (f64::from(wave.phase) - f64::from(wave.frequency) * time) as f32,
                ..*wave
            })
            .collect();
        for (i, place) in places(&world).iter().enumerate() {
            let center = center(i);
            let [d, ..] = reference::orbit(&waves, depth, center);
            for axis in 0..3 {
                // f32 phases and frequencies over 5 s: 1e-5 rad of orbits that sum to a metre.
                let error = place[axis] - center[axis] - d[axis];
                assert!(error.abs() < 2e-5, "step {step}, cork {i}, axis {axis}: {error:e}");
                moved = moved.max(d[axis].abs());
            }
        }
        world.step();
    }
    assert!(moved > 0.2, "{moved}");
}

#[test]
fn the_waves_are_the_same_bytes_on_one_worker_and_three_and_at_every_level() {
    let hash = |workers, level| {
        let mut world = world(WINDY, workers, level);
        let mut chain = Chain::default();
        for _ in 0..30 {
            world.step();
            chain.add(&mut world).expect("states are saved");
        }
        chain.digest
    };
    let one = hash(1, None);
    assert_eq!(one, hash(3, None));
    for level in Level::all() {
        assert_eq!(one, hash(2, Some(level.code())), "{}", level.name());
    }
}

#[test]
fn in_a_calm_nothing_moves() {
    let mut world = world("[waves]\nwind = 0.1\n[modules.corks]\nuse = 'test.corks'\n", 1, None);
    for _ in 0..100 {
        world.step();
        assert!(places(&world).iter().enumerate().all(|(i, place)| *place == center(i)));
    }
    assert!(world.environment().waves.is_empty());
}
