//! Species tables, the files in assets, and assets/species/FISH.md, which is made from the code and held to
//! it here. After a change: REEF_WRITE_TABLE=1 cargo test -p reef-fish-model --test model species

use std::fmt::Write as _;

use reef_fish_model::{gait::Gait, species::Species};
use reef_model_tests::species::{self as tables, parameters};
use serde_json::{Value, json};

/// Fish in assets: what has a `body`.
fn names() -> Vec<String> {
    tables::names(|table| table.get("body").is_some())
}

/// A species file.
pub(crate) fn species(name: &str) -> Species {
    serde_json::from_value(tables::table(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

#[test]
fn all_species_in_assets_swim_forward_turn_and_know_their_prey() {
    let names = names();
    assert!(names.len() >= 7, "{names:?}");
    for name in &names {
        let species = species(name);
        species.check(name).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!(species.mind.prey.iter().all(|prey| names.contains(prey)), "{name}: {:?}", species.mind.prey);
        let plan = species.plan().expect("checked");
        let gait = Gait::of(&species, &plan).unwrap_or_else(|error| panic!("{name}: {error}"));
        let length = plan.body().length();
        let pitch = gait.pitch_rate * gait.turn;
        println!(
            "{name}: {length:.2} m, {:.3} m/s, {:.2} lengths/s at {:.2} Hz; turns {:.2}, pitches {pitch:.2} rad/s",
            gait.top_speed(),
            gait.top_speed() / length,
            gait.top_beat(),
            gait.fastest_turn(),
        );
        assert!(gait.top_speed() > 0.1 * length);
        assert!(gait.yaw_rate > 0.0 && pitch > 0.05);
    }
}

#[test]
fn what_no_species_can_be_is_refused_by_its_key() {
    let refused = |change: &dyn Fn(&mut Value)| {
        let mut table = tables::table("clownfish");
        change(&mut table);
        let species: Species = serde_json::from_value(table).expect("of the right types");
        species.check("clownfish").expect_err("refused").to_string()
    };
    let lists = |count: usize| {
        move |table: &mut Value| {
            for key in ["lengths", "half_widths", "half_heights"] {
                table["body"][key] = json!(vec![0.01; count]);
            }
        }
    };
    assert_eq!(refused(&lists(1)), "body.half_widths: has 1 sections; allowed: 2 to 64");
    assert_eq!(refused(&lists(10_000)), "body.half_widths: has 10000 sections; allowed: 2 to 64");
    let text = refused(&|table| table["material"]["long"] = json!(-3.0));
    assert_eq!(text, "material.long: must be above 0, is -3");
    let text = refused(&|table| table["material"]["mass"] = json!(0.0));
    assert_eq!(text, "material.mass: must be at least 0.000001, is 0");
    let text = refused(&|table| table["mind"]["prey"] = json!(["silverside", "clownfish"]));
    assert_eq!(text, "mind.prey[1]: `clownfish` must not hunt itself");
    let text = refused(&|table| table["swim"]["fastest"] = json!(1000.0));
    assert_eq!(text, "swim.fastest: must be at most 30, is 1000");
    let mut unknown = tables::table("clownfish");
    unknown["mind"]["fear"] = json!(1.0);
    let error = serde_json::from_value::<Species>(unknown).expect_err("refused").to_string();
    assert!(error.contains("unknown field `fear`"), "{error}");
}

#[test]
fn a_species_that_does_not_swim_is_refused() {
    let mut species = species("clownfish");
    species.swim.force = 0.0;
    let plan = species.plan().expect("a body");
    let error = Gait::of(&species, &plan).expect_err("refused").to_string();
    assert!(error.starts_with("swim: it swims 0.0000 lengths a second at its best"), "{error}");
}

fn page() -> String {
    let mut out = String::from(
        "# Fish\n\n\
         The species in this folder that have a `body`. A table needs only what differs from the defaults below. `base = \"OTHER\"`\n\
         takes all else from another species. Lengths are metres at a size of 1, whatever a scene counts in; individuals differ by\n\
         `variation`.\n\n\
         Both tables are made from the code (`sim-plugins/fish/model/src/species.rs`) and from the files, and a test keeps them so.\n\n\
         ## Parameters\n\n",
    );
    let parameters = parameters::<Species>();
    out.push_str(&tables::parameter_rows(&parameters, "what it does"));
    let names = names();
    out.push_str("\n## Species\n\nOne column a species, all values with what the defaults fill in.\n\n");
    let filled = |name: &String| (name.clone(), serde_json::to_value(species(name)).expect("plain data"));
    out.push_str(&tables::species_columns(&parameters, &names.iter().map(filled).collect::<Vec<_>>()));
    let sections = |name: &String| species(name).body.lengths.len().to_string();
    writeln!(out, "| sections | {} |", names.iter().map(sections).collect::<Vec<_>>().join(" | "))
        .expect("a string");
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
fn the_page_of_fish_is_up_to_date() {
    tables::hold("FISH.md", &page(), "cargo test -p reef-fish-model --test model species");
}
