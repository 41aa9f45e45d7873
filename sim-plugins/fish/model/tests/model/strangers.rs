//! What fish do about who is in the sea beside them.

use glam::{DVec3, Vec3};
use reef_fish_model::{
    shoal::{Habitat, Kind, Shoal, Start, Stranger, Surroundings},
    species::Species,
};
use reef_sdk::abi::fnv1a_32;

use crate::{DT, shoal::around};

const BOX: Habitat = Habitat { low: DVec3::new(-6.0, -9.0, -6.0), high: DVec3::new(6.0, -1.0, 6.0) };

/// Fish without whims that swim along x.
fn fish(fears: &[&str], count: u32) -> Shoal {
    let mut species = Species::default();
    species.mind.wander = 0.0;
    species.mind.fears = fears.iter().map(|name| (*name).to_owned()).collect();
    let start = |i: u32| Start {
        kind: 0,
        position: DVec3::new(-0.5 * f64::from(i), -5.0, 0.05 * f64::from(i % 3)),
        heading: 0.0,
        size: 1.0,
        habitat: 0,
        home: None,
        seed: u64::from(i),
    };
    let starts: Vec<Start> = (0..count).map(start).collect();
    Shoal::new(vec![Kind::new(&species, vec![]).expect("a kind")], vec![BOX], &starts).expect("a shoal")
}

fn stranger(x: f64, speed: f32, radius: f32) -> Stranger {
    let position = DVec3::new(x, -5.0, 0.0);
    Stranger { position, velocity: Vec3::new(-speed, 0.0, 0.0), radius, species: fnv1a_32(b"sunfish") }
}

/// Runs with one that goes on as it does; its least distance from the middle of a fish [m].
fn meet(shoal: &mut Shoal, mut other: Stranger, near: f64, seconds: f64) -> f64 {
    let mut least = f64::INFINITY;
    for _ in 0..(seconds / DT) as usize {
        shoal.step(&Surroundings { strangers: &[other], ..around(near) });
        other.position += other.velocity.as_dvec3() * DT;
        let nearest = shoal.fish().iter().map(|fish| fish.position.distance(other.position));
        least = nearest.fold(least, f64::min);
    }
    least
}

#[test]
fn fish_keep_off_whoever_drifts_in_their_way() {
    for near in [0.0, 1e9] {
        let mut shoal = fish(&[], 3);
        let least = meet(&mut shoal, stranger(1.2, 0.01, 0.3), near, 30.0);
        println!("{least}");
        assert!(least > 0.3, "{least}");
        assert!(shoal.fish().iter().all(|fish| fish.fright <= 0.0), "what drifts frightens nobody");
    }
    // Without it they swim through where it was.
    let mut alone = fish(&[], 3);
    let mut least = f64::INFINITY;
    for _ in 0..(30.0 / DT) as usize {
        alone.step(&around(0.0));
        let gap = |at: DVec3| at.distance(DVec3::new(1.2, -5.0, 0.0));
        least = alone.fish().iter().map(|fish| gap(fish.position)).fold(least, f64::min);
    }
    assert!(least < 0.2, "{least}");
}

#[test]
fn fish_flee_from_what_is_large_and_fast_or_feared() {
    let flight = |fears: &[&str], speed: f32, radius: f32| {
        let mut shoal = fish(fears, 1);
        meet(&mut shoal, stranger(1.0, speed, radius), 0.0, 0.5);
        shoal.fish()[0].fright > 0.0
    };
    assert!(flight(&[], 0.6, 0.4), "large and fast");
    assert!(!flight(&[], 0.02, 0.4), "large, but slow");
    assert!(!flight(&[], 0.6, 0.02), "fast, but small");
    assert!(flight(&["sunfish"], 0.0, 0.02), "feared");
    assert!(!flight(&["shark"], 0.0, 0.02), "another is feared");
}

#[test]
fn what_is_behind_a_fish_does_not_frighten_it() {
    let mut shoal = fish(&["sunfish"], 1);
    meet(&mut shoal, stranger(-0.8, 0.0, 0.05), 0.0, 0.2);
    assert!(shoal.fish()[0].fright <= 0.0);
    let ahead = shoal.fish()[0].position.x + 0.8;
    meet(&mut shoal, stranger(ahead, 0.0, 0.05), 0.0, 0.2);
    assert!(shoal.fish()[0].fright > 0.0);
}

#[test]
fn the_order_of_strangers_changes_nothing() {
    let mut many: Vec<Stranger> = (0..40)
        .map(|i| {
            let at = f64::from(i);
            let position = DVec3::new(0.9 + 0.07 * at, -5.0 + 0.3 * (at * 1.7).sin(), 0.4 * (at * 0.9).cos());
            Stranger { position, ..stranger(0.0, 0.3, 0.05 + 0.01 * i as f32) }
        })
        .collect();
    let mut run = || {
        let mut shoal = fish(&["sunfish"], 10);
        (0..60).for_each(|_| shoal.step(&Surroundings { strangers: &many, ..around(0.0) }));
        many.reverse();
        shoal.save()
    };
    assert!(run() == run());
}
