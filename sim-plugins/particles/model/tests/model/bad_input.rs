//! What is wrong is said with its place; what is merely empty is an empty sea.

use glam::DVec3;
use reef_particles_model::{Levels, Surroundings};

use crate::common::*;

const BOX: &str = "[[boxes]]\nlow = [-1.0, -2.0, -1.0]\nhigh = [1.0, -1.0, 1.0]\n";

fn refused(text: &str) -> String {
    try_cloud(text).expect_err("a bad configuration").to_string()
}

#[test]
fn boxes_that_cannot_be_are_refused_with_their_place() {
    let upside_down = "[[boxes]]\nlow = [-1.0, -1.0, -1.0]\nhigh = [1.0, -2.0, 1.0]\n";
    assert_eq!(
        refused(&format!("{BOX}{upside_down}")),
        "boxes[1].high: must lie beyond `low` along y: -2 is not above -1"
    );
    assert!(refused("[[boxes]]\nlow = [0, 0, 0]\nhigh = [1, 0, 1]\n").starts_with("boxes[0].high: must lie"));
    assert!(refused("[[boxes]]\nlow = [0, 0, 0]\nhigh = [1, 1, 1e5]\n").contains("0.001 to 2000 m"));
    assert!(refused("[[boxes]]\nlow = [nan, 0, 0]\nhigh = [1, 1, 1]\n").starts_with("boxes[0].low"));
}

#[test]
fn counts_beyond_the_limit_are_refused_and_the_limit_is_named() {
    let message = refused(&format!("{BOX}count = 4000001\n"));
    assert_eq!(
        message,
        "boxes[0].count: makes 4000001 particles; the limit is 4000000 in all boxes of a module together"
    );
    assert!(refused(&format!("{BOX}concentration = 1e15\n")).starts_with("boxes[0].concentration: makes"));
    let two = format!("{BOX}count = 3999999\n{BOX}concentration = 1.0\n");
    assert!(
        refused(&two).starts_with("boxes[1].concentration: makes 4000003 particles"),
        "{}",
        refused(&two)
    );
    assert!(
        refused(&format!("{BOX}grid = [4000, 4000, 4000]\n")).starts_with("boxes[0].grid: makes 64000000000")
    );
    assert!(refused(&format!("slaves = 16\n{BOX}")).starts_with("slaves: is 16; the limit is 15"));
    let many = BOX.repeat(257);
    assert!(refused(&many).starts_with("boxes: has 257 boxes; the limit is 256"));
}

#[test]
fn contradictions_and_nonsense_are_refused() {
    let cases = [
        ("count = 3\nconcentration = 2.0\n", "boxes[0].concentration: stands beside `count`"),
        ("count = 3\ngrid = [1, 1, 1]\n", "boxes[0].grid: stands beside"),
        ("concentration = -1.0\n", "boxes[0].concentration: must be at least 0"),
        ("concentration = nan\n", "boxes[0].concentration: must be at least 0"),
        ("size = [0.0, 0.1]\n", "boxes[0].size"),
        ("size = [0.2, 0.1]\n", "boxes[0].size"),
        ("opacity = 1.5\n", "boxes[0].opacity: must be from 0 to 1, is 1.5"),
        ("opacity = nan\n", "boxes[0].opacity"),
        ("color = \"white\"\n", "boxes[0].color"),
        ("color = \"#12é45\"\n", "boxes[0].color"),
        ("follow = [2.0, 1.0]\n", "boxes[0].follow"),
    ];
    for (line, expected) in cases {
        let message = refused(&format!("{BOX}{line}"));
        assert!(message.starts_with(expected), "{line} {message}");
    }
    assert!(refused(&format!("{BOX}kind = \"snow\"\n")).contains("snow"));
}

#[test]
fn no_boxes_and_no_particles_are_an_empty_sea() {
    let camera = camera(DVec3::new(0.0, -1.0, 4.0), DVec3::new(0.0, -1.5, 0.0));
    let waves = sea(8.0, 50.0, 1.0);
    for text in ["", &format!("{BOX}count = 0\n"), &format!("{BOX}concentration = 0.0\n")] {
        let mut cloud = cloud(text);
        let flow = [current(DVec3::X)];
        let around = Surroundings { trace: true, ..around(&flow, &waves, &camera) };
        let (sprites, trace) = step(&mut cloud, &around, &Levels::default());
        assert_eq!((sprites.len(), trace.len()), (0, 0));
        assert!(cloud.objects().all(|object| object.bounds_radius.is_finite()));
    }
}

#[test]
fn a_sea_without_depth_or_trains_or_with_broken_ones_is_still_and_has_no_nan() {
    let camera = camera(DVec3::new(0.0, -1.0, 4.0), DVec3::new(0.0, -1.5, 0.0));
    let good = sea(8.0, 50.0, 1.0);
    let mut broken = good.clone();
    for wave in &mut broken {
        wave.amplitude = f32::NAN;
    }
    let run = |waves: &[_], depth| {
        let mut cloud = cloud(&format!("{BOX}count = 500\n"));
        let around = Surroundings { depth, trace: true, ..around(&[], waves, &camera) };
        step(&mut cloud, &around, &Levels::default())
    };
    let still = run(&[], 50.0);
    assert!(!still.0.is_empty());
    for (waves, depth) in [(&good, 0.0), (&good, -3.0), (&good, f64::NAN), (&broken, 50.0)] {
        assert!(run(waves, depth) == still, "depth {depth}");
    }
    for sprite in &run(&good, 50.0).0 {
        let numbers = sprite.position.iter().chain(&sprite.velocity).chain([&sprite.opacity, &sprite.size]);
        assert!(numbers.into_iter().all(|v| v.is_finite()));
    }
    // Water of a hair's depth has orbits that reach far; they are still numbers.
    for sprite in &run(&good, 1e-3).0 {
        assert!(sprite.position.iter().chain(&sprite.velocity).all(|v| v.is_finite()));
    }
}
