//! Many plants: each as if it were alone, the same bytes however the work is done.

use glam::DVec3;
use reef_flow::Level;
use reef_sdk::abi::{Flow, Wave};
use reef_seaweed_model::{
    bed::{Bed, Plant, State, Surroundings},
    levels::Levels,
};

use crate::common::*;

/// So many plants, no two alike, over 30 × 12 m.
fn plants(count: usize) -> Vec<Plant> {
    (0..count)
        .map(|i| {
            let at = i as f64;
            let place = |factor: f64, size: f64| ((at * factor).fract() - 0.5) * size;
            Plant {
                kind: i % 2,
                root: DVec3::new(place(0.7548, 12.0), -10.0, place(0.5698, 30.0)),
                yaw: 1.3 * at,
                size: 0.7 + 0.6 * (at * 0.618).fract(),
                stiff: 0.8 + 0.4 * (at * 0.414).fract(),
                bend: 0.1,
                seed: i as u64,
                ground: Some(DVec3::new(0.1, 1.0, 0.05).normalize()),
                ..plant(PLACE)
            }
        })
        .collect()
}

fn kinds() -> Vec<reef_seaweed_model::bed::Kind> {
    vec![kind(usual_blade()), kind(bush())]
}

/// A camera that flies over them and looks around, so that all levels, and pauses, occur.
fn flight(time: f64) -> reef_sdk::abi::Camera {
    let eye = DVec3::new(3.0 * (0.3 * time).sin(), -9.0, 18.0 - 3.0 * time);
    camera(eye, eye + DVec3::new((0.8 * time).sin(), -0.2, -(0.8 * time).cos()))
}

/// What acts on them: a current, an eddy, waves.
fn acting(time: f64) -> (Vec<Flow>, Vec<Wave>) {
    let eddy = Flow {
        kind: reef_sdk::abi::FLOW_WHIRLWIND,
        position: [1.0, -9.5, 2.0],
        axis: [0.0, 1.0, 0.0],
        strength: 0.3,
        peak: 0.5,
        core: 0.2,
        reach: 5.0,
        fade: 0.5,
        ..Flow::default()
    };
    let waves = sea(7.0, 12).iter().map(|train| train.at(time)).collect();
    (vec![current(DVec3::new(0.1, 0.0, 0.05)), eddy], waves)
}

fn fly(bed: &mut Bed, steps: core::ops::Range<usize>, level: Level) {
    for step in steps {
        let time = step as f64 * DT;
        let (flow, waves) = acting(time);
        let camera = flight(time);
        let levels = Levels { near: 4.0, far: 9.0, ..Levels::default() };
        bed.step(&Surroundings { level, ..around(&flow, &waves, &camera) }, &levels);
    }
}

/// The part of a state that is one plant's, bit for bit.
fn of(state: &State, plant: usize) -> (Vec<u32>, Vec<u32>) {
    let first: u32 = state.segments[..plant].iter().sum();
    let joints = &state.joints[8 * first as usize..][..8 * state.segments[plant] as usize];
    let bits = |values: &[f32]| values.iter().map(|v| v.to_bits()).collect();
    (bits(joints), bits(&state.plants[6 * plant..][..6]))
}

#[test]
fn a_plant_alone_is_the_same_plant_among_64_others() {
    let all = plants(65);
    let mut bed = Bed::new(kinds(), all.clone());
    let mut singles: Vec<Bed> = all.iter().map(|plant| Bed::new(kinds(), vec![plant.clone()])).collect();
    let (mut levels, mut pauses) = ([0; 3], 0);
    for step in (0..480).step_by(60) {
        fly(&mut bed, step..step + 60, Level::best());
        let together = bed.save();
        for (i, single) in singles.iter_mut().enumerate() {
            fly(single, step..step + 60, Level::best());
            assert_eq!(of(&together, i), of(&single.save(), 0), "plant {i} at step {step}");
            let detail = bed.detail(i).unwrap()[0];
            levels[detail.round() as usize] += 1;
            pauses += usize::from(together.plants[6 * i + 2] > 0.0);
        }
    }
    // All that could differ did occur.
    assert!(levels.iter().all(|count| *count > 20) && pauses > 50, "{levels:?} {pauses}");
}

#[test]
fn every_instruction_set_gives_the_same_bytes() {
    let state_at = |level| {
        let mut bed = Bed::new(kinds(), plants(20));
        fly(&mut bed, 0..150, level);
        let mut poses = vec![Default::default(); bed.joint_count()];
        bed.write_poses(level, reef_sdk::Workers::inline(), &mut poses);
        let bits: Vec<[u32; 7]> = poses
            .iter()
            .map(|pose: &reef_seaweed_model::bed::JointPose| {
                let [x, y, z] = pose.position.map(f32::to_bits);
                let [a, b, c, d] = pose.rotation.map(f32::to_bits);
                [x, y, z, a, b, c, d]
            })
            .collect();
        (bed.save().joints.iter().map(|v| v.to_bits()).collect::<Vec<u32>>(), bits)
    };
    let reference = state_at(Level::scalar());
    for level in Level::all() {
        assert!(state_at(level) == reference, "{}", level.name());
    }
}

#[test]
fn a_saved_state_goes_on_as_if_nothing_had_been() {
    let never_seen =
        |state: &State| state.plants.chunks_exact(6).filter(|plant| plant[2] == f32::MAX).count();
    // Before any step, after the first one, which sees the other way, and amid the flight.
    for (first, saved) in [(150, 150), (150, 151), (0, 200)] {
        let mut bed = Bed::new(kinds(), plants(40));
        fly(&mut bed, first..saved, Level::best());
        let state = bed.save();
        let mut other = Bed::new(kinds(), plants(40));
        other.load(&state).unwrap();
        assert_eq!(other.save(), state);
        fly(&mut bed, saved..400, Level::best());
        fly(&mut other, saved..400, Level::best());
        assert_eq!(bed.save(), other.save(), "at {saved}");
        assert_eq!(bed.flows(), other.flows(), "at {saved}");
        // Some come into view for the first time later.
        let begun = (first + 1..first + 10).contains(&saved);
        assert!(!begun || never_seen(&state) > never_seen(&bed.save()));
    }
}

#[test]
fn wrong_states_are_refused_and_change_nothing() {
    let mut bed = Bed::new(kinds(), plants(3));
    let state = bed.save();
    let mut refusal = |change: fn(&mut State)| {
        let mut wrong = state.clone();
        change(&mut wrong);
        let message = bed.load(&wrong).unwrap_err();
        assert_eq!(bed.save(), state);
        message
    };
    let text = refusal(|s| s.segments[1] = 9);
    assert_eq!(text, "is of 3 plants with 29 segments; here are 3 with 34");
    assert_eq!(refusal(|s| s.joints.truncate(8)), "has not as many numbers as its segments need");
    assert_eq!(refusal(|s| s.joints[3] = f32::NAN), "has a number that is not finite");
    let text = refusal(|s| s.plants[0] = 2.5);
    assert!(text.starts_with("has a level of detail that is not from 0 to 2"), "{text}");
}

#[test]
fn a_joint_takes_at_most_160_bytes() {
    let hundred =
        blade(100, 1.5, reef_seaweed_model::skeleton::Segment { length: 0.02, ..Default::default() });
    let plants = (0..64).map(|i| plant(PLACE + DVec3::X * 0.1 * f64::from(i))).collect();
    let bed = Bed::new(vec![kind(skeleton(&hundred))], plants);
    let bytes = bed.bytes() as f64 / bed.joint_count() as f64;
    // 40 of state, and what a plant and its pack are.
    assert!((40.0..160.0).contains(&bytes), "{bytes}");
}
