//! How far it swims.

use reef_flow::Level;
use reef_jellyfish_model::slice::{Build, Gait};

use crate::slice::slice;

/// How far it gets [m].
fn travel(n: usize, frequency: f64, dt: f64, seconds: f64, follows: bool) -> f64 {
    let mut slice = slice::<f32>(Build::default(), n, Gait { frequency, ..Gait::default() });
    slice.follow(follows);
    let start = slice.place();
    for _ in 0..(seconds / dt).round() as usize {
        slice.step(Level::best(), dt);
    }
    (slice.place() - start).y
}

/// Eddies make each single run a matter of chance, by a tenth and more: the mean over twelve frequencies.
fn mean(n: usize, dt: f64, follows: bool) -> f64 {
    let frequency = |k: u32| 0.525 + 0.025 * f64::from(k);
    (0..12).map(|k| travel(n, frequency(k), dt, 8.0, follows)).sum::<f64>() / 12.0
}

#[test]
fn it_swims_farthest_near_its_own_frequency() {
    let way = [0.4, 0.7, 1.0, 1.5, 2.0].map(|frequency| travel(100, frequency, 0.005, 20.0, true));
    println!("{way:?}");
    assert!(way[1] > 0.2 && way[1] > way[0] && way[1] > way[4], "{way:?}");
}

#[test]
fn two_steps_a_frame_swim_nearly_as_far_as_shorter_ones() {
    // They lose a tenth (the mean of twelve is itself uncertain by some hundredths).
    let (short, long) = (mean(100, 0.005, true), mean(100, 1.0 / 120.0, true));
    println!("{short} {long}");
    assert!((long / short - 1.0).abs() < 0.15, "{short} {long}");
}

#[test]
fn a_window_that_follows_is_as_good_as_a_tall_tank() {
    let (window, tank) = (mean(100, 1.0 / 120.0, true), mean(200, 1.0 / 120.0, false));
    println!("{window} {tank}");
    assert!((window / tank - 1.0).abs() < 0.15, "{window} {tank}");
}
