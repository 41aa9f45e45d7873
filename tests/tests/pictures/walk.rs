//! A walk through the levels of detail of suspended particles: nothing pops. The mean brightness of the
//! picture changes by less than 1 % from frame to frame at 1 m/s, where fog becomes particles, where masters
//! and slaves part, and at the box's face.

use std::fs;

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
