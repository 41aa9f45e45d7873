//! Directional fields (Aliaga & Larboulette 2009, eq. 5) in their four forms, and shelters.

use reef_abi::Flow;
use reef_flow::{Level, Packed};

use crate::common::{self, at, difference, directional, shelter, velocities};

const ALONG: [f32; 3] = [0.6, 0.0, -0.8];

fn along(speed: f32) -> [f32; 3] {
    ALONG.map(|c| c * speed)
}

/// Rounding of a speed near 0.3 m/s through a sine of absolute error 1e-7.
const ROUNDING: f32 = 2e-7;

#[test]
fn a_constant_current_is_the_same_everywhere() {
    let field = [directional(ALONG, 0.3)];
    for point in [[0.0; 3], [1.0, 2.0, 3.0], [-1e6, 0.1, 9e9]] {
        assert!(difference(at(&field, point), along(0.3)) <= 3e-8, "the sum's f64 rounded once");
        assert_eq!(at(&field, point), at(&field, [0.0; 3]));
    }
}

#[test]
fn a_current_can_swing_in_time() {
    for phase in [0.0_f32, 1.0, 2.5, 4.0, 6.2] {
        let field = [Flow { modulation: 0.4, phase, ..directional(ALONG, 0.3) }];
        let speed = 0.3 * (0.6 + 0.4 * phase.sin());
        assert!(difference(at(&field, [5.0, 1.0, 2.0]), along(speed)) <= ROUNDING, "{phase}");
    }
}

#[test]
fn a_current_can_travel_as_a_wave() {
    let wave_vector = [2.0, 0.0, 1.5];
    let field = [Flow { modulation: 1.0, phase: 0.3, wave_vector, ..directional(ALONG, 0.3) }];
    for i in 0..200 {
        let x = i as f32 * 0.05 - 5.0;
        let speed = 0.3 * f64::from(0.3 + 2.0 * x).sin();
        // The argument of up to 10 rad is an f32: 5e-7 rad.
        assert!(difference(at(&field, [x, 0.2, 0.0]), along(speed as f32)) <= 0.3 * 1e-6 + ROUNDING, "{x}");
    }
    // Crests are where k·p + phase is the same: along the crest nothing changes.
    let crest = at(&field, [1.5, 0.0, -2.0]);
    assert!(difference(crest, at(&field, [0.0; 3])) <= 0.3 * 1e-6);
}

#[test]
fn a_wave_is_the_same_for_objects_with_different_origins() {
    let field =
        [Flow { modulation: 1.0, phase: 0.3, wave_vector: [2.0, 0.5, 1.5], ..directional(ALONG, 0.3) }];
    let mut packed = Packed::new();
    packed.fill(&field, [1000.0, -5.0, 2000.0], 0);
    let near = velocities(Level::best(), &packed, &[[0.25, 0.5, 0.125]])[0];
    packed.fill(&field, [1000.25, -4.5, 2000.125], 0);
    let at_origin = velocities(Level::best(), &packed, &[[0.0; 3]])[0];
    assert!(difference(near, at_origin) <= 0.3 * 1e-6);
}

#[test]
fn a_current_can_grow_with_height_and_never_turns_round() {
    let field = [Flow { gradient: 0.5, level: -10.0, ..directional(ALONG, 0.3) }];
    for (y, factor) in [(-10.0, 1.0), (-9.0, 1.5), (-11.0, 0.5), (-12.0, 0.0), (-30.0, 0.0)] {
        assert!(difference(at(&field, [3.0, y, 1.0]), along(0.3 * factor)) <= ROUNDING, "{y}");
    }
}

#[test]
fn all_forms_act_together() {
    let wave_vector = [2.0, 0.0, 1.5];
    let field = [Flow {
        modulation: 0.7,
        phase: 1.1,
        wave_vector,
        gradient: -0.25,
        level: 1.0,
        ..directional(ALONG, 0.3)
    }];
    let speed = 0.3 * (0.3 + 0.7 * (1.1_f64 + 0.8 - 0.9).sin()) * (1.0 - 0.25 * (3.0 - 1.0));
    assert!(difference(at(&field, [0.4, 3.0, -0.6]), along(speed as f32)) <= ROUNDING);
}

#[test]
fn a_shelter_calms_all_that_acts_in_it_and_nothing_beyond() {
    let current = directional(ALONG, 0.3);
    let whirl = common::whirlwind([0.0, 0.0, 3.0], [0.0, 1.0, 0.0], 0.5, 1.0);
    let lee = shelter([0.0; 3], 0.75, 2.0, 0.5);
    let calm = |p| at(&[lee, current, whirl], p);
    let open = |p| at(&[current, whirl], p);
    for p in [[0.0; 3], [0.5, 0.5, 0.5], [0.0, 0.0, 0.99]] {
        assert!(difference(calm(p), open(p).map(|c| c * 0.25)) <= ROUNDING, "{p:?}");
    }
    for p in [[2.001, 0.0, 0.0], [0.0, -5.0, 0.0]] {
        assert_eq!(calm(p), open(p));
    }
    let mut last = 0.0;
    for i in 0..=100 {
        let p = [1.0 + i as f32 * 0.01, 0.0, 0.0];
        let share = common::length(calm(p)) / common::length(open(p));
        assert!(share >= last - 1e-6 && share - last <= 0.25 + 0.02, "monotone and smooth at {p:?}");
        last = share;
    }
}
