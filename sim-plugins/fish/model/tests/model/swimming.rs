//! How a single fish swims.

use core::f64::consts::TAU;

use glam::DVec3;
use reef_fish_model::{
    material::{Beat, Drive, Material, Method},
    tank::{Stepping, Tank},
};

use crate::*;

/// Mean velocity over whole beats after `settle` seconds [m/s].
fn cruise(mut tank: Tank, stepping: &Stepping, settle: f64, seconds: f64) -> DVec3 {
    (0..(settle / DT).round() as usize).for_each(|_| step(&mut tank, DT, stepping));
    let start = tank.center(0);
    (0..(seconds / DT).round() as usize).for_each(|_| step(&mut tank, DT, stepping));
    (tank.center(0) - start) / seconds
}

fn usual_cruise(speed: f64) -> DVec3 {
    cruise(one(usual(), drive(speed, 0.2)), &implicit(), 4.0, 4.0)
}

#[test]
fn it_swims_forward_and_faster_the_faster_it_beats() {
    let ways = [1.0, 2.0, 3.0].map(usual_cruise);
    for (way, speed) in ways.iter().zip([1, 2, 3]) {
        println!("{speed} Hz: {:.4} m/s, {:.3} lengths/s", way.x, way.x / body().length());
        assert!(way.z.abs() < 0.2 * way.x, "sideways: {way}");
        assert!(way.y.abs() < 0.02 * way.x, "up or down: {way}");
    }
    assert!(ways[1].x > 0.05);
    assert!(ways[0].x < ways[1].x && ways[1].x < ways[2].x, "{ways:?}");
}

#[test]
fn twice_the_sub_steps_change_its_speed_by_less_than_a_tenth() {
    let finer = Stepping { longest: 0.5 * implicit().longest, ..implicit() };
    let [coarse, fine] =
        [implicit(), finer].map(|stepping| cruise(one(usual(), drive(2.0, 0.2)), &stepping, 4.0, 4.0).x);
    println!("{coarse:.4} and {fine:.4} m/s");
    assert!((coarse / fine - 1.0).abs() < 0.1);
}

#[test]
fn both_methods_swim() {
    let speed = |method| cruise(one(usual(), drive(2.0, 0.2)), &thesis(method), 4.0, 4.0).x;
    let [implicit, symplectic] = [Method::Implicit, Method::Symplectic].map(speed);
    println!("implicit {implicit:.4}, symplectic {symplectic:.4} m/s");
    assert!(implicit > 0.05 && (symplectic / implicit - 1.0).abs() < 0.2);
}

#[test]
fn left_first_is_the_mirror_of_right_first_in_f64() {
    let mut pair = [0.0, 0.5].map(|phase| {
        let mut fish = reference(&Material::default(), &Beat::default());
        fish.phase = phase;
        fish
    });
    let mut worst: f64 = 0.0;
    for _ in 0..2000 {
        pair.iter_mut().for_each(|fish| fish.step(0.004, Method::Implicit, &drive(2.0, 0.2), DVec3::ZERO));
        worst = worst.max(mirrored(&pair[0].positions, &pair[1].positions));
    }
    println!("{worst:e} of a length over 8 s");
    assert!(worst < 1e-6);
}

#[test]
fn left_first_is_the_mirror_of_right_first_in_f32_for_a_second() {
    let mut pair = [0.0, 0.5].map(|phase| {
        let mut tank = one(usual(), drive(2.0, 0.2));
        tank.swimmers_mut()[0].phase = phase;
        tank
    });
    for _ in 0..60 {
        pair.iter_mut().for_each(|tank| step(tank, DT, &implicit()));
    }
    let apart = mirrored(&nodes(&pair[0], 0), &nodes(&pair[1], 0));
    println!("{apart:e} of a length");
    assert!(apart < 2e-6);
}

/// How far a fish is from being the mirror of another, left for right, over its length.
fn mirrored(one: &[DVec3], other: &[DVec3]) -> f64 {
    let body = body();
    let mut partner: Vec<usize> = (0..body.nodes().len()).collect();
    for segment in body.segments().filter(|segment| segment.len() == 4) {
        for i in 0..4 {
            partner[segment.start + i] = segment.start + 3 - i;
        }
    }
    let apart = |i: usize| (one[i] - other[partner[i]] * DVec3::new(1.0, 1.0, -1.0)).length();
    (0..one.len()).map(apart).fold(0.0, f64::max) / body.length()
}

#[test]
fn the_tail_beats_as_often_as_speed_says() {
    for speed in [1.0, 2.0, 3.1] {
        let mut tank = one(usual(), drive(speed, 0.2));
        // Where the tail is beside the first section's axis.
        let tail = |tank: &Tank| {
            let at = nodes(tank, 0);
            let shoulder = (at[1] + at[2] + at[3] + at[4]) / 4.0;
            let forward = (at[0] - shoulder).normalize();
            (0.5 * (at[21] + at[22]) - shoulder).dot(forward.cross(DVec3::Y))
        };
        let mut crossings = Vec::new();
        let mut before = tail(&tank);
        for i in 0..(10.0 / DT) as usize {
            step(&mut tank, DT, &implicit());
            let now = tail(&tank);
            if i as f64 * DT > 2.0 && before < 0.0 && now >= 0.0 {
                crossings.push((i as f64 + before / (before - now)) * DT);
            }
            before = now;
        }
        let beats = (crossings.len() - 1) as f64;
        let measured = beats / (crossings[crossings.len() - 1] - crossings[0]);
        println!("{speed} Hz: {measured:.4} Hz over {beats} beats");
        assert!(beats > 5.0 && (measured / speed - 1.0).abs() < 0.01);
    }
}

/// Heading from +x toward −z, which is its left, and the angle over the horizon [rad].
fn heading(tank: &Tank) -> [f64; 2] {
    let at = nodes(tank, 0);
    let forward = (at[0] - 0.5 * (at[21] + at[22])).normalize();
    [(-forward.z).atan2(forward.x), forward.y.asin()]
}

/// Heading after some seconds of swimming with a bias of its muscles.
fn steered(yaw: f64, pitch: f64, seconds: f64) -> [f64; 2] {
    let mut tank = one(usual(), Drive { yaw, pitch, ..drive(2.0, 0.2) });
    (0..(seconds / DT) as usize).for_each(|_| step(&mut tank, DT, &implicit()));
    heading(&tank)
}

#[test]
fn muscles_on_one_side_turn_it_to_that_side() {
    let [left, right, more] = [0.05, -0.05, 0.1].map(|yaw| steered(yaw, 0.0, 3.0));
    println!("left {left:?}, right {right:?}, more {more:?}");
    assert!(left[0] > 0.2 && right[0] < -0.2 && more[0] > 1.4 * left[0]);
    assert!(left[1].abs() < 0.1 && right[1].abs() < 0.1);
}

#[test]
fn muscles_at_the_top_turn_it_upward() {
    let [up, down] = [0.05, -0.05].map(|pitch| steered(0.0, pitch, 3.0));
    println!("up {up:?}, down {down:?}");
    assert!(up[1] > 0.1 && down[1] < -0.1);
    assert!(up[0].abs() < 0.1 && down[0].abs() < 0.1);
}

#[test]
fn one_that_lies_on_its_side_rolls_upright() {
    let mut tank = one(usual(), drive(2.0, 0.2));
    let (sine, cosine) = (TAU / 6.0).sin_cos();
    let rolled: Vec<[f32; 3]> = tank
        .positions(0)
        .iter()
        .map(|[x, y, z]| [*x, y * cosine as f32 - z * sine as f32, y * sine as f32 + z * cosine as f32])
        .collect();
    let still = tank.velocities(0).to_vec();
    tank.place(0, &rolled, &still);
    let up = |tank: &Tank| {
        let at = nodes(tank, 0);
        let lifted = at.iter().zip(tank.plan().body().lift()).map(|(at, lift)| *at * f64::from(*lift));
        lifted.sum::<DVec3>().normalize().y
    };
    assert!(up(&tank) < 0.51);
    (0..600).for_each(|_| step(&mut tank, DT, &implicit()));
    println!("{}", up(&tank));
    assert!(up(&tank) > 0.95);
}

#[test]
fn a_current_carries_it_along() {
    let current = DVec3::new(0.0, 0.0, 0.3);
    let mut tank = one(usual(), drive(2.0, 0.0));
    tank.swimmers_mut()[0].water = current;
    let way = cruise(tank, &implicit(), 3.0, 1.0);
    assert!((way - current).length() < 0.01, "{way}");
}
