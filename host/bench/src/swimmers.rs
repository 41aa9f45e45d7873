//! What the benches of fish share: a sea of fish that are stepped and not drawn, on the host's own workers.

use glam::DVec3;
use reef_command::{Common, open};
use reef_fish_model::{
    Fish,
    shoal::{Kind, Shoal, Surroundings, Waves},
    sow::Stock,
    species::Species,
};
use reef_flow::Level;
use reef_plugin::Registry;
use reef_report::failure::Failure;
use reef_sdk::prelude::*;
use reef_sea::World;
use serde_json::json;

use super::cells::{set, warm, world};

/// A scene whose first module has one fish of the default species, without whims.
const SCENE: &str = "fish-swim";
/// Cubic lengths of water that each fish begins with: so many neighbours as they take note of are near then.
pub(super) const WATER: f64 = 2.0;
/// Share of their box in which fish begin.
const BEGIN: f64 = 0.8;
/// Where the middle of the box is [m].
const DEPTH: f64 = 500.0;
/// Nobody is so far from the eye that its body is not stepped [m].
const FAR: f64 = 1000.0;
/// Steps before anything is measured: how far fish look has come to what it is in a crowd.
const WARM_STEPS: usize = 200;

/// What is stepped of each fish.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum As {
    Points,
    Bodies,
}

/// The default species.
pub(super) fn kind() -> Result<Kind, Failure> {
    let problem = |error: reef_fish_model::body::BodyError| {
        Failure::check(miette::miette!("the default fish: {}: {}", error.key, error.problem))
    };
    Kind::new(&Species::default(), Vec::new()).map_err(problem)
}

/// So many fish on so many workers, in still water without a bed.
pub(super) fn sea(common: &Common, workers: usize, count: usize, how: As) -> Result<World, Failure> {
    let common = Common { workers: Some(workers), ..common.clone() };
    let mut plugins = Registry::new();
    plugins
        .add_linked(reef_sdk::entry::<Swimmers>(), open::workers(&common))
        .map_err(|refusal| Failure::check(miette::miette!("the linked model: {refusal}")))?;
    let side = kind()?.length() * (WATER * count as f64).cbrt() / BEGIN;
    let corner = |sign: f64| [0.5 * sign * side, 0.5 * sign * side - DEPTH, 0.5 * sign * side];
    let mut world = world(&common, &plugins, SCENE, |scene| {
        scene.modules.truncate(1);
        for groups in scene.modules.iter_mut().filter_map(|module| module.config.pointer_mut("/groups")) {
            *groups =
                json!([{ "species": "thesis", "count": count, "low": corner(-1.0), "high": corner(1.0) }]);
        }
    })?;
    set(&mut world, |_, key| (key == "near").then_some(if how == As::Bodies { FAR } else { 0.0 }));
    warm(&mut world, WARM_STEPS)?;
    Ok(world)
}

/// The fish module's shoal alone: it emits nothing.
struct Swimmers(Shoal);

/// Number of the fish's parameter `near`.
fn near() -> u32 {
    Fish::params().iter().find(|param| param.key == "near").map_or(0, |param| param.id)
}

impl Plugin for Swimmers {
    const ID: &'static str = Fish::ID;
    const NAME: &'static str = Fish::NAME;
    const VERSION: &'static str = Fish::VERSION;
    const VENDOR: &'static str = Fish::VENDOR;
    const DESCRIPTION: &'static str = Fish::DESCRIPTION;
    const STATE_VERSION: u32 = Fish::STATE_VERSION;
    const STATE_MIN_VERSION: u32 = Fish::STATE_MIN_VERSION;
    type Config = <Fish as Plugin>::Config;

    fn params() -> &'static [Param] {
        Fish::params()
    }

    fn create(_host: &Host, scene: &SceneInfo, config: Self::Config) -> Result<Self, ConfigError> {
        Ok(Self(Stock::new(scene, &config)?.shoal))
    }

    fn step(&mut self, input: &StepInput, _output: &mut Output) -> Result<Status, StepError> {
        let shoal = &mut self.0;
        shoal.step(&Surroundings {
            flow: &[],
            bed: None,
            waves: Waves::default(),
            obstacles: &[],
            strangers: &[],
            surface: 0.0,
            hosts: &[],
            eye: DVec3::new(0.0, -DEPTH, 0.0),
            near: input.param(near()),
            dt: input.dt(),
            level: Level::at_most(input.simd_level()),
            workers: input.workers(),
        });
        input.host().figure(BYTES, shoal.bytes() as f64 / shoal.fish().len() as f64);
        Ok(Status::Ok)
    }

    fn save(&self, state: &mut StateWriter) {
        self.0.save().write(state);
    }

    fn load(&mut self, state: &mut StateReader) -> Result<(), StateError> {
        let problem = |problem: String| StateError::Refused(format!("the saved state {problem}"));
        self.0.load(&reef_fish_model::shoal::State::read(state)?).map_err(problem)
    }
}

/// The figure of a sea that says how much memory a fish takes [bytes].
pub(super) const BYTES: &str = "bytes a fish";
