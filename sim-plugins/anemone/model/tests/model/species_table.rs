//! assets/species/README.md, the table of parameters that the paper wished for (§6), is made from the code
//! and held to it here. After a change: REEF_WRITE_TABLE=1 cargo test -p reef-anemone-model --test model
//! species_table

use std::fmt::Write as _;

use reef_anemone_model::species::Species;
use reef_model_tests::species::{self, Parameter, parameters};

use crate::scene;

fn readme() -> String {
    let mut out = String::from(
        "# Species\n\n\
         Each file here is one species of anemone, seagrass, seaweed, fish or jellyfish; a scene names it without the ending. Seaweeds,\n\
         which have a `stem`, are described in SEAWEEDS.md, fish, which have a `body`, in FISH.md, jellyfish, which have a `bell`, in JELLYFISH.md,\n\
         all others here. A table needs only what differs from the defaults below.\n\
         `base = \"OTHER\"` takes all else from another species. Lengths are metres at a size of 1, whatever a scene counts in;\n\
         individuals differ by `variation`.\n\n\
         Both tables are made from the code (`sim-plugins/anemone/model/src/species.rs`) and from the files, and a test keeps\n\
         them so.\n\n\
         ## Parameters\n\n",
    );
    let parameters = parameters::<Species>();
    out.push_str(&species::parameter_rows(&parameters, "what it does to the look"));
    let shown: Vec<&Parameter> = parameters.iter().filter(|p| p.key != "title").collect();
    out.push_str("\n## Species\n\nOne row a species, all values with what `base` and the defaults fill in.\n\n| species |");
    for p in &shown {
        write!(out, " {} |", p.key).expect("a string");
    }
    out.push_str("\n|---|");
    out.push_str(&"---|".repeat(shown.len()));
    for name in scene::species_names() {
        let table = serde_json::to_value(scene::species(&name)).expect("plain data");
        write!(out, "\n| {name} |").expect("a string");
        for p in &shown {
            write!(out, " {} |", species::value_at(&table, &p.key)).expect("a string");
        }
    }
    out.push('\n');
    out
}

#[test]
fn the_table_of_parameters_is_up_to_date() {
    species::hold("README.md", &readme(), "cargo test -p reef-anemone-model --test model species_table");
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
    let parameters = parameters::<Species>();
    for name in scene::species_names() {
        let table = serde_json::to_value(scene::species(&name)).expect("plain data");
        for p in &parameters {
            let bounds: Vec<f64> = p.range.split(" … ").filter_map(|b| b.parse().ok()).collect();
            let value = species::value_at(&table, &p.key).parse::<f64>();
            if let (&[least, most], Ok(value)) = (bounds.as_slice(), value) {
                assert!((least..=most).contains(&value), "{name}: {} = {value}", p.key);
            }
        }
    }
}
