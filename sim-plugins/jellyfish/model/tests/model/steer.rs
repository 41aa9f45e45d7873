//! Turning, idling, sinking and rising.

use glam::DVec2;
use reef_flow::Level;
use reef_jellyfish_model::slice::{Build, Gait, Slice};

use crate::slice::slice;

const DT: f64 = 1.0 / 120.0;

/// Degrees to the right after some seconds of turning.
fn turned(turn: f64, seconds: f64) -> f64 {
    let build = Build { righting: 0.0, ..Build::default() };
    let mut slice = slice::<f64>(build, 100, Gait { turn, ..Gait::default() });
    for _ in 0..(seconds / DT) as usize {
        slice.step(Level::best(), DT);
    }
    slice.axis().angle_to(DVec2::Y).to_degrees()
}

#[test]
fn an_uneven_contraction_turns_it_to_its_side() {
    let (right, left) = (turned(0.05, 4.0), turned(-0.05, 4.0));
    println!("{right} {left}");
    assert!(right > 30.0, "{right}");
    // The mirrored animal does the mirrored thing, as long as eddies have not made rounding grow.
    assert!((turned(0.05, 2.0) + turned(-0.05, 2.0)).abs() < 1e-3 && left < -30.0, "{right} {left}");
}

#[test]
fn it_swims_where_it_is_steered() {
    for aim in [DVec2::new(1.0, 1.0), DVec2::new(-1.0, 0.0)] {
        let mut slice: Slice<f64> = slice(Build::default(), 100, Gait::default());
        let steps = (16.0 / DT) as usize;
        let mut half = slice.place();
        for step in 0..steps {
            if step == steps / 2 {
                half = slice.place();
            }
            slice.steer(aim);
            slice.step(Level::best(), DT);
        }
        let way = slice.place() - half;
        let cos = way.normalize().dot(aim.normalize());
        println!("{aim}: {way}, {cos}");
        assert!(way.length() > 0.03 && cos > 0.8, "{aim}: {way}, {cos}");
    }
}

#[test]
fn an_idle_animal_sinks_or_rises_by_its_weight() {
    let way = |weight: f64| {
        let build = Build { weight, ..Build::default() };
        let mut slice = slice::<f64>(build, 50, Gait { strength: 0.0, ..Gait::default() });
        let start = slice.place();
        for _ in 0..480 {
            slice.step(Level::best(), DT);
        }
        (slice.place() - start).y
    };
    let ways = [way(0.05), way(0.0), way(-0.05)];
    println!("{ways:?}");
    assert!(ways[0] < -0.01 && ways[1].abs() < 1e-9 && ways[2] > 0.01, "{ways:?}");
}

#[test]
fn less_strength_swims_less_far() {
    let way = |strength: f64| {
        let mut slice = slice::<f64>(Build::default(), 100, Gait { strength, ..Gait::default() });
        let start = slice.place();
        for _ in 0..960 {
            slice.step(Level::best(), DT);
        }
        (slice.place() - start).y
    };
    let ways = [way(1.0), way(0.4)];
    println!("{ways:?}");
    assert!(ways[1] < 0.7 * ways[0], "{ways:?}");
}
