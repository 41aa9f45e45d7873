//! Species tables, and the files in assets.

use std::path::PathBuf;

use reef_fish_model::{gait::Gait, species::Species};

/// The folder of species.
fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../assets/species")
}

/// A species file.
pub(crate) fn species(name: &str) -> Species {
    let text = std::fs::read_to_string(folder().join(format!("{name}.toml"))).expect("readable");
    toml::from_str(&text).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// Fish in assets: what has a `body`.
pub(crate) const NAMES: [&str; 7] =
    ["butterflyfish", "clownfish", "humpback", "moray", "reef-shark", "regal-tang", "silverside"];

#[test]
fn all_species_in_assets_swim_forward() {
    for name in NAMES {
        let species = species(name);
        species.check(name).unwrap_or_else(|error| panic!("{name}: {error}"));
        let plan = species.plan().expect("checked");
        let gait = Gait::of(&species, &plan).unwrap_or_else(|error| panic!("{name}: {error}"));
        let length = plan.body().length();
        println!(
            "{name}: {length:.2} m, {:.3} m/s, {:.2} lengths/s at {:.2} Hz; turns {:.2}, pitches {:.2} rad/s; {:?}",
            gait.top_speed(),
            gait.top_speed() / length,
            gait.top_beat(),
            gait.fastest_turn(),
            gait.pitch_rate * gait.turn,
            gait.stepping.longest
        );
    }
}
