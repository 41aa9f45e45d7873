//! Walks through levels of detail: nothing pops.
//!
//! Suspended particles: the mean brightness of the
//! picture changes by less than 1 % from frame to frame at 1 m/s, where fog becomes particles, where masters
//! and slaves part, and at the box's face.
//!
//! Seaweeds: no part of the picture changes much more from one frame to the next than it does in most frames,
//! where plants leave being moved as a whole, and where their upper halves begin to move.

use std::{fs, path::PathBuf};

use reef_render::pictures::read_png;
use reef_tests::artifacts::workspace;

use crate::{lacking, reef, told};

/// Frames a second: 1/30 m each.
const RATE: &str = "30";
/// Frames at each border.
const FRAMES: usize = 24;
/// When the walk of `particles-lod-walk` comes to a border [s]: the box begins 18 m ahead of its beginning.
const BORDERS: [(&str, &str); 4] = [
    ("12 m before the box, where the fog begins to part", "5.6"),
    ("in the middle of that", "9.6"),
    ("2 m before the box, where each particle rides by itself", "15.6"),
    ("the face of the box", "17.6"),
];

#[test]
fn a_walk_through_all_levels_of_detail_does_not_pop() {
    let assets = workspace().join("assets");
    for (border, from) in BORDERS {
        let folder = tempfile::tempdir().unwrap();
        let frames = folder.path().join("frames");
        let count = FRAMES.to_string();
        let arguments = ["render", "particles-lod-walk", "--from", from, "--frames", &count, "--fps", RATE];
        let out = ["--size", "192x108", "--out", frames.to_str().unwrap()];
        let output = reef(&assets, &[&arguments[..], &out[..]].concat(), None);
        if lacking(&output) {
            return;
        }
        assert!(output.status.success(), "{}", told(&output));
        let mut paths: Vec<_> = fs::read_dir(&frames).unwrap().map(|entry| entry.unwrap().path()).collect();
        paths.sort();
        assert_eq!(paths.len(), FRAMES);
        let brightness: Vec<f64> = paths
            .iter()
            .map(|path| {
                let picture = read_png(path).unwrap();
                let colors = picture.rgba.chunks_exact(4).flat_map(|pixel| &pixel[..3]);
                colors.map(|v| f64::from(*v)).sum::<f64>() / f64::from(picture.width * picture.height * 3)
            })
            .collect();
        assert!(brightness[0] > 20.0, "{border}: the picture is black");
        for (i, pair) in brightness.windows(2).enumerate() {
            let change = (pair[1] / pair[0] - 1.0).abs();
            assert!(change < 0.01, "{border}: frame {i} to the next changes by {:.2} %", change * 100.0);
        }
    }
}

/// The walk of `seaweed-lod-walk` without what else moves in its picture: ground, waves, caustics.
const KELPS: &str = r#"
[scene]
name = "Kelps"
seed = 13
[camera]
fov = 55.0
position = { interpolation = "linear", keys = [
  { time = 0, value = [0.3, -5.2, 26.0] }, { time = 24, value = [0.3, -5.2, 2.0] },
] }
look_at = { interpolation = "linear", keys = [
  { time = 0, value = [0.0, -5.3, 16.0] }, { time = 24, value = [0.0, -5.3, -8.0] },
] }
[water]
depth = 60.0
[water.optics]
beam = [0.02, 0.02, 0.02]
downwelling = [0.01, 0.01, 0.01]
scattered = [0.05, 0.05, 0.06]
[light]
shafts = 0.0
[[flow]]
name = "current"
kind = "directional"
direction = [1.0, 0.0, 0.1]
speed = 0.3
[modules.kelp]
use = "reef.seaweed"
"#;

/// Edge of a part of the picture [px].
const PART: usize = 8;
/// Size of a picture [px].
const KELP_SIZE: [usize; 2] = [256, 144];

/// The greatest change of a part's brightness from one frame to the next, less that part's median change.
fn worst_change(parameters: &str, from: &str, frames: usize) -> Option<f64> {
    let folder = tempfile::tempdir().unwrap();
    let plants: Vec<String> = (0..18)
        .map(|i| {
            let (x, z, scale) =
                (-2.6 + 0.31 * f64::from(i), -0.6 * f64::from(i * 7 % 5), 0.6 + 0.05 * f64::from(i % 5));
            let yaw = 40 * i % 360;
            format!(
                "{{ species = \"saccharina\", position = [{x}, -6.5, {z}], scale = {scale}, yaw = {yaw}.0, seed = {i} }}"
            )
        })
        .collect();
    let scene = folder.path().join("kelps.toml");
    let text = format!("{KELPS}params = {{ {parameters} }}\nplants = [{}]\n", plants.join(", "));
    fs::write(&scene, text).unwrap();
    let pictures = folder.path().join("frames");
    let [width, height] = KELP_SIZE;
    let (count, size) = (frames.to_string(), format!("{width}x{height}"));
    let arguments = ["render", scene.to_str().unwrap(), "--from", from, "--frames", &count, "--fps", RATE];
    let out = ["--size", &size, "--out", pictures.to_str().unwrap()];
    let output = reef(&workspace().join("assets"), &[&arguments[..], &out[..]].concat(), None);
    if lacking(&output) {
        return None;
    }
    assert!(output.status.success(), "{}", told(&output));
    let mut paths: Vec<_> = fs::read_dir(&pictures).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    assert_eq!(paths.len(), frames);
    let grey = |path: &PathBuf| -> Vec<f64> {
        let of = |pixel: &[u8]| pixel[..3].iter().map(|v| f64::from(*v)).sum::<f64>() / 3.0;
        read_png(path).unwrap().rgba.chunks_exact(4).map(of).collect()
    };
    let shades: Vec<Vec<f64>> = paths.iter().map(grey).collect();
    let mut worst = 0.0_f64;
    for (row, column) in (0..height / PART).flat_map(|row| (0..width / PART).map(move |column| (row, column)))
    {
        let places = (0..PART * PART)
            .map(|i| (PART * row + i / PART) * width + PART * column + i % PART)
            .collect::<Vec<_>>();
        let change = |pair: &[Vec<f64>]| {
            places.iter().map(|at| (pair[1][*at] - pair[0][*at]).abs()).sum::<f64>() / places.len() as f64
        };
        let mut changes: Vec<f64> = shades.windows(2).map(change).collect();
        changes.sort_by(f64::total_cmp);
        worst = worst.max(changes[changes.len() - 1] - changes[changes.len() / 2]);
    }
    Some(worst)
}

#[test]
fn a_walk_toward_kelps_does_not_pop_in_any_part_of_its_picture() {
    // From 20.8 m to 18.8 m before the first, and past 5 m before all of them.
    for (border, parameters, from, frames) in
        [("FD", "blend = 1.0", "5.2", 60), ("ND", "blend = 1.0", "18.0", 75)]
    {
        let Some(worst) = worst_change(parameters, from, frames) else { return };
        println!("{border}: {worst:.1}");
        assert!(worst < 7.0, "{border}: a part of the picture changes by {worst:.1} at once");
    }
    // A pop is seen: all of a plant at once, where it is near enough to be large.
    let Some(popped) = worst_change("near = 3.0, far = 6.0, blend = 0.0", "18.0", 75) else { return };
    println!("without going over: {popped:.1}");
    assert!(popped > 10.0, "{popped:.1}");
}
