//! Ground, rocks, what moves, and the surface.

use glam::DVec3;
use reef_sdk::abi::Obstacle;
use reef_seaweed_model::{
    bed::{Bed, Plant, Surroundings},
    levels::{Levels, Method},
    skeleton::Segment,
};

use crate::common::*;

fn settle(bed: &mut Bed, obstacles: &[Obstacle], water: DVec3, steps: usize, levels: &Levels) {
    let flow = [current(water)];
    let camera = camera(PLACE + DVec3::new(0.0, 0.5, 6.0), PLACE);
    for _ in 0..steps {
        bed.step(&Surroundings { obstacles, ..around(&flow, &[], &camera) }, levels);
    }
}

/// A plant that is too heavy to stand.
fn heavy() -> Vec<Segment> {
    blade(
        12,
        core::f64::consts::FRAC_PI_2,
        Segment { lift: -0.3, stiffness: 0.2, radius: 0.02, ..Segment::default() },
    )
}

#[test]
fn the_ground_holds_a_plant_that_lies_down() {
    let normal = DVec3::new(0.2, 1.0, 0.0).normalize();
    for method in [Method::Physical, Method::Procedural] {
        let lowest = |contact: f64| {
            let one = Plant { ground: Some(normal), ..plant(PLACE) };
            let mut bed = Bed::new(vec![kind(skeleton(&heavy()))], vec![one]);
            let levels = Levels { method, contact, ..Levels::none() };
            settle(&mut bed, &[], DVec3::new(0.1, 0.0, 0.02), 3000, &levels);
            let nodes = nodes(&mut bed, 0);
            let over = nodes.iter().skip(2).map(|node| normal.dot(*node - PLACE));
            (over.fold(f64::MAX, f64::min), nodes)
        };
        // The weight of a segment presses its end in by 0.3 N over 60 N/m, and less than twice that.
        let (held, _) = lowest(60.0);
        assert!(held > 0.0 && held < 0.02, "{method:?}: {held} m over the ground");
        let (through, _) = lowest(0.0);
        assert!(through < -0.1, "{method:?}: without contact {through} m");
    }
}

#[test]
fn a_rock_holds_what_the_current_presses_against_it() {
    // Upright, 0.3 m downstream of the root.
    let rock = Obstacle {
        id: 9,
        from: (PLACE + DVec3::new(0.3, -1.0, 0.0)).to_array(),
        delta: [0.0, 4.0, 0.0],
        radius: 0.15,
    };
    let segments = blade(10, core::f64::consts::FRAC_PI_2, Segment { radius: 0.02, ..Segment::default() });
    for method in [Method::Physical, Method::Procedural] {
        let deepest = |rocks: &[Obstacle]| {
            let mut bed = alone(skeleton(&segments));
            settle(&mut bed, rocks, DVec3::new(0.2, 0.0, 0.0), 2400, &Levels { method, ..Levels::none() });
            let axis = PLACE + DVec3::new(0.3, 0.0, 0.0);
            let off = |node: DVec3| (node.x - axis.x).hypot(node.z - axis.z);
            nodes(&mut bed, 0).into_iter().map(off).fold(f64::MAX, f64::min)
        };
        let (held, free) = (deepest(&[rock]), deepest(&[]));
        assert!(free < 0.1, "{method:?}: it does not go there: {free}");
        // Surfaces meet at 0.17 m; a segment's share of the drag presses by some millimetres.
        assert!(held > 0.15, "{method:?}: {held}");
    }
}

#[test]
fn something_that_passes_pushes_a_plant_aside_and_lets_it_go() {
    let mut bed = alone(skeleton(&blade(
        10,
        core::f64::consts::FRAC_PI_2,
        Segment { radius: 0.02, ..Segment::default() },
    )));
    let camera = camera(PLACE + DVec3::new(0.0, 0.5, 4.0), PLACE);
    let (mut farthest, levels): (f64, _) = (0.0, Levels::none());
    let before = tip(&mut bed, 0);
    for step in 0..900 {
        let x = -0.6 + 0.4 * f64::from(step) * DT;
        let swimmer = Obstacle {
            id: 5,
            from: (PLACE + DVec3::new(x, 0.7, -0.3)).to_array(),
            delta: [0.0, 0.0, 0.6],
            radius: 0.1,
        };
        bed.step(&Surroundings { obstacles: &[swimmer], ..around(&[], &[], &camera) }, &levels);
        farthest = farthest.max(tip(&mut bed, 0).distance(before));
    }
    assert!(farthest > 0.1, "{farthest}");
    let back = tip(&mut bed, 0).distance(before);
    assert!(back < 0.02, "{back}");
}

#[test]
fn bladders_lift_a_plant_to_the_surface_and_not_out_of_it() {
    // Longer than the water is deep, heavy but for its bladders.
    let like = Segment {
        length: 1.0,
        stiffness: 0.5,
        lift: -1.0,
        mass: 0.5,
        carried: 0.5,
        drag: 4.0,
        weight: 3.0,
        ..Segment::default()
    };
    let mut segments = blade(15, core::f64::consts::FRAC_PI_2, like);
    let top = |segments: &[Segment], waves: f64| {
        let mut bed = alone(skeleton(segments));
        let camera = camera(DVec3::new(0.0, -4.0, 12.0), DVec3::new(0.0, -5.0, 0.0));
        let flow = [current(DVec3::new(0.1, 0.0, 0.0))];
        let mut highest: f64 = -100.0;
        for step in 0..4800 {
            let wave = [swell(waves, 8.0, f64::from(step) * DT)];
            bed.step(&around(&flow, if waves > 0.0 { &wave } else { &[] }, &camera), &Levels::none());
            if step > 3000 {
                highest = nodes(&mut bed, 0).iter().map(|node| node.y).fold(highest, f64::max);
            }
        }
        (highest, nodes(&mut bed, 0))
    };
    let (without, _) = top(&segments, 0.0);
    assert!(without < -3.0, "{without}");
    segments.iter_mut().for_each(|segment| segment.lift = 0.4);
    let (highest, nodes) = top(&segments, 0.0);
    assert!((-0.3..0.1).contains(&highest), "{highest}");
    // The canopy: more than one node lies just under the surface, downstream.
    let canopy: Vec<_> = nodes.iter().filter(|node| node.y > -0.6).collect();
    assert!(canopy.len() >= 3 && canopy.iter().all(|node| node.x > PLACE.x + 1.0), "{nodes:?}");
    let (highest, _) = top(&segments, 0.5);
    assert!((0.1..0.8).contains(&highest), "on the waves: {highest}");
}
