//! Levels of detail (§4.4): what they leave out, and that nobody sees it.

use glam::DVec3;
use reef_sdk::abi::{Camera, Wave};
use reef_seaweed_model::{
    bed::{Bed, Plant},
    levels::{Levels, Method},
    skeleton::Segment,
};

use crate::common::*;

/// Five plants beside the way.
fn row() -> Vec<Plant> {
    (0..5)
        .map(|i| Plant {
            yaw: f64::from(i),
            size: 0.8 + 0.1 * f64::from(i),
            ..plant(PLACE + DVec3::X * (f64::from(i) - 2.0))
        })
        .collect()
}

/// The farthest that a node moves in a camera's picture between two steps [px].
fn moved(before: &[DVec3], after: &[DVec3], camera: &Camera) -> f64 {
    let pairs =
        before.iter().zip(after).filter_map(|(a, b)| Some((project(camera, *a)?, project(camera, *b)?)));
    pairs.map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1])).fold(0.0, f64::max)
}

fn all_nodes(bed: &mut Bed) -> Vec<DVec3> {
    (0..5).flat_map(|i| nodes(bed, i)).collect()
}

#[test]
fn crossing_the_borders_moves_no_vertex_by_more_than_two_pixels() {
    // In a current, and in a current and a swell; there what the plants do without levels comes on top.
    for amplitude in [0.0, 0.25] {
        let mut bed = Bed::new(vec![kind(usual_blade())], row());
        let mut without = bed.clone();
        let flow = [current(DVec3::new(0.12, 0.0, 0.03))];
        let (mut worst, mut before, mut twins_before): (f64, Vec<DVec3>, Vec<DVec3>) = (0.0, vec![], vec![]);
        let mut seen = [false; 3];
        for step in 0..2700 {
            let time = f64::from(step) * DT;
            // Ten seconds to settle, then from 3 m to 24 m and back at 1.2 m/s.
            let way = (time - 10.0).clamp(0.0, 35.0) * 1.2;
            let distance = if way < 21.0 { 3.0 + way } else { 45.0 - way };
            let camera = camera(PLACE + DVec3::new(0.0, 0.6, distance), PLACE + DVec3::Y * 0.4);
            let waves = [swell(amplitude, 6.0, time)];
            let around = around(&flow, if amplitude > 0.0 { &waves } else { &[] }, &camera);
            bed.step(&around, &Levels::default());
            without.step(&around, &Levels { trains: false, ..Levels::none() });
            let (now, twins) = (all_nodes(&mut bed), all_nodes(&mut without));
            if step > 600 {
                let own = moved(&twins_before, &twins, &camera);
                worst = worst.max(moved(&before, &now, &camera) - own);
                seen[bed.detail(2).unwrap()[0].round() as usize] = true;
            }
            (before, twins_before) = (now, twins);
        }
        assert_eq!(seen, [true; 3]);
        assert!(worst < 2.0, "{amplitude}: {worst} px");
    }
}

#[test]
fn each_level_computes_its_joints_and_no_others() {
    let skeleton = bush();
    for (distance, level) in [(3.0, 0), (10.0, 1), (30.0, 2)] {
        let mut bed = alone(skeleton.clone());
        let flow = [current(DVec3::new(0.3, 0.0, 0.0))];
        let camera = camera(PLACE + DVec3::new(0.0, 0.3, distance), PLACE);
        bed.step(&around(&flow, &[], &camera), &Levels::default());
        let before = angles(&bed, 0);
        let flow = [current(DVec3::new(0.1, 0.0, 0.2))];
        let work = bed.step(&around(&flow, &[], &camera), &Levels::default());
        let turned = angles(&bed, 0).iter().zip(before).filter(|(now, before)| now[1] != before[1]).count();
        assert_eq!(work.joints, skeleton.computed(level) as u64);
        assert_eq!(work.evaluations, skeleton.evaluated(level) as u64);
        // Some torque acts on every joint of this bush.
        assert_eq!(turned, skeleton.computed(level), "at {distance} m");
    }
}

#[test]
fn plants_begin_with_the_levels_that_their_distances_ask_for() {
    let plants = [3.0, 10.0, 30.0].map(|far| plant(PLACE - DVec3::Z * far));
    let mut bed = Bed::new(vec![kind(usual_blade())], plants.to_vec());
    let camera = camera(PLACE + DVec3::Y * 0.3, PLACE - DVec3::Z);
    for _ in 0..2 {
        // They blend from there on alone.
        bed.step(&around(&[], &[], &camera), &Levels::default());
        let details = [0, 1, 2].map(|i| bed.detail(i).unwrap());
        assert_eq!(details, [[0.0, 0.0], [1.0, 0.0], [2.0, 1.0]]);
    }
    let mut bed = alone(usual_blade());
    bed.step(&around(&[], &[], &camera), &Levels { method: Method::Procedural, ..Levels::default() });
    assert_eq!(bed.detail(0), Some([0.0, 1.0]));
}

#[test]
fn who_is_seen_for_the_first_time_far_away_is_bent_by_the_current() {
    // At once in view, and after ten seconds.
    for unseen in [0, 600] {
        let mut bed = alone(usual_blade());
        let flow = [current(DVec3::new(0.1, 0.0, 0.0))];
        let eye = PLACE + DVec3::new(0.0, 0.3, 30.0);
        for step in 0..=unseen {
            let at = if step < unseen { eye + DVec3::Z } else { PLACE };
            bed.step(&around(&flow, &[], &camera(eye, at)), &Levels::default());
        }
        assert_eq!(bed.detail(0), Some([2.0, 1.0]));
        // The segments above the first, which far plants do not compute, are bent as after four seconds near.
        let mut near = alone(usual_blade());
        run(&mut near, &flow, DT, 240);
        let [tip, wanted] = [tip(&mut bed, 0), tip(&mut near, 0)];
        assert!(tip.distance(wanted) < 0.05, "{unseen}: {tip}, not {wanted}");
        assert!(tip.x > 0.2, "{unseen}: {tip}");
    }
}

#[test]
fn methods_blend_over_about_a_second() {
    let mut bed = alone(usual_blade());
    let camera = camera(PLACE + DVec3::new(0.0, 0.5, 4.0), PLACE);
    let flow = [current(DVec3::new(0.1, 0.0, 0.0))];
    let (mut shares, mut last, mut worst) = (Vec::new(), None, 0.0_f64);
    for step in 0..900 {
        let time = f64::from(step) * DT;
        let method = if step < 600 { Method::Physical } else { Method::Procedural };
        let waves = [swell(0.3, 4.0, time)];
        bed.step(&around(&flow, &waves, &camera), &Levels { method, ..Levels::default() });
        shares.push(bed.detail(0).unwrap()[1]);
        let tip = tip(&mut bed, 0);
        if let Some(before) = last.replace(tip)
            && step > 300
        {
            worst = worst.max(tip.distance(before));
        }
    }
    let between = shares.iter().filter(|share| **share > 0.0 && **share < 1.0).count();
    assert!((55..=65).contains(&between), "{between} steps");
    // It sways by some centimetres a second; a switch of methods at once would add a jump.
    assert!(worst < 0.02, "{worst} m in a step");
}

#[test]
fn who_is_not_in_view_is_not_stepped_and_catches_up_unseen() {
    let mut bed = alone(usual_blade());
    let mut always = alone(usual_blade());
    let flow = [current(DVec3::new(0.06, 0.0, 0.0))];
    let eye = PLACE + DVec3::new(0.0, 0.5, 4.0);
    let mut seen_after = None;
    for step in 0..1500 {
        let time = f64::from(step) * DT;
        let away = (600..1050).contains(&step);
        let at = if away { eye + DVec3::Z } else { PLACE };
        let (camera, waves) = (camera(eye, at), [swell(0.3, 5.0, time)]);
        let around = around(&flow, &waves, &camera);
        let before = bed.save().joints;
        let work = bed.step(&around, &Levels::default());
        always.step(&around, &Levels { visible: false, ..Levels::default() });
        assert_eq!(work.plants, u64::from(!away));
        assert_eq!(bed.save().joints == before, away);
        assert_eq!(bed.jumped(0), step == 1050);
        let apart = tip(&mut bed, 0).distance(tip(&mut always, 0));
        match step {
            599 => assert_eq!(apart, 0.0),
            1049 => assert!(apart > 0.05, "it missed nothing: {apart}"),
            // Seen again: where it would have been, nearly.
            1050.. => {
                let first = *seen_after.get_or_insert(apart);
                assert!(first < 0.03 && apart < 0.03, "{first} {apart} at {step}");
            }
            _ => {}
        }
    }
}

/// What a plant makes of one step under a wind sea, bit for bit, seen from `eye` with an A_min [px].
fn after_a_step(mut bed: Bed, eye: DVec3, sea: &[Wave], threshold: f64) -> Vec<u32> {
    let camera = camera(eye, bed.plants()[0].root);
    bed.step(&around(&[], sea, &camera), &Levels { trains: true, threshold, ..Levels::none() });
    bed.save().joints.iter().map(|value| value.to_bits()).collect()
}

/// All trains of a wind sea at some time.
fn wind_sea() -> Vec<Wave> {
    sea(6.0, 30).iter().map(|train| train.at(3.0)).collect()
}

#[test]
fn trains_that_nobody_sees_the_work_of_are_left_out_far_away() {
    let sea = wind_sea();
    let from = |distance: f64, threshold: f64| {
        let eye = PLACE + DVec3::new(0.0, 0.5, distance);
        after_a_step(alone(usual_blade()), eye, &sea, threshold)
    };
    assert_eq!(from(2.0, 0.5), from(2.0, 0.0));
    assert_ne!(from(60.0, 0.5), from(60.0, 0.0));
}

#[test]
fn trains_count_by_what_they_move_and_not_by_their_place_in_the_list() {
    let sea = wind_sea();
    let reversed: Vec<Wave> = sea.iter().rev().copied().collect();
    let from_afar =
        |sea: &[Wave]| after_a_step(alone(usual_blade()), PLACE + DVec3::new(0.0, 0.5, 60.0), sea, 0.5);
    assert_eq!(from_afar(&sea), from_afar(&reversed));
}

#[test]
fn a_plant_that_bends_out_of_its_cell_gets_the_trains_that_it_needs() {
    // Rooted just inside of a cell of 16 m, eight metres long, and bent over toward an eye that its tip
    // comes near.
    let long = Segment { length: 0.8, ..Segment::default() };
    let mut segments = blade(10, 0.0, long);
    segments[0].phi = core::f64::consts::FRAC_PI_2;
    let root = DVec3::new(0.3, -3.0, 7.9);
    // A calm sea, whose least trains nobody sees from a few metres.
    let sea = wind_sea().into_iter().map(|wave| Wave { amplitude: 0.02 * wave.amplitude, ..wave });
    let sea: Vec<Wave> = sea.collect();
    let from = |size: f64, distance: f64, threshold: f64| {
        let bed = Bed::new(vec![kind(skeleton(&segments))], vec![Plant { size, ..plant(root) }]);
        after_a_step(bed, root + DVec3::Z * distance, &sea, threshold)
    };
    for size in [1.0, 3.5] {
        let near = 8.6 * size;
        assert_eq!(from(size, near, 0.5), from(size, near, 0.0), "of size {size}");
    }
    // What nobody sees of it from farther away is left out.
    assert_ne!(from(1.0, 60.0, 0.5), from(1.0, 60.0, 0.0));
}
