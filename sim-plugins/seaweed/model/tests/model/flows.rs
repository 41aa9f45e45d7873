//! What plants do to the water (§4.3.4).

use glam::DVec3;
use reef_flow::Packed;
use reef_sdk::abi::{self, Flow};
use reef_seaweed_model::{
    bed::{Bed, Surroundings},
    levels::Levels,
};

use crate::common::*;

#[test]
fn a_plant_that_moves_is_one_source_by_its_acceleration() {
    let plants = vec![plant(PLACE), plant(PLACE + DVec3::X * 1.5)];
    let mut bed = Bed::new(vec![kind(usual_blade())], plants);
    let camera = camera(PLACE + DVec3::new(0.0, 0.5, 4.0), PLACE);
    let mut emitted = 0;
    for step in 0..600 {
        let waves = [swell(0.8, 4.0, f64::from(step) * DT)];
        bed.step(&around(&[], &waves, &camera), &Levels::none());
        // Two plants shelter nothing.
        let flows: Vec<Flow> = bed.flows().to_vec();
        let owners: Vec<u64> = flows.iter().map(|flow| flow.owner).collect();
        assert!(owners.is_sorted() && owners.windows(2).all(|pair| pair[0] < pair[1]), "{owners:?}");
        for flow in flows {
            let plant = flow.owner as usize - 1;
            let [center, _, push] = bed.gravity(plant).unwrap();
            assert_eq!((flow.kind, flow.position), (abi::FLOW_SOURCE, center.to_array()));
            let expected = 0.01 * push.length();
            assert!((f64::from(flow.strength) / expected - 1.0).abs() < 1e-3, "{} {expected}", flow.strength);
            // Its centre of gravity is among its nodes, its reach about its box.
            let nodes = nodes(&mut bed, plant);
            let (low, high) =
                nodes.iter().fold((nodes[0], nodes[0]), |(low, high), p| (low.min(*p), high.max(*p)));
            assert!(
                center.cmpge(low - 0.05).all() && center.cmple(high + 0.05).all(),
                "{center} {low} {high}"
            );
            let half = 0.5 * (high - low).length();
            assert!((f64::from(flow.reach) / half - 1.0).abs() < 0.1, "{} {half}", flow.reach);
            emitted += 1;
        }
    }
    assert!(emitted > 800, "{emitted}");
    // A sea that stands still is not disturbed.
    run(&mut bed, &[], DT, 1800);
    assert_eq!(bed.flows(), []);
}

#[test]
fn plants_do_not_feel_their_own_sources() {
    let states = [false, true].map(|disturbed| {
        let mut bed = alone(usual_blade());
        let camera = camera(PLACE + DVec3::new(0.0, 0.5, 4.0), PLACE);
        let mut own: Vec<Flow> = Vec::new();
        for step in 0..240 {
            let waves = [swell(0.8, 4.0, f64::from(step) * DT)];
            bed.step(&around(if disturbed { &own } else { &[] }, &waves, &camera), &Levels::none());
            own = bed.flows().to_vec();
        }
        assert!(!own.is_empty());
        bed.save()
    });
    assert_eq!(states[0], states[1]);
    // Of others they do.
    let mut bed = alone(usual_blade());
    let source = Flow {
        owner: 1 << 50 | 1,
        kind: abi::FLOW_SOURCE,
        position: (PLACE + DVec3::new(-0.3, 0.5, 0.0)).to_array(),
        strength: 0.05,
        peak: 1.0,
        ..Flow::default()
    };
    run(&mut bed, &[source], DT, 120);
    assert!(tip(&mut bed, 0).x > 0.02);
}

/// Velocity at a point in a flow.
fn velocity(flow: &[Flow], at: DVec3) -> DVec3 {
    let mut packed = Packed::new();
    packed.fill(flow, at.to_array(), 0);
    DVec3::from(reef_flow::scalar::velocity(&packed, [0.0; 3]).map(f64::from))
}

#[test]
fn dense_beds_shelter_what_is_behind_them() {
    let bed_of = |count: usize| {
        let place = |i: usize| {
            let at = i as f64;
            PLACE + DVec3::new(((at * 0.7548).fract() - 0.5) * 7.0, 0.0, ((at * 0.5698).fract() - 0.5) * 7.0)
        };
        Bed::new(vec![kind(usual_blade())], (0..count).map(|i| plant(place(i))).collect())
    };
    for way in [DVec3::new(0.2, 0.0, 0.0), DVec3::new(0.0, 0.0, -0.2)] {
        let mut factors = Vec::new();
        for count in [1, 100, 600] {
            let mut bed = bed_of(count);
            let scene = [current(way)];
            let mut flow = scene.to_vec();
            for _ in 0..30 {
                run(&mut bed, &flow, DT, 1);
                flow = scene.iter().chain(bed.flows()).copied().collect();
            }
            let middle = DVec3::new(0.0, -9.5, 0.0);
            let behind = velocity(&flow, middle + 6.0 * way.normalize()).length() / 0.2;
            let before = velocity(&flow, middle - 6.0 * way.normalize()).length() / 0.2;
            assert!((before - 1.0).abs() < 0.02, "{before}");
            factors.push(behind);
        }
        assert!(factors[0] > 0.98 && factors[1] < 0.95 && factors[2] < factors[1] - 0.1, "{factors:?}");
        assert!(factors[2] > 0.1, "{factors:?}");
    }
}

#[test]
fn at_most_64_plants_disturb_the_water_the_strongest() {
    let plants = (0..200)
        .map(|i| plant(PLACE + DVec3::new(f64::from(i % 20) * 0.3, 0.0, f64::from(i / 20) * 0.3)))
        .collect();
    let mut bed = Bed::new(vec![kind(usual_blade())], plants);
    let camera = camera(PLACE + DVec3::new(3.0, 0.5, 9.0), PLACE + DVec3::X * 3.0);
    for step in 0..120 {
        let waves = [swell(0.8, 4.0, f64::from(step) * DT)];
        bed.step(&Surroundings { ..around(&[], &waves, &camera) }, &Levels::none());
    }
    let sources: Vec<f32> =
        bed.flows().iter().filter(|flow| flow.kind == abi::FLOW_SOURCE).map(|flow| flow.strength).collect();
    assert_eq!(sources.len(), 64);
    let least = sources.iter().copied().fold(f32::MAX, f32::min);
    let stronger =
        (0..200).filter(|i| 0.01 * bed.gravity(*i).unwrap()[2].length() > f64::from(least) * 1.001).count();
    assert!(stronger <= 64, "{stronger}");
}
