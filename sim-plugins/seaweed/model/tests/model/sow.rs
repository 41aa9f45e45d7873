//! Where plants stand, what makes each of them, and what of a configuration is refused.

use glam::{DVec2, DVec3};
use reef_sdk::{ConfigError, Heightfield, SceneInfo, abi::Obstacle};
use reef_seaweed_model::{
    config::Config,
    sow::{Floor, Footing, Garden, Plan, Traits},
};
use serde_json::{Map, Value, json};

use crate::{
    common::files,
    species_table::{names, species_value},
};

fn scene(seed: u64) -> SceneInfo {
    let mut species: Map<String, Value> =
        names().into_iter().map(|name| (name.clone(), species_value(&name))).collect();
    species.insert("plain".into(), json!({"stem": {"segments": 4}}));
    species.insert("long".into(), json!({"stem": {"segments": 200}}));
    SceneInfo { seed, scale: 1.0, species, ..SceneInfo::default() }
}

fn plan(seed: u64, config: Value) -> Result<Plan, ConfigError> {
    let config: Config = serde_json::from_value(config).expect("a configuration");
    Plan::new(&scene(seed), &config, &files)
}

fn refusal(config: Value) -> String {
    plan(1, config).unwrap_err().to_string()
}

/// A bed that rises along x: level at first, then 30 degrees.
fn heights() -> Vec<f32> {
    (0..41 * 41).map(|i| -10.0 + 0.57735 * ((i % 41) as f32 - 20.0).max(0.0)).collect()
}

fn ground(heights: &[f32]) -> Heightfield<'_> {
    Heightfield { heights, origin: [-20.0, -20.0], cell: 1.0, columns: 41, rows: 41 }
}

fn garden(seed: u64, config: Value, rocks: &[Obstacle]) -> Garden {
    let heights = heights();
    plan(seed, config).expect("a good configuration").grow(&Floor { ground: Some(ground(&heights)), rocks })
}

const ROCK: Obstacle = Obstacle { id: 1, from: [-8.0, -10.0, 0.0], delta: [0.0, 0.0, 4.0], radius: 2.0 };

#[test]
fn a_bed_has_its_density_and_depends_on_its_seed_alone() {
    let bed = |seed: u64| {
        garden(seed, json!({"beds": [{"species": ["plain"], "density": 4.0, "size": [10.0, 8.0]}]}), &[])
    };
    let one = bed(1);
    assert_eq!(one.plants.len(), 320);
    assert_eq!(one.plants, bed(1).plants);
    let other = bed(2);
    let same =
        one.plants.iter().zip(&other.plants).filter(|(a, b)| a.root == b.root || a.size == b.size).count();
    assert_eq!(same, 0);
    for plant in &one.plants {
        assert!(plant.root.x.abs() <= 5.0 && plant.root.z.abs() <= 4.0, "{}", plant.root);
        let bed = if plant.root.x > 0.0 { 0.57735 * plant.root.x } else { 0.0 };
        assert!((plant.root.y + 10.0 - bed).abs() < 1e-3, "{}", plant.root);
    }
    // No two on top of one another.
    for (i, a) in one.plants.iter().enumerate() {
        for b in &one.plants[i + 1..] {
            assert!(a.root.distance(b.root) > 0.1, "{} {}", a.root, b.root);
        }
    }
}

#[test]
fn no_plant_of_a_bed_stands_outside_its_rectangle() {
    for (density, size) in [(0.01, [4.0, 4.0]), (0.01, [15.0, 7.0]), (1e-300, [4.0, 4.0]), (1.0, [0.0, 0.0])]
    {
        for seed in 0..20 {
            let bed = json!({"species": ["plain"], "density": density, "center": [2.0, -1.0], "size": size});
            let garden = garden(seed, json!({"beds": [bed]}), &[]);
            assert!(!garden.plants.is_empty());
            for DVec3 { x, z, .. } in garden.plants.iter().map(|plant| plant.root) {
                let within = (x - 2.0).abs() <= 0.5 * size[0] && (z + 1.0).abs() <= 0.5 * size[1];
                assert!(within, "({x}, {z}) of a bed of {size:?} and {density} a square metre");
            }
        }
    }
}

#[test]
fn slope_depth_and_rock_decide_where_plants_stand() {
    let bed = |key: &str, value: Value| {
        let mut table = json!({"species": ["plain"], "density": 2.0, "size": [36.0, 36.0]});
        table[key] = value;
        garden(3, json!({"beds": [table]}), &[ROCK]).plants
    };
    let on_rock = |root: DVec3| root.y > -9.99 && root.x < -1.0;
    let level = bed("slope", json!([0.0, 15.0]));
    assert!(level.iter().any(|plant| on_rock(plant.root)) && level.iter().all(|plant| plant.root.x < 1.0));
    let steep = bed("slope", json!([25.0, 35.0]));
    assert!(steep.len() > 500 && steep.iter().all(|plant| plant.root.x > -0.6 || on_rock(plant.root)));
    let deep = bed("depth", json!([2.0, 8.0]));
    assert!(deep.len() > 100 && deep.iter().all(|plant| (-8.0..=-2.0).contains(&plant.root.y)));
    let rock = bed("on", json!("rock"));
    assert!(rock.len() > 20 && rock.iter().all(|plant| on_rock(plant.root)), "{}", rock.len());
    for plant in &rock {
        // On its surface, and leaning off it.
        let z = plant.root.z.clamp(0.0, 4.0);
        let off = plant.root - DVec3::new(-8.0, -10.0, z);
        assert!((off.length() - 2.0).abs() < 1e-9, "{}", off.length());
        assert!(plant.up.dot(off) > 0.0 && plant.up.y > 0.6);
    }
    let sand = bed("on", json!("ground"));
    assert!(sand.iter().all(|plant| !on_rock(plant.root)));
    assert_eq!(sand.len() + rock.len(), bed("scale", json!([1.0, 1.0])).len());
}

#[test]
fn no_two_neighbours_are_alike() {
    let (size, traits) = (40_i64, |at| Traits::of(77, at));
    let parts = |t: Traits| [t.size, t.hue, t.phase, t.yaw, t.age, t.stiffness];
    for i in 0..size {
        for j in 0..size {
            for (di, dj) in (-2..=2).flat_map(|di| (-2..=2).map(move |dj| (di, dj))).filter(|d| *d != (0, 0))
            {
                let pairs = parts(traits([i, j])).into_iter().zip(parts(traits([i + di, j + dj])));
                for (which, (a, b)) in pairs.enumerate() {
                    let apart = (a - b).abs().min(1.0 - (a - b).abs());
                    assert!(apart > 0.06, "trait {which} of ({i}, {j}) and ({di}, {dj}) on: {a} {b}");
                }
            }
        }
    }
    // And all of each range occurs.
    let all: Vec<[f64; 6]> = (0..size * size).map(|n| parts(traits([n % size, n / size]))).collect();
    for which in 0..6 {
        let mean = all.iter().map(|t| t[which]).sum::<f64>() / all.len() as f64;
        assert!((mean - 0.5).abs() < 0.02, "{which}: {mean}");
    }
}

#[test]
fn single_plants_stand_where_they_are_told() {
    let config = json!({"plants": [
        {"species": "fucus", "position": [-8.0, 0.25, 1.0], "scale": 1.5, "yaw": 90.0},
        {"species": "zostera", "position": [5.0, 0.0, 5.0]},
    ]});
    let garden = garden(1, config, &[ROCK]);
    let [first, second] = &garden.plants[..] else { panic!("{:?}", garden.plants) };
    assert!(first.root.distance(DVec3::new(-8.0, -10.0 + 2.0 + 0.25, 1.0)) < 1e-9, "{}", first.root);
    assert_eq!((first.size, first.yaw), (1.5, core::f64::consts::FRAC_PI_2));
    assert!((second.root.y + 10.0 - 0.57735 * 5.0).abs() < 1e-3);
    assert_eq!(garden.species[first.kind].title, "Bladder wrack");
    // The stand leans with the slope, though less.
    let lean = DVec2::new(second.up.y, second.up.x.hypot(second.up.z)).to_angle().to_degrees();
    assert!((5.0..20.0).contains(&lean), "{lean}");
}

#[test]
fn wrong_configurations_are_refused_with_their_place() {
    let bed = |key: &str, value: Value| {
        let mut table = json!({"species": ["plain"], "density": 2.0, "size": [4.0, 4.0]});
        table[key] = value;
        refusal(json!({"beds": [{"species": ["plain"], "density": 1.0, "size": [1.0, 1.0]}, table]}))
    };
    assert_eq!(bed("density", json!(0.0)), "beds[1].density: must be above 0, is 0");
    assert_eq!(bed("density", json!(401.0)), "beds[1].density: must be at most 400, is 401");
    assert_eq!(bed("slope", json!([30.0, 10.0])), "beds[1].slope: the least, 30, is above the greatest, 10");
    assert_eq!(bed("size", json!([-1.0, 4.0])), "beds[1].size[0]: must be at least 0, is -1");
    assert_eq!(bed("species", json!([])), "beds[1].species: must name at least one species");
    let text = bed("species", json!(["plain", "kelp"]));
    assert!(text.starts_with("beds[1].species[1]: unknown species `kelp`; allowed: fucus"), "{text}");
    let text = bed("size", json!([2000.0, 2000.0]));
    assert_eq!(text, "beds[1].density: brings the scene to 7997585 plants; the limit is 20000");
    let text = refusal(json!({"plants": [{"species": "plain", "scale": 0.01}]}));
    assert_eq!(text, "plants[0].scale: must be at least 0.05, is 0.01");
    let text = refusal(json!({"beds": [{"species": ["long"], "density": 1.5, "size": [100.0, 100.0]}]}));
    assert_eq!(text, "beds[0].density: brings the scene to 2976800 segments; the limit is 2000000");
}

#[test]
fn wrong_species_are_refused_with_their_key() {
    let with = |species: Value| {
        let mut scene = scene(1);
        scene.species.insert("odd".into(), species);
        let config = serde_json::from_value(json!({"plants": [{"species": "odd"}]})).unwrap();
        Plan::new(&scene, &config, &files).unwrap_err().to_string()
    };
    let text = with(json!({"stem": {"tissue": {"rigidity": -1.0}}}));
    assert_eq!(
        text,
        "species.odd.stem.tissue.rigidity: must be at least 1e-7, is -1".replace("1e-7", "0.0000001")
    );
    let text = with(json!({"stem": {"tissue": {"mass": -0.1}}}));
    assert_eq!(text, "species.odd.stem.tissue.mass: must be at least 0.00001, is -0.1");
    let text = with(json!({"stem": {"length": 0.0}}));
    assert_eq!(text, "species.odd.stem.length: must be at least 0.01, is 0");
    let text = with(json!({"stem": {"segments": 10_000_000}}));
    assert_eq!(text, "species.odd.stem.segments: must be at most 256, is 10000000");
    let text = with(json!({"stem": {"segments": 256, "count": 64}}));
    assert_eq!(text, "species.odd.stem.segments: makes 16384 with all branches; at most 256 are allowed");
    let text = with(json!({"skeleton": "gone.glb"}));
    assert!(text.contains("No such file"), "{text}");
    let text = with(json!({"skeleton": "sea-palm.glb", "blades": {"count": 3}}));
    assert_eq!(
        text,
        "species.odd.blades.count: must be 0 where `skeleton` names a file, which has all branches"
    );
    let text = with(json!({"joints": [{"name": "leaf*"}]}));
    assert_eq!(text, "species.odd.joints: are those of a file, which `skeleton` must name");
    let text = with(json!({"skeleton": "sea-palm.glb", "joints": [{"tissue": {"mass": -1.0}}]}));
    assert_eq!(text, "species.odd.joints[0].tissue.mass: must be at least 0.00001, is -1");
    let scene = {
        let mut scene = scene(1);
        scene.species.insert("odd".into(), json!({"skeleton": "broken.glb"}));
        scene
    };
    let config = serde_json::from_value(json!({"plants": [{"species": "odd"}]})).unwrap();
    let text = Plan::new(&scene, &config, &|_| Ok(b"<html>".to_vec())).unwrap_err().to_string();
    assert!(text.starts_with("species.odd.skeleton: broken.glb: is no binary glTF"), "{text}");
    // Each number is within its range, but not the segment that they make.
    let text = with(json!({"stem": {
        "length": 80.0, "segments": 1, "tissue": {"rigidity": 1e-7, "tip_rigidity": 1e-4},
    }}));
    let start = "species.odd: grows segment 0 whose stiffness must be above 1e-9 and at most 1000000000, is ";
    assert!(text.starts_with(start), "{text}");
    assert_eq!(
        with(json!({"look": {"tip": "green"}})),
        "species.odd.look.tip: must be a colour like \"#6B7A2A\", is \"green\""
    );
    assert!(
        with(json!({"stalk": {}})).starts_with("species.odd.stalk: unknown field `stalk`"),
        "{}",
        with(json!({"stalk": {}}))
    );
}

#[test]
fn plants_grow_again_from_their_footings_alone() {
    let config = json!({
        "plants": [{"species": "long", "position": [1.0, 0.5, 0.0]}, {"species": "plain", "seed": 4}],
        "beds": [
            {"species": ["plain", "long"], "density": 2.0, "size": [20.0, 10.0], "slope": [10.0, 90.0]},
            {"species": ["plain"], "density": 1.0, "size": [16.0, 8.0], "center": [-8.0, 0.0], "on": "rock"},
        ]
    });
    let grown = garden(3, config.clone(), &[ROCK]);
    assert!(grown.plants.len() > 60, "{}", grown.plants.len());
    let plan = plan(3, config).expect("a good configuration");
    let again = plan.regrow(&grown.footings).expect("its own footings");
    assert_eq!((again.plants, again.traits), (grown.plants, grown.traits));
    assert_eq!(again.footings, grown.footings);
    // What is not of this plan, or nowhere, is refused.
    let refused = |change: fn(&mut Vec<Footing>)| {
        let mut footings = grown.footings.clone();
        change(&mut footings);
        plan.regrow(&footings).map(|garden| garden.plants.len()).expect_err("refused")
    };
    assert!(refused(|all| all.swap(3, 4)).contains("places do not grow"));
    assert!(refused(|all| all[70].place = 1 << 50).contains("not among the"));
    assert!(refused(|all| all[5].height = f64::NAN).contains("without a footing"));
    assert!(refused(|all| all[5].normal = Some(DVec3::new(0.0, 2.0, 0.0))).contains("without a footing"));
    assert_eq!(plan.regrow(&[]).map(|garden| garden.plants.len()), Ok(0));
}
