//! assets/species/JELLYFISH.md, which is made from the code and the files and held to them here. After a
//! change: REEF_WRITE_TABLE=1 cargo test -p reef-jellyfish-model --test model species

use reef_jellyfish_model::species::Species;
use reef_model_tests::species::{self as tables, parameters};

use crate::sea::{names, read};

fn page() -> String {
    let mut out = String::from(
        "# Jellyfish\n\n\
         The species in this folder that have a `bell`. A table needs only what differs from the defaults below. `base = \"OTHER\"`\n\
         takes all else from another species. Lengths are metres at a size of 1, whatever a scene counts in; individuals differ by\n\
         the `variation` of their motion, and by the surface's `noise`.\n\n\
         Both tables are made from the code (`sim-plugins/jellyfish/model/src/species.rs`) and from the files, and a test keeps\n\
         them so.\n\n\
         ## Parameters\n\n",
    );
    let parameters = parameters::<Species>();
    out.push_str(&tables::parameter_rows(&parameters, "what it does"));
    out.push_str("\n## Species\n\nOne column a species, all values with what the defaults fill in.\n\n");
    let filled = |name: &String| (name.clone(), serde_json::to_value(read(name)).expect("plain data"));
    out.push_str(&tables::species_columns(&parameters, &names().iter().map(filled).collect::<Vec<_>>()));
    out
}

#[test]
fn every_key_says_what_it_does_in_which_range() {
    for p in parameters::<Species>() {
        assert!(!p.effect.is_empty(), "{}", p.key);
        let number = p.default.parse::<f64>().is_ok();
        assert!(!number || !p.range.is_empty(), "{} has no range", p.key);
    }
}

#[test]
fn the_page_of_jellyfish_is_up_to_date() {
    tables::hold("JELLYFISH.md", &page(), "cargo test -p reef-jellyfish-model --test model species");
}
