//! Seas of linked models, and what becomes of a scene.

use std::{
    path::{Path, PathBuf},
    sync::OnceLock,
};

use reef_abi as abi;
use reef_plugin::{Health, Registry};
use reef_sea::{
    Options, World, WorldError,
    scene::{self, error::Source},
};

/// Worker threads of a module.
const WORKERS: usize = 1;

/// A module that is tried.
#[derive(Clone, Copy, Debug)]
pub struct Module {
    /// Its name in files of species, and behind `reef.`.
    pub name: &'static str,
    entry: fn() -> &'static abi::Entry,
    /// A species that it has; empty: it has none.
    pub species: &'static str,
    /// The least of a configuration, with the species `s`.
    pub config: &'static str,
}

/// All of them.
pub const MODULES: [Module; 5] = [
    Module {
        name: "anemone",
        entry: reef_sdk::entry::<reef_anemone_model::Anemones>,
        species: "stomphia-coccinea",
        config: "anemones = [{ species = \"s\", position = [0.0, 0.0, 0.0] }]",
    },
    Module {
        name: "fish",
        entry: reef_sdk::entry::<reef_fish_model::Fish>,
        species: "clownfish",
        config: "groups = [{ species = \"s\", low = [-2.0, -3.5, -2.0], high = [2.0, -0.5, 2.0] }]",
    },
    Module {
        name: "jellyfish",
        entry: reef_sdk::entry::<reef_jellyfish_model::Jellyfish>,
        species: "moon-jelly",
        config: "animals = [{ species = \"s\", position = [0.0, -2.0, 0.0] }]",
    },
    Module {
        name: "particles",
        entry: reef_sdk::entry::<reef_particles_model::Particles>,
        species: "",
        config: "boxes = [{ kind = \"detritus\", low = [-2.0, -3.5, -2.0], high = [2.0, -0.5, 2.0], \
                 count = 40 }]",
    },
    Module {
        name: "seaweed",
        entry: reef_sdk::entry::<reef_seaweed_model::Seaweeds>,
        species: "fucus",
        config: "plants = [{ species = \"s\", position = [0.0, 0.0, 0.0] }]",
    },
];

impl Module {
    /// Its plugin's id.
    pub fn id(&self) -> String {
        format!("reef.{}", self.name)
    }

    /// A scene's table with the module alone.
    ///
    /// # Panics
    /// When its configuration is no TOML.
    pub fn scene(&self) -> toml::Table {
        let text = format!("modules.m.use = \"{}\"\nmodules.m.{}\n", self.id(), self.config);
        text.parse().expect("TOML of this file")
    }
}

/// A scene's table with a species of its own, which it calls `s`.
pub fn with_species(mut scene: toml::Table, species: toml::Table) -> toml::Table {
    scene.insert("species".to_owned(), toml::Table::from_iter([("s".to_owned(), species.into())]).into());
    scene
}

/// A small sea with something of everybody's.
pub const SMALL: &str = include_str!("../corpus/sea.toml");

/// All models, linked.
///
/// # Panics
/// When a model's description is unsound.
pub fn models() -> &'static Registry {
    static MODELS: OnceLock<Registry> = OnceLock::new();
    MODELS.get_or_init(|| {
        let mut models = Registry::new();
        for module in MODULES {
            models.add_linked((module.entry)(), WORKERS).expect("a sound model");
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
    world_among(text, &assets())
}

/// The same with another folder of assets.
pub fn world_among(text: &str, assets: &Path) -> Result<Option<World>, String> {
    let path = Path::new("fuzz.toml");
    let source = Source { name: "fuzz.toml".into(), text: text.into() };
    let placed = |told: String| match told.strip_prefix("fuzz.toml:").or_else(|| in_species(&told)) {
        Some(rest) if rest.starts_with(|c: char| c.is_ascii_digit()) => Ok(None),
        _ => Err(format!("refused without a place: {told}")),
    };
    let scene = match scene::load_text(path, source, assets, models()) {
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
