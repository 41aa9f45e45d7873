//! From a table of a scene to fish: what is placed where, and what is refused by its key.

use glam::DVec3;
use reef_fish_model::{config::Config, sow::Stock};
use reef_sdk::SceneInfo;
use serde_json::{Value, json};

fn scene(seed: u64) -> SceneInfo {
    let table =
        |name: &str| (name.to_owned(), serde_json::to_value(super::species::species(name)).expect("plain"));
    SceneInfo {
        seed,
        species: ["clownfish", "silverside", "reef-shark"].map(table).into_iter().collect(),
        ..SceneInfo::default()
    }
}

fn stock(table: Value, seed: u64) -> Result<Stock, String> {
    let config: Config = serde_json::from_value(table).expect("of the right types");
    Stock::new(&scene(seed), &config).map_err(|error| error.to_string())
}

fn group(more: Value) -> Value {
    let mut group = json!({"species": "silverside", "low": [-2.0, -4.0, -3.0], "high": [2.0, -1.0, 3.0]});
    let more = more.as_object().expect("a table").clone();
    group.as_object_mut().expect("a table").extend(more);
    group
}

#[test]
fn fish_begin_inside_of_their_box_and_hunt_who_is_there() {
    let shoal = stock(
        json!({"groups": [
            group(json!({"species": "reef-shark"})),
            group(json!({"count": 200})),
            group(json!({"count": 20, "position": [1.9, -1.1, 0.0], "around": 0.4})),
        ]}),
        1,
    )
    .expect("a stock")
    .shoal;
    assert_eq!(shoal.fish().len(), 221);
    let (low, high) = (DVec3::new(-2.0, -4.0, -3.0), DVec3::new(2.0, -1.0, 3.0));
    assert!(
        shoal.fish().iter().all(|fish| low.cmplt(fish.position).all() && fish.position.cmplt(high).all())
    );
    let near = DVec3::new(1.9, -1.1, 0.0);
    let around = shoal.fish().iter().filter(|fish| fish.position.distance(near) <= 0.4).count();
    assert!(around >= 20, "{around}");
    // Kinds go by their names: the shark is the first, and its clownfish are not here.
    assert_eq!(shoal.kinds()[0].prey, [1]);
    assert_eq!(shoal.kinds()[1].prey, [0_u32; 0]);
}

#[test]
fn the_seed_alone_says_where_fish_begin() {
    let places = |seed: u64, own: Value| {
        let stock =
            stock(json!({"groups": [group(json!({"count": 30, "seed": own}))]}), seed).expect("a stock");
        stock.shoal.fish().iter().map(|fish| (fish.position.to_array(), fish.size)).collect::<Vec<_>>()
    };
    assert_eq!(places(1, Value::Null), places(1, Value::Null));
    assert_ne!(places(1, Value::Null), places(2, Value::Null));
    assert_eq!(places(1, json!(7)), places(2, json!(7)));
}

#[test]
fn what_no_group_can_be_is_refused_by_its_key() {
    let refused = |more: Value| stock(json!({"groups": [group(more)]}), 1).expect_err("refused");
    assert!(refused(json!({"high": [2.0, -5.0, 3.0]})).contains("groups[0].high: must be above `low`"));
    assert!(refused(json!({"scale": [2.0, 1.0]})).contains("groups[0].scale: the least, 2, is above"));
    assert!(refused(json!({"position": [9.0, -2.0, 0.0]})).contains("groups[0].position: must lie between"));
    assert!(refused(json!({"count": 0})).contains("groups[0].count"));
    assert!(refused(json!({"species": "haddock"})).contains("groups[0].species: unknown species `haddock`"));
    let many = json!({"groups": [group(json!({"count": 99_000})), group(json!({"count": 2_000}))]});
    let text = stock(many, 1).expect_err("refused");
    assert!(text.contains("groups[1].count: brings the scene to 101000 fish; the limit is 100000"), "{text}");
}
