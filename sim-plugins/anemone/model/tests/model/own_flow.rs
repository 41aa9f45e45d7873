//! What a plant emits itself does not act on it, and acts on all others.

use glam::DVec3;
use reef_anemone_model::{
    bed::{Bed, Settings, Surroundings},
    config::{Anemone, Config, FibreGrid, Scatter, Tuft},
};
use reef_flow::Level;
use reef_sdk::{
    SceneInfo,
    abi::{self, Flow},
};

use crate::common::{current, local};
use crate::scene::*;

const DT: f64 = 1.0 / 60.0;

pub fn info() -> SceneInfo {
    let none = serde_json::Map::new();
    let names = ["actinia-fragacea", "turtlegrass"];
    SceneInfo {
        name: "test".into(),
        seed: 5,
        scale: 1.0,
        dt: DT,
        species: names.iter().map(|n| ((*n).to_owned(), species_table(n, &none).into())).collect(),
    }
}

/// Plants of each sort, several of which share batches: feet, grass, bare fibres. Objects 1 to 2 are
/// anemones, 3 to 7 grass, 8 to 10 patches of bare fibres, 11 a tuft.
pub fn meadow() -> Bed {
    let anemone = |x: f64| Anemone {
        species: "actinia-fragacea".into(),
        position: [x, 0.0, 0.0],
        scale: 1.0,
        yaw: 0.0,
        seed: None,
    };
    let grass = Scatter {
        species: vec!["turtlegrass".into()],
        count: 5,
        center: [0.0, 0.5],
        size: [1.0, 0.2],
        spacing: 0.0,
        scale: [1.0, 1.0],
        grid: Some([5, 1]),
        seed: None,
    };
    let fibres = |x: f64| FibreGrid { position: [x, 0.0, -0.4], count: [3, 2], ..FibreGrid::default() };
    let config = Config {
        anemones: vec![anemone(-0.2), anemone(0.2)],
        scatter: vec![grass],
        fibres: vec![fibres(-0.2), fibres(0.0), fibres(0.2)],
        tufts: vec![Tuft { guides: 8, fibres: 20, drag: 0.01, position: [0.0, 0.0, 1.0], ..Tuft::default() }],
    };
    grow(&info(), &config)
}

/// The nodes of each plant in the order of the objects.
fn plants(bed: &Bed, nodes: &[[f32; 4]]) -> Vec<Vec<[f32; 4]>> {
    let mut plants = vec![Vec::new(); bed.plant_count()];
    for fibre in bed.fibres() {
        let first = fibre.first_node as usize;
        plants[fibre.object as usize].extend_from_slice(&nodes[first..first + fibre.node_count as usize]);
    }
    plants
}

/// A strong source over the plants, and a current.
fn flow(owner: u64, x: f64) -> [Flow; 2] {
    let source = local(abi::FLOW_SOURCE, DVec3::new(x, 0.1, 0.1), 0.02, 0.5, 0.01);
    [current(DVec3::new(0.05, 0.0, 0.02)), Flow { owner, ..source }]
}

#[test]
fn each_plant_leaves_out_what_it_emits_and_all_others_feel_it() {
    let mut calm = meadow();
    let count = calm.plant_count();
    assert_eq!(count, 11);
    let without = run(&mut calm, &[current(DVec3::new(0.05, 0.0, 0.02))], DT, 50);
    let mut stirred = meadow();
    let with = run(&mut stirred, &flow(0, 0.0), DT, 50);
    let (without, with) = (plants(&calm, &without), plants(&stirred, &with));
    for owner in 1..=count {
        let mut bed = meadow();
        let nodes = run(&mut bed, &flow(owner as u64, 0.0), DT, 50);
        for (plant, own) in plants(&bed, &nodes).iter().enumerate() {
            let wanted = if plant + 1 == owner { &without } else { &with };
            assert!(without[plant] != with[plant], "the source reaches object {}", plant + 1);
            assert!(*own == wanted[plant], "object {} while {owner} emits", plant + 1);
        }
    }
    // An id that is none of the bed's: a stranger's.
    for stranger in [count as u64 + 1, 1 << 48 | 1, u64::MAX] {
        let mut bed = meadow();
        let nodes = run(&mut bed, &flow(stranger, 0.0), DT, 50);
        assert!(plants(&bed, &nodes) == with, "{stranger}");
    }
}

#[test]
fn several_plants_that_emit_each_leave_out_their_own_alone() {
    let owners = [1, 2, 4, 5, 9];
    let sources: Vec<Flow> =
        owners.iter().flat_map(|owner| flow(*owner, 0.05 * *owner as f64)[1..].to_vec()).collect();
    let mut bed = meadow();
    let nodes = run(&mut bed, &sources, DT, 50);
    for (plant, own) in plants(&bed, &nodes).iter().enumerate() {
        let object = plant as u64 + 1;
        let felt: Vec<Flow> = sources.iter().filter(|source| source.owner != object).copied().collect();
        let mut alone = meadow();
        let nodes = run(&mut alone, &felt, DT, 50);
        assert!(*own == plants(&alone, &nodes)[plant], "object {object}");
    }
}

#[test]
fn plants_that_emit_go_on_alike_on_all_machines_and_after_a_load() {
    let flows: Vec<Flow> = [1, 3, 9].iter().flat_map(|owner| flow(*owner, 0.1)).collect();
    let mut bed = meadow();
    let nodes = run(&mut bed, &flows, DT, 40);
    for level in Level::all() {
        let mut other = meadow();
        assert!(run_at(&mut other, &flows, DT, 40, level) == nodes, "{}", level.name());
    }
    let state = bed.save();
    let mut loaded = meadow();
    run(&mut loaded, &[], 0.0, 1);
    loaded.load(&state).expect("its own state");
    assert!(run(&mut loaded, &flows, DT, 40) == run(&mut bed, &flows, DT, 40));
    assert!(loaded.save() == bed.save());
}

#[test]
fn steps_that_write_no_nodes_leave_what_those_leave_that_do() {
    let flows: Vec<Flow> = [1, 3, 9].iter().flat_map(|owner| flow(*owner, 0.1)).collect();
    let (mut seen, mut unseen) = (meadow(), meadow());
    let around = Surroundings { flow: &flows, dt: DT, ..Surroundings::default() };
    let fibres = |bed: &Bed| bed.fibres().map(|fibre| fibre.normal).collect::<Vec<_>>();
    let actors = |bed: &Bed| bed.actors().map(|actor| (actor.position, actor.forward)).collect::<Vec<_>>();
    // What is unseen comes first, in between, and at the end.
    for steps in [20, 1, 7] {
        run(&mut seen, &flows, DT, steps);
        (0..steps).for_each(|_| unseen.step(&around, &Settings::default(), &mut []));
        assert!(seen.save() == unseen.save() && actors(&seen) == actors(&unseen));
        // One of no length, to look at.
        assert!(run(&mut seen, &flows, 0.0, 1) == run(&mut unseen, &flows, 0.0, 1));
        assert!(run(&mut seen, &flows, DT, 1) == run(&mut unseen, &flows, DT, 1));
        assert!(fibres(&seen) == fibres(&unseen));
    }
}
