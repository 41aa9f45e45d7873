//! From a table of a scene to animals: what is placed where, what is refused by its key, and what a bell
//! wears.

use glam::DVec3;
use reef_jellyfish_model::{config::Config, paint::Paint, sow::Stock, species::Look};
use reef_sdk::SceneInfo;
use serde_json::{Value, json};

fn scene(seed: u64) -> SceneInfo {
    let table =
        |name: &str| (name.to_owned(), serde_json::to_value(crate::sea::read(name)).expect("plain data"));
    let mut species: serde_json::Map<String, Value> =
        ["comb-jelly", "moon-jelly"].map(table).into_iter().collect();
    species.insert("coarse".into(), json!({"grid": {"cells": 3}}));
    species.insert("soft".into(), json!({"bell": {"stiffness": -1.0}}));
    species.insert("still".into(), json!({"motion": {"frequency": 0.0}}));
    species.insert("humming".into(), json!({"motion": {"frequency": 1000.0}}));
    species.insert("narrow".into(), json!({"grid": {"bells": 2.5}, "bell": {"height": 0.2}}));
    SceneInfo { seed, species, ..SceneInfo::default() }
}

fn stock(table: Value, seed: u64) -> Result<Stock, String> {
    let config: Config = serde_json::from_value(table).expect("of the right types");
    Stock::new(&scene(seed), &config).map_err(|error| error.to_string())
}

fn with(mut table: Value, more: Value) -> Value {
    table.as_object_mut().expect("a table").extend(more.as_object().expect("a table").clone());
    table
}

fn group(more: Value) -> Value {
    with(json!({"species": "comb-jelly", "low": [-2.0, -4.0, -3.0], "high": [2.0, -1.0, 3.0]}), more)
}

fn animal(more: Value) -> Value {
    with(json!({"species": "moon-jelly", "position": [0.0, -2.0, 0.0]}), more)
}

#[test]
fn animals_begin_inside_of_their_box_or_where_they_are_put() {
    let table = json!({
        "groups": [group(json!({"count": 60, "scale": [0.5, 2.0]}))],
        "animals": [animal(json!({"heading": 90.0, "frequency": 1.5, "phase": 0.25, "tracers": 7}))],
    });
    let made = stock(table, 1).expect("a stock");
    assert_eq!(made.births.len(), 61);
    let (low, high) = (DVec3::new(-2.0, -4.0, -3.0), DVec3::new(2.0, -1.0, 3.0));
    for birth in &made.births[..60] {
        assert!(low.cmplt(birth.place).all() && birth.place.cmplt(high).all(), "{birth:?}");
        assert!((0.5..=2.0).contains(&birth.size) && birth.home.is_some());
    }
    // Species go by their names, ids from 1 on.
    let last = made.births[60];
    assert_eq!((last.id, made.species[last.species].0.as_str()), (61, "moon-jelly"));
    assert_eq!((last.place, last.home), (DVec3::new(0.0, -2.0, 0.0), None));
    assert_eq!((last.frequency, last.phase, last.tracers), (Some(1.5), Some(0.25), 7));
}

#[test]
fn the_seed_alone_says_where_animals_begin() {
    let places = |seed: u64, own: Value| {
        let made = stock(json!({"groups": [group(json!({"count": 30, "seed": own}))]}), seed);
        let births = made.expect("a stock").births;
        births.iter().map(|birth| (birth.place.to_array(), birth.yaw, birth.seed)).collect::<Vec<_>>()
    };
    assert_eq!(places(1, Value::Null), places(1, Value::Null));
    assert_ne!(places(1, Value::Null), places(2, Value::Null));
    assert_eq!(places(1, json!(7)), places(2, json!(7)));
}

#[test]
fn what_no_scene_can_have_is_refused_by_its_key() {
    let refused = |table: Value| stock(table, 1).expect_err("refused");
    let groups = |more: Value| refused(json!({"groups": [group(more)]}));
    let animals = |more: Value| refused(json!({"animals": [animal(more)]}));
    let cases = [
        (groups(json!({"high": [2.0, -5.0, 3.0]})), "groups[0].high: must be above `low`"),
        (groups(json!({"scale": [2.0, 1.0]})), "groups[0].scale: the least, 2, is above"),
        (groups(json!({"species": "moon-jelly", "scale": [1.0, 20.0]})), "groups[0].scale: at a size of 20"),
        (groups(json!({"count": 0})), "groups[0].count"),
        (groups(json!({"species": "whale"})), "groups[0].species: unknown species `whale`"),
        (animals(json!({"aim": [0.0, 0.0, 0.0]})), "animals[0].aim: must be a direction"),
        (animals(json!({"frequency": 1000.0})), "animals[0].frequency: must be at most 5, is 1000"),
        (animals(json!({"species": "coarse"})), "species.coarse.grid.cells: must be at least 16, is 3"),
        (animals(json!({"species": "soft"})), "species.soft.bell.stiffness: must be at least 0.05, is -1"),
        (animals(json!({"species": "still"})), "species.still.motion.frequency: must be at least 0.05, is 0"),
        (animals(json!({"species": "humming"})), "species.humming.motion.frequency: must be at most 5"),
        (animals(json!({"species": "narrow"})), "species.narrow.grid.bells: the bell is larger"),
    ];
    for (message, wanted) in cases {
        assert!(message.contains(wanted), "{message}, not {wanted}");
    }
    let many = json!({"groups": [group(json!({"count": 500})), group(json!({"count": 13}))]});
    let message = refused(many);
    assert!(
        message.contains("groups[1].count: brings the scene to 513 animals; the limit is 512"),
        "{message}"
    );
}

#[test]
fn gonads_and_the_margin_hide_more_than_the_rest_of_a_bell() {
    let look = Look { gonad_count: 4, canals: 0, opacity: 0.4, ..Look::default() };
    let paint = Paint::new(&look);
    // Four sheets of the exumbrella's middle hide what the table says.
    let sheet = paint.opacity(0.1, 0.25);
    assert!(((1.0 - sheet).powi(4) - 0.6).abs() < 1e-9, "{sheet}");
    assert!(paint.opacity(0.1, 0.5) > 2.0 * sheet);
    let most = (0..100).map(|k| paint.opacity(0.125, 0.5 + 0.005 * f64::from(k))).fold(0.0, f64::max);
    assert!(most > 0.5, "{most}");
    // The picture joins at its edges, and its rows go from the inner apex down to the outer one.
    let texels = paint.texels();
    let [width, height] = reef_jellyfish_model::paint::SIZE.map(|size| size as usize);
    let texel = |column: usize, row: usize| &texels[4 * (row * width + column)..][..3];
    assert_eq!(texels.len(), 4 * width * height);
    for row in (0..height).step_by(16) {
        let off = texel(0, row).iter().zip(texel(width - 1, row)).map(|(a, b)| a.abs_diff(*b)).max();
        assert!(off <= Some(24), "{row}: {off:?}");
    }
    let gonad = |row: usize| (0..width).any(|column| texel(column, row)[1] < 200);
    assert!((0..height / 2).any(gonad) && !(height / 2 + 16..height).any(gonad));
}
