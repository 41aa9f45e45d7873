//! Where sunlight falls and how it changes, in pictures.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use reef_gpu::Picture;
use reef_streams::{
    Outputs,
    environment::{Environment, Rock, Sun, Terrain},
};

use super::{
    Quality, Settings, Shot,
    device_tests::{keep, open},
    sample,
};
use crate::Studio;

const SIZE: (u32, u32) = (320, 180);

#[test]
fn sunlight_lies_on_a_rocks_sunny_side_and_not_on_the_other() {
    let Some(gpu) = open() else { return };
    let Some(bed) = sample::environment().terrain else { return };
    let rock = Rock { position: [0.0, -3.7, 0.0], half_axes: [0.8, 0.9, 0.8], yaw: 0.4, seed: 7 };
    let terrain = Some(Arc::new(Terrain { rocks: vec![rock], ..Terrain::clone(&bed) }));
    let under = |color: [f32; 3]| {
        let direction = Vec3::new(1.0, 0.5, 0.0).normalize();
        let sun = Sun { color, direction, ..sample::environment().sun };
        Environment { sun, terrain: terrain.clone(), ..sample::environment() }
    };
    let (lit, dark) = (under([2.0; 3]), under([0.0; 3]));
    let mut studio = Studio::new(&gpu, SIZE).expect("a studio");
    for quality in [Quality::Low, Quality::High] {
        let settings = Settings { shafts: false, ..Settings::of(quality) };
        // How much light the sun adds to the middle of the picture at most, in steps of 8 bits.
        let mut added = |x: f64| {
            let camera = sample::looking_at(DVec3::new(x, -3.6, 0.0), DVec3::new(0.0, -3.6, 0.0));
            let frame = sample::frame(90, camera, Outputs::default());
            let [with, without] = [&lit, &dark].map(|environment| {
                let shot = Shot { previous: &frame, current: &frame, alpha: 1.0, camera, environment };
                studio.shoot(&shot, &settings).expect("a picture")
            });
            keep(&format!("rock-{x}-{quality:?}"), &with);
            middle(&with).zip(middle(&without)).map(|(a, b)| a.abs_diff(b)).max().unwrap_or(0)
        };
        let [sunny, other] = [2.6, -2.6].map(&mut added);
        assert!(sunny > 60, "{quality:?}: {sunny} on the sunny side");
        assert!(other <= 1, "{quality:?}: {other} on the other side");
    }
    drop(studio);
    assert_eq!(gpu.close(), Vec::<String>::new());
}

/// The bytes of the middle of a picture, an eighth as wide and a quarter as high.
fn middle(picture: &Picture) -> impl Iterator<Item = u8> {
    let columns = SIZE.0 * 7 / 16..SIZE.0 * 9 / 16;
    let rows = SIZE.1 * 3 / 8..SIZE.1 * 5 / 8;
    let pixels = rows.flat_map(move |y| columns.clone().map(move |x| (x, y)));
    pixels.filter_map(|(x, y)| picture.pixel(x, y)).flatten()
}

#[test]
fn shafts_of_light_wax_and_wane_over_seconds_without_flicker() {
    let Some(gpu) = open() else { return };
    let environment = Environment { terrain: None, ..sample::environment() };
    let camera = sample::looking_at(DVec3::new(0.0, -3.3, 4.0), DVec3::new(0.0, -2.6, 0.0));
    let mut studio = Studio::new(&gpu, SIZE).expect("a studio");
    // What the shafts add to each byte of the picture of a step.
    let mut added = |step: u64| -> Vec<i16> {
        let frame = sample::frame(step, camera, Outputs::default());
        let shot = Shot { previous: &frame, current: &frame, alpha: 1.0, camera, environment: &environment };
        let [with, without] = [true, false].map(|shafts| {
            studio.shoot(&shot, &Settings { shafts, ..Settings::default() }).expect("a picture")
        });
        keep(&format!("shafts-{step}"), &with);
        with.rgba.iter().zip(&without.rgba).map(|(a, b)| i16::from(*a) - i16::from(*b)).collect()
    };
    let most = |a: &[i16], b: &[i16]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).max().unwrap_or(0);
    let (first, next) = (added(60), added(61));
    // Both pictures of a difference are rounded, and the surface behind the shafts moves.
    assert!(most(&first, &next) <= 2, "{} from one picture to the next", most(&first, &next));
    let mut last = first.clone();
    let mut range = 0;
    for step in (72..=300).step_by(12) {
        let now = added(step);
        assert!(most(&last, &now) <= 3, "{} in a fifth of a second", most(&last, &now));
        range = range.max(most(&first, &now));
        last = now;
    }
    assert!(range >= 8, "{range} in four seconds");
    drop(studio);
    assert_eq!(gpu.close(), Vec::<String>::new());
}
