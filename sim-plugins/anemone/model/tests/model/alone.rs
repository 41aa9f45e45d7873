//! What a plant does does not depend on how many others there are.

use glam::DVec3;
use reef_anemone_model::{
    bed::{Bed, Settings, Surroundings},
    config::{Anemone, Config, FibreGrid},
};
use reef_sdk::{Heightfield, abi};

use crate::{
    bed::{info, one_strawberry},
    common::*,
    scene::*,
    waves,
};

/// Slopes by 0.3 along x.
const SLOPE: [f32; 4] = [-1.5, 1.5, -1.5, 1.5];

fn ground() -> Heightfield<'static> {
    Heightfield { heights: &SLOPE, origin: [-5.0, -5.0], cell: 10.0, columns: 2, rows: 2 }
}

/// A rock beside the plant at the origin.
const ROCK: abi::Obstacle =
    abi::Obstacle { id: 1, from: [0.1, 0.05, 0.05], delta: [0.0, 0.05, 0.0], radius: 0.04 };

/// Steps on the slope.
fn run_on_slope(bed: &mut Bed, flow: &[abi::Flow], rocks: &[abi::Obstacle], steps: usize) {
    run_in_waves(bed, flow, rocks, |_| Vec::new(), steps);
}

/// Steps on the slope in waves that are given for each time [s].
fn run_in_waves(
    bed: &mut Bed,
    flow: &[abi::Flow],
    rocks: &[abi::Obstacle],
    waves: impl Fn(f64) -> Vec<abi::Wave>,
    steps: usize,
) {
    let mut nodes = vec![[0.0; 4]; bed.node_count()];
    let eye =
        abi::Camera { position: [0.5, 1.0, 3.0], fov_y: 0.9, width: 320, height: 180, ..Default::default() };
    for step in 0..steps {
        let waves = waves(step as f64 * DT);
        let ground = Some(ground());
        let around = Surroundings {
            flow,
            waves: &waves,
            camera: Some(&eye),
            obstacles: rocks,
            ground,
            ..Surroundings::default()
        };
        bed.step(&around, &Settings::default(), &mut nodes);
    }
}

/// A current, a whirlwind that catches, and a source that fades.
fn flow() -> Vec<abi::Flow> {
    let mut source = local(abi::FLOW_SOURCE, DVec3::new(0.7, 0.25, 0.0), 2e-3, 0.5, 0.01);
    (source.reach, source.fade) = (0.4, 0.5);
    vec![
        current(DVec3::new(0.1, 0.0, 0.05)),
        local(abi::FLOW_WHIRLWIND, DVec3::new(0.03, 0.08, 0.02), 5e-3, 1.0, 0.01),
        source,
    ]
}

/// Bits of the trace's first `count` positions.
fn first(bed: &Bed, count: usize) -> Vec<[u64; 3]> {
    bed.trace().take(count).map(|node| node.position.map(f64::to_bits)).collect()
}

#[test]
fn a_plant_alone_equals_itself_among_64_others_bit_for_bit() {
    let still: fn(f64) -> Vec<abi::Wave> = |_| Vec::new();
    let seas = [(still, "no waves"), (waves::sea, "waves")];
    let small = |count: usize| {
        let mut scene = info(&["actinia-fragacea"]);
        scene.species["actinia-fragacea"]["tentacles"]["count"] = 12.into();
        let plants = (0..count).map(|i| Anemone {
            species: "actinia-fragacea".into(),
            position: [0.25 * (i % 9) as f64, 0.0, 0.25 * (i / 9) as f64],
            scale: 1.0,
            yaw: 0.3,
            seed: Some(5 + i as u32),
        });
        grow(&scene, &Config { anemones: plants.collect(), ..Config::default() })
    };
    for (waves, name) in seas {
        let (mut alone, mut among) = (small(1), small(65));
        run_in_waves(&mut alone, &flow(), &[ROCK], waves, 200);
        run_in_waves(&mut among, &flow(), &[ROCK], waves, 200);
        let count = alone.node_count();
        assert!(first(&alone, count) == first(&among, count), "a plant with a foot, {name}");
    }
    // A fibre that stands by itself, among others with other rest poses.
    let fibres = |count: u32| {
        let lone = FibreGrid { count: [1, 1], nodes: 12, lean: 0.0, curve: 0.0, ..FibreGrid::default() };
        let others =
            FibreGrid { count: [8, 8], position: [0.4, 0.0, 0.0], lean: 0.2, curve: 0.5, ..lone.clone() };
        let fibres = if count > 1 { vec![lone, others] } else { vec![lone] };
        grow(&info(&[]), &Config { fibres, ..Config::default() })
    };
    for (waves, name) in seas {
        let (mut alone, mut among) = (fibres(1), fibres(65));
        run_in_waves(&mut alone, &flow(), &[ROCK], waves, 200);
        run_in_waves(&mut among, &flow(), &[ROCK], waves, 200);
        assert!(first(&alone, 12) == first(&among, 12), "a fibre by itself, {name}");
    }
}

#[test]
fn a_lone_plant_on_a_slope_rests_exactly_without_flow() {
    let mut bed = grow(&info(&["actinia-fragacea"]), &one_strawberry());
    run_on_slope(&mut bed, &[], &[], 1);
    let rest = first(&bed, usize::MAX);
    run_on_slope(&mut bed, &[], &[], 300);
    assert!(first(&bed, usize::MAX) == rest);
}

#[test]
fn a_lone_foot_leans_in_a_current_as_a_foot_beside_another_does() {
    let top = |count: usize| {
        let plants = (0..count).map(|i| Anemone {
            species: "actinia-fragacea".into(),
            position: [-2.0 * i as f64, 0.0, 0.0],
            scale: 1.0,
            yaw: 0.0,
            seed: Some(3),
        });
        let config = Config { anemones: plants.collect(), ..Config::default() };
        let mut bed = grow(&info(&["actinia-fragacea"]), &config);
        let top = |bed: &Bed| {
            bed.trace()
                .take_while(|node| node.object == 0)
                .last()
                .map(|node| DVec3::from(node.position))
                .expect("a foot")
        };
        run_on_slope(&mut bed, &[], &[], 1);
        let rest = top(&bed);
        run_on_slope(&mut bed, &[current(DVec3::X * 0.15)], &[], 1200);
        top(&bed).distance(rest)
    };
    let (one, two) = (top(1), top(2));
    assert_eq!(one, two);
    // The foot of an Actinia in 0.15 m/s: about a centimetre.
    assert!(one > 5e-3, "{one}");
}
