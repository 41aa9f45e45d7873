//! Seas of linked models, and what becomes of a scene.

use std::{
    path::{Path, PathBuf},
    sync::OnceLock,
};

use reef_plugin::{Health, Registry};
use reef_sea::{
    Options, World, WorldError,
    scene::{self, error::Source},
};

/// Worker threads of a module.
const WORKERS: usize = 1;

/// All models, linked.
///
/// # Panics
/// When a model's description is unsound.
pub fn models() -> &'static Registry {
    static MODELS: OnceLock<Registry> = OnceLock::new();
    MODELS.get_or_init(|| {
        let mut models = Registry::new();
        for entry in [
            reef_sdk::entry::<reef_anemone_model::Anemones>(),
            reef_sdk::entry::<reef_fish_model::Fish>(),
            reef_sdk::entry::<reef_jellyfish_model::Jellyfish>(),
            reef_sdk::entry::<reef_particles_model::Particles>(),
            reef_sdk::entry::<reef_seaweed_model::Seaweeds>(),
        ] {
            models.add_linked(entry, WORKERS).expect("a sound model");
        }
        models
    })
}

/// The folder of assets.
pub fn assets() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets")
}

/// Makes the sea of a text. `Ok(None)`: it was refused, with a place. `Err`: a finding.
pub fn world(text: &str) -> Result<Option<World>, String> {
    let path = Path::new("fuzz.toml");
    let source = Source { name: "fuzz.toml".into(), text: text.into() };
    let placed = |told: String| match told.strip_prefix("fuzz.toml:").or_else(|| in_species(&told)) {
        Some(rest) if rest.starts_with(|c: char| c.is_ascii_digit()) => Ok(None),
        _ => Err(format!("refused without a place: {told}")),
    };
    let scene = match scene::load_text(path, source, &assets(), models()) {
        Ok(scene) => scene,
        Err(error) => return placed(error.to_string()),
    };
    match World::new(scene, models(), &Options::default()) {
        Ok(world) => Ok(Some(world)),
        Err(WorldError::Scene(error)) => placed(error.to_string()),
        Err(error) => Err(format!("refused without a place: {error}")),
    }
}

/// The place in a file of a species that a message begins with.
fn in_species(told: &str) -> Option<&str> {
    Some(told.split_once(".toml:").filter(|(path, _)| path.contains("species"))?.1)
}

/// Steps a sea; `Err`: what a module did wrong. What modules emit is looked at by the host after each step:
/// numbers that are not finite discard it, and that is told.
pub fn step(world: &mut World, steps: usize) -> Result<(), String> {
    for _ in 0..steps {
        world.step();
    }
    for (at, (name, _)) in world.modules().enumerate() {
        if let Some(Health::Faulty(text)) = world.instance(at).map(|instance| instance.health()) {
            return Err(format!("module {name}: {text}"));
        }
    }
    match world.take_messages().first() {
        Some(message) => Err(format!("module {}: {}", message.module, message.text)),
        None => Ok(()),
    }
}

/// A scene's text and so many steps.
pub fn live(text: &str, steps: usize) -> Result<(), String> {
    match world(text)? {
        Some(mut world) => step(&mut world, steps),
        None => Ok(()),
    }
}
