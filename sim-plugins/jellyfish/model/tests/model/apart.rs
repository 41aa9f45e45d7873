//! Animals that see each other keep apart.

use glam::DVec3;
use reef_jellyfish_model::{
    bloom::{Birth, Bloom, Home, Surroundings, Tuning},
    species::Species,
};

use crate::sea::{birth, usual};

const DT: f64 = 1.0 / 60.0;
/// Width of the paper's bell [m]: two of them touch at this distance.
const WIDTH: f64 = 0.04;

fn around(apart: f64) -> Surroundings<'static> {
    Surroundings {
        tuning: Tuning { apart, ..Tuning::default() },
        eye: DVec3::splat(1e3),
        ..Surroundings::default()
    }
}

/// Least distance of two that swim at each other, over their width; and the fastest turn of one [rad/s].
fn meet(apart: f64) -> (f64, f32) {
    let toward = |number: u64, x: f64| Birth {
        place: DVec3::new(x, -3.0, 0.0),
        yaw: 0.0,
        aim: DVec3::new(-x, 0.02, 0.0),
        ..birth(number)
    };
    let mut bloom = Bloom::new(&[usual()], &[toward(0, -0.08), toward(1, 0.08)]).expect("a bloom");
    let (mut least, mut fastest) = (f64::MAX, 0.0_f32);
    let axis = |bloom: &Bloom, i: usize| bloom.seen(i).expect("an animal").axis;
    for _ in 0..40 * 60 {
        let before = [axis(&bloom, 0), axis(&bloom, 1)];
        bloom.step(&around(apart));
        for (i, before) in before.into_iter().enumerate() {
            fastest = fastest.max(before.angle_between(axis(&bloom, i)) / DT as f32);
        }
        let [a, b] = [0, 1].map(|i| bloom.place(i).expect("a place"));
        least = least.min(a.distance(b) / WIDTH);
    }
    (least, fastest)
}

#[test]
fn two_on_a_collision_course_pass_each_other() {
    let ((through, freely), (beside, turning)) = (meet(0.0), meet(1.0));
    println!("{through} at {freely} rad/s, {beside} at {turning} rad/s");
    assert!(through < 0.7 && beside > 0.85, "{through} {beside}");
    // What bends the bell to steer is what bends it to turn aside.
    assert!(turning < 1.5 * freely, "{freely} {turning}");
}

/// Seconds for which pairs of a crowd were nearer than nine tenths of their width, all together, and the
/// longest time on end.
fn crowd(apart: f64) -> (f64, f64) {
    const COUNT: usize = 64;
    let mut species: Species = usual();
    (species.grid.cells, species.bell.excess_density) = (32, 1.0);
    let (low, high) = (DVec3::new(-0.2, -3.2, -0.2), DVec3::new(0.2, -2.8, 0.2));
    let even = reef_flow::random::Even::new(5);
    let births: Vec<Birth> = (0..COUNT as u32)
        .map(|i| Birth {
            place: even.place(i, low.to_array(), high.to_array()).into(),
            home: Some(Home { low, high }),
            ..birth(i.into())
        })
        .collect();
    let mut bloom = Bloom::new(&[species], &births).expect("a bloom");
    let mut times = vec![0.0; COUNT * COUNT];
    let (mut all, mut longest) = (0.0, 0.0_f64);
    for _ in 0..120 * 60 {
        let mut around = around(apart);
        // One step of the slice a frame.
        around.tuning.detail = 1e9;
        bloom.step(&around);
        let places: Vec<DVec3> = (0..COUNT).map(|i| bloom.place(i).expect("a place")).collect();
        for (i, j) in (0..COUNT).flat_map(|i| (0..i).map(move |j| (i, j))) {
            let time: &mut f64 = &mut times[i * COUNT + j];
            *time = if places[i].distance(places[j]) < 0.9 * WIDTH { *time + DT } else { 0.0 };
            all += if *time > 0.0 { DT } else { 0.0 };
            longest = longest.max(*time);
        }
    }
    (all, longest)
}

#[test]
fn a_crowd_of_64_overlaps_only_for_a_moment() {
    let (free, apart) = (crowd(0.0), crowd(1.0));
    println!("{free:?} {apart:?}");
    assert!(free.1 > 4.0 && apart.1 < 1.0 && apart.0 < 0.05 * free.0, "{free:?} {apart:?}");
}
