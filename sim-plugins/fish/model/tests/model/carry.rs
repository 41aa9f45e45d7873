//! The singularities that fish carry.

use glam::DVec3;
use reef_fish_model::{
    shoal::{Host, Kind, Shoal, Start, Surroundings, id_of},
    species::{Singularity, Species},
};
use reef_sdk::abi::{self, Flow};

use crate::{
    DT,
    shoal::{around, habitat},
    species::species,
};

/// A fish of a species that swims past an anemone: what it emits at each step, and where it ends.
fn passing(species: &Species, near: f64) -> (Vec<Option<Flow>>, DVec3) {
    let mut species = species.clone();
    species.mind.wander = 0.0;
    species.mind.home = 0.0;
    let kind = Kind::new(&species, Vec::new()).expect("a kind");
    let start = Start {
        kind: 0,
        position: DVec3::new(-1.5, -5.0, 0.0),
        heading: 0.0,
        size: 1.0,
        habitat: 0,
        home: None,
        seed: 1,
    };
    let mut shoal = Shoal::new(vec![kind], vec![habitat(40.0)], &[start]).expect("a shoal");
    let hosts = [Host { position: DVec3::new(0.0, -5.2, 0.0), radius: 0.1, ..Host::default() }];
    let mut flows: Vec<Option<Flow>> = Vec::new();
    for _ in 0..(60.0 / DT) as usize {
        let mut own: Vec<Flow> = flows.last().copied().flatten().into_iter().collect();
        // A little behind it: at its very centre it would be nothing.
        own.iter_mut().for_each(|flow| flow.position[0] -= 0.03);
        shoal.step(&Surroundings { hosts: &hosts, flow: &own, ..around(near) });
        assert!(shoal.flows().len() <= 1);
        flows.push(shoal.flows().first().copied());
    }
    (flows, shoal.fish()[0].position)
}

#[test]
fn what_a_fish_carries_rises_and_falls_smoothly_as_it_passes() {
    for (name, kind, near) in [
        ("clownfish", abi::FLOW_SOURCE, 0.0),
        ("regal-tang", abi::FLOW_HOLE, 0.0),
        ("clownfish", abi::FLOW_SOURCE, 1e9),
    ] {
        let (flows, _) = passing(&species(name), near);
        let strengths: Vec<f32> = flows.iter().map(|flow| flow.map_or(0.0, |flow| flow.strength)).collect();
        let most = strengths.iter().copied().fold(0.0, f32::max);
        let full = species(name).carries.strength as f32;
        assert!(flows.iter().flatten().all(|flow| flow.kind == kind && flow.owner == id_of(0)));
        println!("{name}: at most {most} of {full} m³/s");
        assert!(most > 0.3 * full && most <= full);
        assert_eq!([strengths[0], strengths[strengths.len() - 1]], [0.0; 2], "far away there is none");
        let jump = strengths.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f32::max);
        assert!(jump < 0.03 * full, "{jump}");
    }
}

#[test]
fn a_fish_does_not_feel_what_it_carries() {
    let with = species("clownfish");
    let mut without = with.clone();
    without.carries.kind = Singularity::None;
    let ([flows, none], [end, free]) = {
        let ((a, x), (b, y)) = (passing(&with, 0.0), passing(&without, 0.0));
        ([a, b], [x, y])
    };
    assert!(flows.iter().flatten().count() > 30 && none.iter().flatten().count() == 0);
    assert_eq!(end, free);
}

#[test]
fn a_faster_fish_carries_more() {
    let strength = |cruise: f64| {
        let mut species = species("regal-tang");
        species.mind.wander = 0.0;
        species.mind.cruise = cruise;
        let kind = Kind::new(&species, Vec::new()).expect("a kind");
        let start = Start {
            kind: 0,
            position: DVec3::new(0.0, -5.0, 0.0),
            heading: 0.0,
            size: 1.0,
            habitat: 0,
            home: None,
            seed: 1,
        };
        let mut shoal = Shoal::new(vec![kind], vec![habitat(400.0)], &[start]).expect("a shoal");
        for _ in 0..600 {
            // The anemone is always as near.
            let position = shoal.fish()[0].position - DVec3::Y * 0.2;
            shoal.step(&Surroundings {
                hosts: &[Host { position, radius: 0.1, ..Host::default() }],
                ..around(0.0)
            });
        }
        shoal.flows()[0].strength
    };
    let [slow, fast] = [0.1, 1.0].map(strength);
    println!("{slow} and {fast} m³/s");
    assert!(fast > 1.5 * slow);
}
