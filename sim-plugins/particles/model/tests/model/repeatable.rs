//! The same bytes at every instruction set; states that come back as they were.

use glam::DVec3;
use reef_flow::Level;
use reef_particles_model::{Cloud, Levels, Surroundings, cloud::State};
use reef_sdk::{
    StateError, StateReader, StateWriter,
    abi::{self, Billboard, Trace},
};

use crate::common::*;

const BOXES: &str = "[[boxes]]\nlow = [-5.0, -1.5, -5.0]\nhigh = [5.0, -0.5, 5.0]\ncount = 3001\n\
                     [[boxes]]\nkind = \"plankton\"\nlow = [-2.0, -4.0, -2.0]\nhigh = [2.0, -1.0, 2.0]\ncount = 777\n";

/// Steps under waves, a current, an eddy and a source near a wall, before an eye that moves.
fn go(cloud: &mut Cloud, level: Level, steps: core::ops::Range<u64>) -> Vec<(Vec<Billboard>, Vec<Trace>)> {
    let flow = [
        current(DVec3::new(0.3, 0.05, 0.1)),
        local(abi::FLOW_WHIRLWIND, DVec3::new(1.0, -1.0, 1.0), 0.1, 0.5),
        local(abi::FLOW_SOURCE, DVec3::new(4.8, -1.0, 0.0), 0.2, 0.8),
        local(abi::FLOW_HOLE, DVec3::new(0.0, -3.0, 0.0), 0.5, 0.8),
    ];
    steps
        .map(|number| {
            let t = number as f64 * DT;
            let camera = camera(DVec3::new(0.0, -1.2, 16.0 - t), DVec3::new(0.0, -1.0, 0.0));
            let waves = sea(6.0, 50.0, t);
            let trace = number % 50 == 0;
            let around = Surroundings { step: number, level, trace, ..around(&flow, &waves, &camera) };
            step(cloud, &around, &Levels::default())
        })
        .collect()
}

#[test]
fn every_level_gives_the_same_bytes() {
    let run = |level| {
        let mut cloud = cloud(BOXES);
        (go(&mut cloud, level, 1..250), cloud.save())
    };
    let (steps, state) = run(Level::scalar());
    assert!(steps.iter().all(|(sprites, _)| !sprites.is_empty()));
    for level in Level::all() {
        let (others, other) = run(level);
        for (number, (a, b)) in steps.iter().zip(&others).enumerate() {
            let bytes = |s: &[Billboard]| bytemuck::cast_slice::<_, u8>(s).to_vec();
            assert!(bytes(&a.0) == bytes(&b.0), "step {number} at {}", level.name());
            assert!(a.1 == b.1, "trace of step {number} at {}", level.name());
        }
        assert_eq!(state, other, "{}", level.name());
    }
}

#[test]
fn a_run_that_is_cut_in_two_goes_on_as_one() {
    let mut whole = cloud(BOXES);
    go(&mut whole, Level::best(), 1..200);
    let state = whole.save();
    let rest = go(&mut whole, Level::best(), 200..300);
    let mut cut = cloud(BOXES);
    cut.load(&state).expect("its own state");
    assert_eq!(cut.save(), state);
    assert!(go(&mut cut, Level::best(), 200..300) == rest);
    assert_eq!(cut.save(), whole.save());
}

#[test]
fn the_picture_of_a_loaded_state_is_that_of_the_saved_one_with_its_jumps() {
    let flow = [
        current(DVec3::new(0.3, 0.05, 0.1)),
        local(abi::FLOW_SOURCE, DVec3::new(4.8, -1.0, 0.0), 0.2, 0.8),
        local(abi::FLOW_HOLE, DVec3::new(0.0, -3.0, 0.0), 0.5, 0.8),
    ];
    let camera = camera(DVec3::new(0.0, -1.2, 9.0), DVec3::new(0.0, -1.0, 0.0));
    let picture = |cloud: &mut Cloud, number: u64, dt: f64| {
        let around = Surroundings { step: number, dt, ..around(&flow, &[], &camera) };
        step(cloud, &around, &no_levels()).0
    };
    let mut whole = cloud(BOXES);
    let last = (1..=40).map(|number| picture(&mut whole, number, DT)).last().expect("steps");
    let jumps = |sprites: &[Billboard]| sprites.iter().filter(|s| s.flags & abi::FLAG_NO_BLEND != 0).count();
    assert!(jumps(&last) > 0);
    let state = whole.save();
    assert!(state.jumped.len() >= jumps(&last));
    let mut other = cloud(BOXES);
    // It has been elsewhere, and jumps of its own.
    picture(&mut other, 1, DT);
    other.load(&state).expect("its own state");
    assert_eq!(other.save(), state);
    // As after a reload: the step that made the picture is not made again, only its picture.
    assert!(picture(&mut other, 40, 0.0) == last);
    assert!(picture(&mut other, 41, DT) == picture(&mut whole, 41, DT));

    let mut bad = state.clone();
    bad.jumped.push(3778);
    assert!(other.load(&bad).is_err());
    let mut bad = state;
    bad.sources[1] = f64::INFINITY;
    assert!(other.load(&bad).is_err());
}

#[test]
fn a_state_of_version_1_is_read_as_one_without_jumps_and_sources() {
    let mut whole = cloud(BOXES);
    go(&mut whole, Level::best(), 1..100);
    let now = whole.save();
    assert!(!now.sources.is_empty());
    let old = State { jumped: Vec::new(), sources: Vec::new(), ..now.clone() };
    // What version 1 wrote.
    let mut writer = StateWriter::new();
    writer.put("counts", &old.counts);
    writer.put("turns", &old.turns);
    writer.put_one("dt", old.dt);
    for (name, at) in ["x", "y", "z"].into_iter().zip(&old.at) {
        writer.put(name, at);
    }
    let bytes = writer.finish().expect("each field once");
    let read = |version| State::read(&mut StateReader::parse(version, &bytes).expect("a state"));
    assert_eq!(read(1).expect("version 1"), old);
    // As version 2 it lacks something.
    assert_eq!(read(2), Err(StateError::Missing("jumped".into())));
    let mut other = cloud(BOXES);
    other.load(&old).expect("a state of these boxes");
    assert_eq!(other.save(), old);
    go(&mut other, Level::best(), 100..110);
    // And what is written today comes back whole.
    let mut writer = StateWriter::new();
    now.write(&mut writer);
    let bytes = writer.finish().expect("each field once");
    assert_eq!(State::read(&mut StateReader::parse(2, &bytes).expect("a state")), Ok(now));
}

#[test]
fn a_state_of_other_boxes_is_refused_and_changes_nothing() {
    let mut cloud = cloud(BOXES);
    let own = cloud.save();
    let mut other = own.clone();
    other.counts[1] = 776;
    assert!(cloud.load(&other).expect_err("another number").contains("[3001, 776]"));
    let mut other = own.clone();
    other.turns[2] = f64::NAN;
    assert!(cloud.load(&other).is_err());
    let mut other = own.clone();
    other.at[1].pop();
    assert!(cloud.load(&other).is_err());
    assert_eq!(cloud.save(), own);
}

#[test]
fn seeds_give_places_of_their_own() {
    let boxes = |seed: &str| {
        cloud(&format!("[[boxes]]\nlow = [0, -2, 0]\nhigh = [1, -1, 1]\ncount = 50\n{seed}")).save().at
    };
    assert_eq!(boxes("seed = 3"), boxes("seed = 3"));
    assert_ne!(boxes("seed = 3"), boxes("seed = 4"));
    assert_ne!(boxes("seed = 0"), boxes(""));
}
