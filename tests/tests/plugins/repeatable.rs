//! Same bytes with any number of workers, at any instruction set, and over a save and load in the middle.

use reef::plugin::Plugin;
use reef_abi as abi;
use reef_tests::{
    artifacts::artifacts,
    sea::{Sea, config, set_param},
};

use crate::{everything, load};

const REEDS: &str = r#"{"count": 1000, "position": [10.0, -5.0, 3.0]}"#;

fn sea() -> Sea {
    let mut sea = Sea::default();
    for i in 0..3_u32 {
        sea.flow.push(abi::Flow {
            kind: abi::FLOW_SOURCE + i,
            position: [10.0 + f64::from(i), -4.5, 2.5],
            axis: [0.0, 1.0, 0.0],
            strength: 0.1,
            peak: 1.0,
            core: 0.01,
            ..Default::default()
        });
    }
    sea
}

fn run(plugin: &Plugin, sea: &Sea) -> Vec<u8> {
    let mut instance = plugin.create(&config(REEDS)).unwrap();
    for step in 0..50 {
        let events = if step == 20 { vec![set_param(1, 2.5)] } else { vec![] };
        let report = instance.step(&sea.input(step), &events);
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
    let mut instance = plugin.create(&config(REEDS)).unwrap();
    for step in 0..50 {
        if step == 30 {
            let state = instance.save().unwrap();
            instance = plugin.create(&config(REEDS)).unwrap();
            instance.load(&state).unwrap();
        }
        let events = if step == 20 { vec![set_param(1, 2.5)] } else { vec![] };
        instance.step(&sea.input(step), &events);
    }
    assert_eq!(straight, everything(&mut instance));
}

#[test]
fn the_reeds_lean_with_the_current_and_stand_still_for_dt_0() {
    let plugin = load(artifacts().plugin("reef_example_rust"), 2);
    let mut instance = plugin.create(&config(r#"{"count": 2}"#)).unwrap();
    let sea = Sea::default();
    instance.step(&sea.input(0), &[]);
    assert_eq!(instance.outputs().fibre_nodes[7].position, [0.0, 0.3, 0.0]);
    for step in 1..=600 {
        instance.step(&sea.input(step), &[]);
    }
    // Ten seconds are 33 time constants: the lean is speed times the parameter, 0.2 m/s · 1 s, to rounding.
    let lean = instance.outputs().fibre_nodes[7].position[0];
    assert!((lean - 0.2).abs() < 1e-6, "{lean}");
}
