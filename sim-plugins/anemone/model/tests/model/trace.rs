//! What recordings say of the nodes.

use glam::DVec3;
use reef_anemone_model::{
    bed::Bed,
    config::{Config, FibreGrid, Tuft},
};
use reef_sdk::abi;

use crate::common::{current, local};
use crate::own_flow::{info, meadow};
use crate::scene::*;

const DT: f64 = 1.0 / 60.0;

/// The recorded nodes of each object.
fn objects(bed: &Bed) -> Vec<Vec<DVec3>> {
    let mut objects = vec![Vec::new(); bed.fibre_count()];
    for point in bed.trace() {
        let object: &mut Vec<DVec3> = &mut objects[point.object as usize];
        assert_eq!(object.len(), point.node as usize, "nodes in their order");
        object.push(point.position.into());
    }
    objects
}

fn lengths(nodes: &[DVec3]) -> impl Iterator<Item = f64> + '_ {
    nodes.windows(2).map(|pair| pair[0].distance(pair[1]))
}

#[test]
fn recorded_segments_keep_their_lengths_to_the_last_digits() {
    let flow =
        [current(DVec3::new(0.1, 0.0, 0.03)), local(abi::FLOW_WHIRLWIND, DVec3::splat(0.1), 0.01, 0.5, 0.01)];
    // Anemones with feet, grass, grids of bare fibres, a tuft with followers.
    let mut bed = meadow();
    run(&mut bed, &[], 0.0, 1);
    let rest = objects(&bed);
    assert_eq!(rest.iter().map(Vec::len).sum::<usize>(), bed.node_count());
    for _ in 0..5 {
        run(&mut bed, &flow, DT, 30);
        for (number, (now, rest)) in objects(&bed).iter().zip(&rest).enumerate() {
            assert!(now.last() != rest.last(), "object {number} moves");
            for (own, rest) in lengths(now).zip(lengths(rest)) {
                assert!((own / rest - 1.0).abs() < 1e-11, "object {number}: {own} m, {rest} m at rest");
            }
        }
    }
    // Fibres whose lengths are known, some of them far from the middle of their grid and of the world.
    let config = Config {
        fibres: vec![FibreGrid {
            position: [900.0, -20.0, 400.0],
            count: [11, 9],
            spacing: 0.7,
            ..FibreGrid::default()
        }],
        tufts: vec![Tuft { length: 0.0123, drag: 0.01, fibres: 70, ..Tuft::default() }],
        ..Config::default()
    };
    let mut bed = grow(&info(), &config);
    run(&mut bed, &flow, DT, 60);
    for (number, nodes) in objects(&bed).iter().enumerate() {
        let wanted = if number < 99 { 0.006 } else { 0.0123 };
        for own in lengths(nodes) {
            assert!((own / wanted - 1.0).abs() < 1e-9, "object {number}: {own} m, not {wanted}");
        }
    }
}

#[test]
fn recorded_nodes_are_those_of_the_picture_and_roots_ride_on_their_foot() {
    let mut bed = meadow();
    let mut seats: Vec<f64> = Vec::new();
    for round in 0..4 {
        let nodes = run(&mut bed, &[current(DVec3::new(0.2, 0.0, 0.1))], DT, 20);
        let recorded = objects(&bed);
        for (fibre, own) in bed.fibres().zip(&recorded) {
            let origin = bed_origin(&bed, fibre.object);
            let first = fibre.first_node as usize;
            for (shown, own) in nodes[first..first + fibre.node_count as usize].iter().zip(own) {
                let shown = origin + DVec3::new(shown[0].into(), shown[1].into(), shown[2].into());
                assert!(shown.distance(*own) < 5e-7, "{shown} {own}");
            }
        }
        // The first anemone: a foot, then what stands on it.
        let tentacles = bed.fibres().skip(1).take_while(|fibre| fibre.object == 0).count();
        let top = recorded[0][recorded[0].len() - 1];
        let now: Vec<f64> = recorded[1..=tentacles].iter().map(|nodes| nodes[0].distance(top)).collect();
        assert!(tentacles > 10);
        if round == 0 {
            seats = now;
        } else {
            for (now, before) in now.iter().zip(&seats) {
                assert!((now - before).abs() < 1e-11, "{now} m, {before} m before");
            }
        }
    }
}

/// Where an object's positions count from.
fn bed_origin(bed: &Bed, object: u32) -> DVec3 {
    let mut objects = vec![abi::Object::default(); bed.plant_count()];
    bed.write_objects(reef_sdk::Workers::inline(), &mut objects);
    objects[object as usize].origin.into()
}

#[test]
fn a_broken_fibre_has_no_more_rows_and_the_others_keep_their_numbers() {
    let weak = FibreGrid { break_force: Some(0.005), ..FibreGrid::default() };
    let strong = FibreGrid { position: [1.0, 0.0, 0.0], count: [2, 1], ..FibreGrid::default() };
    let config = Config { fibres: vec![weak, strong], ..Config::default() };
    let mut bed = grow(&info(), &config);
    let recorded = |bed: &Bed| {
        let mut numbers: Vec<u64> = bed.trace().map(|point| point.object).collect();
        numbers.dedup();
        numbers
    };
    run(&mut bed, &[current(DVec3::X * 0.01)], DT, 30);
    assert_eq!(recorded(&bed), [0, 1, 2]);
    run(&mut bed, &[current(DVec3::X * 0.2)], DT, 60);
    assert_eq!((recorded(&bed), bed.trace().count()), (vec![1, 2], 20));
    // It does not come back, either with its state.
    let state = bed.save();
    let mut loaded = grow(&info(), &config);
    loaded.load(&state).expect("its own state");
    run(&mut loaded, &[], DT, 1);
    assert_eq!(recorded(&loaded), [1, 2]);
}
