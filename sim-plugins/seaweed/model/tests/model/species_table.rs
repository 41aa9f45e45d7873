//! assets/species/SEAWEEDS.md is made from the code and held to it here.
//! After a change: REEF_WRITE_TABLE=1 cargo test -p reef-seaweed-model --test model species_table

use std::fmt::Write as _;

use glam::DVec3;
use reef_flow::Level;
use reef_model_tests::species::{self, parameters};
use reef_sdk::Workers;
use reef_seaweed_model::{
    bed::{Bed, Kind, Plant, Surroundings},
    grow,
    levels::Levels,
    modelled::Model,
    skeleton::Skeleton,
    species::Species,
};
use serde_json::Value;

use crate::common::*;

/// Seaweeds in assets: what stands on a `stem`.
pub fn names() -> Vec<String> {
    species::names(|table| table.get("stem").is_some())
}

/// A species file as the host hands it over.
pub fn species_value(name: &str) -> Value {
    species::table(name)
}

/// A species file.
pub fn species(name: &str) -> Species {
    serde_json::from_value(species::table(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// The skeleton of a species file, grown or modelled.
fn skeleton_of(name: &str) -> Skeleton {
    let species = species(name);
    match species.skeleton.as_str() {
        "" => grow::skeleton(&species).expect("a skeleton"),
        file => {
            let bytes = files(file).expect("it is among the assets");
            let (_, segments) = Model::read(&bytes, &species).unwrap_or_else(|e| panic!("{file}: {e:?}"));
            skeleton(&segments)
        }
    }
}

fn page() -> String {
    let mut out = String::from(
        "# Seaweeds\n\n\
         The species in this folder that have a `stem`. A table needs only what differs from the defaults below. `base = \"OTHER\"`\n\
         takes all else from another species. Lengths are metres at a size of 1, whatever a scene counts in; individuals differ by\n\
         `variation`.\n\n\
         Both tables are made from the code (`sim-plugins/seaweed/model/src/species.rs`) and from the files, and a test keeps\n\
         them so.\n\n\
         ## Parameters\n\n",
    );
    let parameters = parameters::<Species>();
    out.push_str(&species::parameter_rows(&parameters, "what it does to the look"));
    let names = names();
    out.push_str("\n## Species\n\nOne column a species, all values with what the defaults fill in.\n\n");
    let filled = |name: &String| (name.clone(), serde_json::to_value(species(name)).expect("plain data"));
    out.push_str(&species::species_columns(&parameters, &names.iter().map(filled).collect::<Vec<_>>()));
    let segments: Vec<String> = names.iter().map(|name| skeleton_of(name).len().to_string()).collect();
    writeln!(out, "| segments in all | {} |", segments.join(" | ")).expect("a string");
    out
}

#[test]
fn the_table_of_seaweeds_is_up_to_date() {
    species::hold("SEAWEEDS.md", &page(), "cargo test -p reef-seaweed-model --test model species_table");
}

#[test]
fn every_parameter_says_what_it_does_and_every_number_has_a_range() {
    let parameters = parameters::<Species>();
    assert!(parameters.len() > 40, "{}", parameters.len());
    for p in &parameters {
        assert!(p.effect.len() > 10, "{} has no description", p.key);
        let number = p.default.parse::<f64>().is_ok();
        assert!(!number || p.range.contains('…'), "{} has no range", p.key);
    }
}

#[test]
fn every_species_file_keeps_to_the_ranges_of_its_parameters() {
    let names = names();
    assert_eq!(names, ["fucus", "macrocystis", "plocamium", "saccharina", "sea-palm", "zostera"]);
    for name in names {
        let species = species(&name);
        reef_sdk::ranges::check(&species).unwrap_or_else(|error| panic!("{name}: {error}"));
        species.check().unwrap_or_else(|(key, problem)| panic!("{name}: {key} {problem}"));
    }
}

/// A species in a current of 0.15 m/s and a swell: how far its highest node leans and sways, as shares of its
/// height.
fn ways(name: &str) -> (f64, f64, f64) {
    let skeleton = skeleton_of(name);
    let depth = 12.0_f64.min(skeleton.reach() + 2.0);
    let root = DVec3::new(0.1, -depth, 0.1);
    let kinds = vec![Kind::new(skeleton, 0.3, 0.0)];
    let mut bed = Bed::new(kinds, vec![Plant { root, ground: Some(DVec3::Y), ..plant(root) }]);
    let camera = camera(root + DVec3::new(0.0, 1.0, 4.0), root);
    let highest = |bed: &mut Bed| {
        let mut poses = vec![Default::default(); bed.joint_count()];
        bed.write_poses(Level::best(), Workers::inline(), &mut poses);
        let nodes: Vec<DVec3> = bed.nodes(0, &poses).map(|node| node - root).collect();
        let top = nodes.iter().fold(DVec3::ZERO, |top, node| if node.y > top.y { *node } else { top });
        (nodes.iter().copied().sum::<DVec3>() / nodes.len() as f64, top)
    };
    let (rest, _) = highest(&mut bed);
    let flow = [current(DVec3::new(0.15, 0.0, 0.0))];
    let (mut low, mut high, mut top) = (f64::MAX, f64::MIN, 0.0_f64);
    for step in 0..3000 {
        let waves = [swell(0.25, 6.0, f64::from(step) * DT)];
        bed.step(&Surroundings { depth, ..around(&flow, &waves, &camera) }, &Levels::none());
        if step > 2000 {
            let (middle, highest) = highest(&mut bed);
            (low, high, top) = (low.min(middle.x), high.max(middle.x), top.max(highest.y));
        }
    }
    let height = rest.y * 2.0;
    ((0.5 * (low + high) - rest.x) / height, (high - low) / height, top / height)
}

#[test]
fn every_species_leans_and_sways_and_stays_up() {
    for name in names() {
        let (lean, sway, top) = ways(&name);
        println!("{name}: leans {lean:.2}, sways {sway:.2}, top {top:.2} of its height");
        assert!((0.02..0.9).contains(&lean), "{name} leans by {lean} of its height");
        assert!((0.03..1.2).contains(&sway), "{name} sways by {sway} of its height");
        assert!(top > 0.3, "{name} lies down: {top}");
    }
}
