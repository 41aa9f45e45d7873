//! Same bytes with any number of workers, at any instruction set, and over a save and load in the middle.

use reef_abi as abi;
use reef_plugin::{Instance, Plugin};
use reef_tests::{
    artifacts::artifacts,
    sea::{Sea, config, set_param},
};

use crate::{everything, load};

/// The kelp's parameters: 64 stalks at x = 10 m, z = 3 m.
const FOREST: [(u32, f64); 3] = [(1, 64.0), (5, 10.0), (6, 3.0)];

fn sea() -> Sea {
    let mut sea = Sea::default();
    for i in 0..3_u32 {
        sea.flow.push(abi::Flow {
            kind: abi::FLOW_SOURCE + i,
            position: [10.0 + f64::from(i), -19.5, 2.5],
            axis: [0.0, 1.0, 0.0],
            strength: 0.1,
            peak: 1.0,
            core: 0.01,
            ..Default::default()
        });
    }
    sea
}

/// What comes from outside in a step: the forest at first, another stiffness in the middle.
fn events(step: u64) -> Vec<abi::Event> {
    match step {
        0 => FOREST.map(|(id, value)| set_param(id, value)).to_vec(),
        20 => vec![set_param(3, 2.5)],
        _ => vec![],
    }
}

fn run(plugin: &Plugin, sea: &Sea) -> Vec<u8> {
    let mut instance = plugin.create(&config("{}")).unwrap();
    for step in 0..50 {
        let report = instance.step(&sea.input(step), &events(step));
        assert_eq!(report.message, None);
    }
    everything(&mut instance)
}

#[test]
fn one_two_and_four_workers_give_the_same_bytes() {
    let path = artifacts().plugin("reef_example_rust");
    let one = run(&load(path, 1), &sea());
    assert_eq!(one, run(&load(path, 2), &sea()));
    assert_eq!(one, run(&load(path, 4), &sea()));
}

#[test]
fn every_instruction_set_gives_the_same_bytes() {
    let plugin = load(artifacts().plugin("reef_example_rust"), 2);
    let best = run(&plugin, &sea());
    for simd_level in [abi::SIMD_SCALAR, abi::SIMD_SSE4_2, abi::SIMD_AVX2] {
        assert_eq!(best, run(&plugin, &Sea { simd_level, ..sea() }));
    }
}

#[test]
fn a_save_and_load_in_the_middle_changes_nothing() {
    let plugin = load(artifacts().plugin("reef_example_rust"), 2);
    let sea = sea();
    let straight = run(&plugin, &sea);
    let mut instance = plugin.create(&config("{}")).unwrap();
    for step in 0..50 {
        if step == 30 {
            let state = instance.save().unwrap();
            instance = plugin.create(&config("{}")).unwrap();
            instance.load(&state).unwrap();
        }
        instance.step(&sea.input(step), &events(step));
    }
    assert_eq!(straight, everything(&mut instance));
}

/// Slope along x of each segment of the first stalk.
fn slopes(instance: &Instance) -> Vec<f32> {
    let outputs = instance.outputs();
    let nodes = &outputs.fibre_nodes[..outputs.fibres[0].node_count as usize];
    let slope = |pair: &[abi::FibreNode]| {
        (pair[1].position[0] - pair[0].position[0]) / (pair[1].position[1] - pair[0].position[1])
    };
    nodes.windows(2).map(slope).collect()
}

#[test]
fn the_kelp_bends_until_lift_holds_drag_and_stands_still_for_dt_0() {
    let plugin = load(artifacts().plugin("reef_example_rust"), 2);
    let settled = |sea: &Sea, stiffness: f64| {
        let mut instance = plugin.create(&config("{}")).unwrap();
        for step in 1..=3600 {
            let events = if step == 1 { vec![set_param(3, stiffness)] } else { vec![] };
            instance.step(&sea.input(step), &events);
        }
        let slopes = slopes(&instance);
        let before = everything(&mut instance);
        instance.step(&sea.input(0), &[]);
        assert_eq!(before, everything(&mut instance), "dt = 0 changes nothing");
        slopes
    };
    let still = settled(&Sea { flow: vec![], ..Sea::default() }, 1.0);
    assert!(still.iter().any(|slope| slope.abs() > 0.01), "no stalk is quite straight");
    for stiffness in [1.0_f32, 4.0] {
        // A minute is 57 time constants: the slope is (0.2 m/s)² over the lift's 0.02 m²/s², to the rounding
        // of positions (1e-7 of a metre over a segment's 0.03 m of height).
        let expected = 0.2 * 0.2 / (0.02 * stiffness);
        for (flowing, still) in settled(&Sea::default(), stiffness.into()).into_iter().zip(&still) {
            assert!((flowing - still - expected).abs() < 1e-4, "{flowing} - {still}, expected {expected}");
        }
    }
}
