//! How fish behave together.

use glam::{DVec3, Vec3};
use reef_fish_model::{
    shoal::{Habitat, Kind, Shoal, Start, Surroundings, Waves},
    species::Species,
};
use reef_flow::{Level, random::Random};
use reef_sdk::Workers;

use crate::DT;

/// Still water without anything.
pub(crate) fn around(near: f64) -> Surroundings<'static> {
    Surroundings {
        flow: &[],
        bed: None,
        waves: Waves::default(),
        obstacles: &[],
        strangers: &[],
        surface: 0.0,
        hosts: &[],
        eye: DVec3::new(0.0, -5.0, 0.0),
        near,
        dt: DT,
        level: Level::best(),
        workers: Workers::inline(),
    }
}

/// A box of so many metres around (0, −5, 0).
pub(crate) fn habitat(size: f64) -> Habitat {
    let center = DVec3::new(0.0, -5.0, 0.0);
    Habitat { low: center - 0.5 * size, high: center + 0.5 * size }
}

/// Fish of the default species here and there in the middle half of their habitat.
pub(crate) fn starts(count: usize, habitat: &Habitat) -> Vec<Start> {
    let mut random = Random::new(11, 5);
    let middle = 0.5 * (habitat.low + habitat.high);
    let extent = 0.25 * (habitat.high - habitat.low);
    let mut start = |i: usize| Start {
        kind: 0,
        position: middle + extent * DVec3::from([(); 3].map(|()| random.signed())),
        heading: 3.1 * random.signed(),
        size: 1.0,
        habitat: 0,
        home: None,
        seed: i as u64,
    };
    (0..count).map(&mut start).collect()
}

pub(crate) fn shoal(count: usize, size: f64) -> Shoal {
    shoal_of(&Species::default(), count, size)
}

pub(crate) fn shoal_of(species: &Species, count: usize, size: f64) -> Shoal {
    let kind = Kind::new(species, Vec::new()).expect("a kind");
    let habitat = habitat(size);
    Shoal::new(vec![kind], vec![habitat], &starts(count, &habitat)).expect("a shoal")
}

/// Length of the mean course: 1 where all swim the same way.
fn polarisation(shoal: &Shoal) -> f32 {
    let sum: Vec3 = shoal.fish().iter().map(|fish| fish.course).sum();
    sum.length() / shoal.fish().len() as f32
}

/// For how long in a row any two fish were nearer than a width [s], at most; and by how much the walls were
/// passed [m, negative: none was reached]; and the fastest turn [rad/s].
fn watch(shoal: &mut Shoal, near: f64, size: f64, seconds: f64) -> [f64; 3] {
    let width = shoal.kinds()[0].plan.body().width();
    let habitat = habitat(size);
    let count = shoal.fish().len();
    let mut touching = vec![0.0_f64; count * count];
    let (mut longest, mut beyond, mut fastest): (f64, f64, f64) = (0.0, f64::NEG_INFINITY, 0.0);
    for _ in 0..(seconds / DT) as usize {
        let before: Vec<Vec3> = shoal.fish().iter().map(|fish| fish.course).collect();
        shoal.step(&around(near));
        let fish = shoal.fish();
        assert!(fish.iter().all(|fish| fish.near == (near > 0.0)));
        for i in 0..count {
            let out = (fish[i].position - habitat.high).max(habitat.low - fish[i].position);
            beyond = beyond.max(out.max_element());
            fastest = fastest.max(f64::from(fish[i].course.angle_between(before[i])) / DT);
            for j in 0..i {
                let time = &mut touching[i * count + j];
                let near = fish[i].position.distance(fish[j].position) < width;
                *time = if near { *time + DT } else { 0.0 };
                longest = longest.max(*time);
            }
        }
    }
    [longest, beyond, fastest]
}

#[test]
fn a_shoal_of_points_stays_home_apart_and_together() {
    let mut shoal = shoal(30, 4.0);
    let before = polarisation(&shoal);
    let [touching, beyond, turning] = watch(&mut shoal, 0.0, 4.0, 600.0);
    let after = polarisation(&shoal);
    println!("points: {touching:.2} s, {beyond:.3} m, {turning:.2} rad/s, {before:.2} -> {after:.2}");
    assert!(touching < 0.3, "two of them touch for {touching} s");
    assert!(beyond < 0.0, "one is {beyond} m out of its habitat");
    assert!(after > 0.9 && after > before + 0.3, "{before} -> {after}");
    // As fast as the body turns at its greatest bias, and no faster.
    let most = shoal.kinds()[0].gait.fastest_turn();
    assert!(turning < 1.01 * most && turning > 0.5 * most, "{turning} of {most} rad/s");
}

#[test]
fn a_shoal_of_bodies_stays_home_apart_and_together() {
    let mut shoal = shoal(8, 4.0);
    let before = polarisation(&shoal);
    let [touching, beyond, turning] = watch(&mut shoal, 1e9, 4.0, 600.0);
    let after = polarisation(&shoal);
    println!("bodies: {touching:.2} s, {beyond:.3} m, {turning:.2} rad/s, {before:.2} -> {after:.2}");
    assert!(touching < 0.3, "two of them touch for {touching} s");
    assert!(beyond < 0.0, "one is {beyond} m out of its habitat");
    assert!(after > 0.9 && after > before + 0.3, "{before} -> {after}");
    // What is left of the beat comes on top.
    assert!(turning < 4.0 * shoal.kinds()[0].gait.fastest_turn(), "{turning} rad/s");
}

#[test]
fn in_a_crowd_fish_look_less_far_and_alone_as_far_as_they_can() {
    // The last number of a fish's mind: how far it takes note of its own kind.
    let reach = |shoal: &Shoal| {
        let minds = shoal.save().minds;
        let reach: Vec<f32> = minds.chunks_exact(15).map(|mind| mind[14]).collect();
        assert_eq!(reach.len(), shoal.fish().len());
        reach
    };
    let (mut crowd, mut lone) = (shoal(200, 2.0), shoal(1, 2.0));
    for _ in 0..300 {
        crowd.step(&around(0.0));
        lone.step(&around(0.0));
    }
    let mean = reach(&crowd).iter().sum::<f32>() / 200.0;
    println!("{mean:.2} lengths in the crowd");
    assert!(mean > 1.5 && mean < 4.0);
    assert_eq!(reach(&lone), [6.0]);
}
