//! A texture brought to a size, with its smaller levels. Texels hold linear light times coverage, so that
//! neither blending nor making them smaller leaves a dark or bright fringe.

use reef_streams::textures::Texture;

use crate::sprites::linear;

/// A texture's levels, largest first: four floats a texel.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Levels(pub(super) Vec<Vec<[f32; 4]>>);

impl Levels {
    /// `side`: texels along a side, a power of two. `around`: its left and right edges join.
    pub(super) fn of(texture: &Texture, side: usize, around: bool) -> Self {
        let whole = texture.texels.chunks_exact(4).map(|t| covered(t, texture.srgb)).collect::<Vec<_>>();
        let (width, height) = (texture.width as usize, texture.height as usize);
        Self::below(resampled(whole, [width, height], side, around), side)
    }

    /// Texture 0: white, opaque in the middle, gone with its slope at the edge.
    pub(super) fn dot(side: usize) -> Self {
        let texel = |i: usize| {
            let place = |n: usize| (n as f32 + 0.5) / side as f32 * 2.0 - 1.0;
            let r = place(i % side).hypot(place(i / side)).min(1.0);
            let fall = (1.0 - r * r) * (1.0 - r * r);
            [fall; 4]
        };
        Self::below((0..side * side).map(texel).collect(), side)
    }

    /// The smaller levels under the first. A texel is the mean of the four above it, which no edge cuts.
    fn below(first: Vec<[f32; 4]>, mut side: usize) -> Self {
        let mut levels = vec![first];
        while side > 1 {
            let above = &levels[levels.len() - 1];
            let wide = side;
            side /= 2;
            let mut level = Vec::with_capacity(side * side);
            for i in 0..side * side {
                let (x, y) = (i % side * 2, i / side * 2);
                let mean = |c: usize| {
                    let four = [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)];
                    four.iter().map(|&(x, y)| above[y * wide + x][c]).sum::<f32>() * 0.25
                };
                level.push([mean(0), mean(1), mean(2), mean(3)]);
            }
            levels.push(level);
        }
        Self(levels)
    }

    /// What is left of it from far away.
    pub(super) fn mean(&self) -> [f32; 4] {
        self.0.last().and_then(|level| level.first()).copied().unwrap_or_default()
    }

    /// Four bytes a texel, level after level. `curved`: red, green and blue by sRGB's curve.
    pub(super) fn bytes(&self, curved: bool) -> Vec<Vec<u8>> {
        let eight = |v: f32| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
        let color = |v: f32| eight(if curved { encoded(v) } else { v });
        let bytes = |[r, g, b, a]: [f32; 4]| [color(r), color(g), color(b), eight(a)];
        self.0.iter().map(|level| level.iter().flat_map(|texel| bytes(*texel)).collect()).collect()
    }
}

/// sRGB of linear light.
fn encoded(v: f32) -> f32 {
    if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 }
}

/// Linear light times coverage of a texel of four bytes with straight alpha.
fn covered(texel: &[u8], srgb: bool) -> [f32; 4] {
    let alpha = f32::from(texel[3]) / 255.0;
    let light = |byte: u8| if srgb { linear(byte) } else { f32::from(byte) / 255.0 } * alpha;
    [light(texel[0]), light(texel[1]), light(texel[2]), alpha]
}

/// A picture of any size at another: rows, then columns, each by a tent as wide as the coarser of both grids.
fn resampled(texels: Vec<[f32; 4]>, [width, height]: [usize; 2], side: usize, around: bool) -> Vec<[f32; 4]> {
    if [width, height] == [side; 2] {
        return texels;
    }
    let wide = along(&texels, [width, height], (side, around), |x, y| y * width + x);
    // `wide` holds column after column.
    along(&wide, [height, side], (side, false), |y, x| x * height + y)
}

/// Resamples `lines` lines of `length` texels; `at(i, line)` says where a texel lies. The result holds, for
/// each of the `side` new places, one texel of every line, place after place. `around`: behind a line's end
/// comes its beginning; else the last texel goes on.
fn along(
    texels: &[[f32; 4]],
    [length, lines]: [usize; 2],
    (side, around): (usize, bool),
    at: impl Fn(usize, usize) -> usize,
) -> Vec<[f32; 4]> {
    let scale = length as f32 / side as f32;
    let reach = scale.max(1.0);
    let there = |i: isize| {
        let length = length as isize;
        (if around { i.rem_euclid(length) } else { i.clamp(0, length - 1) }) as usize
    };
    let mut out = Vec::with_capacity(side * lines);
    for place in 0..side {
        let center = (place as f32 + 0.5) * scale - 0.5;
        let first = (center - reach).ceil() as isize;
        let last = (center + reach).floor() as isize;
        for line in 0..lines {
            let (mut sum, mut weights) = ([0.0_f32; 4], 0.0);
            for i in first..=last {
                let weight = (1.0 - (i as f32 - center).abs() / reach).max(0.0);
                let texel = texels[at(there(i), line)];
                sum.iter_mut().zip(texel).for_each(|(sum, v)| *sum += v * weight);
                weights += weight;
            }
            out.push(sum.map(|v| v / weights.max(1e-6)));
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: usize = 64;

    fn texture(width: u32, height: u32, texel: impl Fn(u32, u32) -> [u8; 4]) -> Texture {
        let texels = (0..width * height).flat_map(|i| texel(i % width, i / width)).collect();
        Texture { id: 1, name: "test".into(), width, height, srgb: false, texels, hash: [0; 32] }
    }

    #[test]
    fn a_texture_of_the_size_is_taken_as_it_is_and_its_mean_is_its_last_level() {
        let halves = texture(64, 64, |x, _| if x < 32 { [255, 0, 0, 255] } else { [0, 255, 0, 0] });
        let levels = Levels::of(&halves, SIDE, false);
        assert_eq!(levels.0.len(), 7);
        assert_eq!((levels.0[0][0], levels.0[0][63]), ([1.0, 0.0, 0.0, 1.0], [0.0; 4]));
        // What is not covered gives no colour: no green comes into the mean.
        assert_eq!(levels.mean(), [0.5, 0.0, 0.0, 0.5]);
    }

    #[test]
    fn other_sizes_keep_orientation_and_mean() {
        for (width, height, side) in [(1, 1, 64), (16, 8, 64), (100, 200, 256), (1024, 3, 512)] {
            let ramps = texture(width, height, |x, y| {
                let ramp = |v: u32, n: u32| ((v * 2 + 1) * 255 / (n * 2)) as u8;
                [ramp(x, width), ramp(y, height), 0, 255]
            });
            let levels = Levels::of(&ramps, side, false);
            let mean = levels.mean();
            // Rounding to eight bits, and the tent's hold of the outermost texels.
            assert!(
                (mean[0] - 0.5).abs() < 0.01 && (mean[1] - 0.5).abs() < 0.01,
                "{width}x{height}: {mean:?}"
            );
            assert!((mean[3] - 1.0).abs() < 1e-5);
            let at = |x: usize, y: usize| levels.0[0][y * side / 64 * side + x * side / 64];
            if width > 1 {
                assert!(at(60, 5)[0] > at(3, 5)[0] + 0.5, "x stays x");
            }
            if height > 1 {
                assert!(at(5, 60)[1] > at(5, 3)[1] + 0.5, "y stays y");
            }
        }
    }

    #[test]
    fn every_level_has_the_mean_of_linear_light_times_coverage() {
        // Bright where it is not there, sRGB: neither the curve nor what is hidden may come into a mean.
        let mut checks = texture(256, 256, |x, y| {
            if (x ^ y) & 1 == 0 { [188, 40, 120, 255] } else { [255, 255, 255, if x < 128 { 0 } else { 51 }] }
        });
        checks.srgb = true;
        let levels = Levels::of(&checks, 256, true);
        let half = |byte: u8, hidden: f32| 0.5 * linear(byte) + 0.5 * hidden;
        let expected = [half(188, 0.1), half(40, 0.1), half(120, 0.1), 0.55];
        for (number, level) in levels.0.iter().enumerate() {
            assert_eq!(level.len(), (256 >> number) * (256 >> number));
            for c in 0..4 {
                let mean = level.iter().map(|texel| texel[c]).sum::<f32>() / level.len() as f32;
                assert!((mean - expected[c]).abs() < 1e-4, "level {number}, channel {c}: {mean}");
            }
        }
    }

    #[test]
    fn a_texture_that_goes_around_keeps_its_slope_across_the_seam() {
        let wave =
            |x: u32, width: u32| 127.5 + 127.0 * (x as f32 / width as f32 * std::f32::consts::TAU).sin();
        for width in [48, 100, 700] {
            let seen = |around: bool| {
                let picture = texture(width, 4, |x, _| [wave(x, width) as u8, 0, 0, 255]);
                let levels = Levels::of(&picture, 256, around);
                let row = &levels.0[0][..256];
                let step = |i: usize| row[(i + 1) % 256][0] - row[i % 256][0];
                // The steps around the seam beside the next ones: a wave goes evenly there.
                (250..260).map(|i| (step(i) - step(i + 1)).abs()).fold(0.0, f32::max)
            };
            // Eight bits give steps of one in 255; so few texels that they are drawn out, some more.
            assert!(seen(true) < 0.006, "{width}: {}", seen(true));
            assert!(width > 100 || seen(false) > 2.0 * seen(true), "{width}: {}", seen(false));
        }
    }

    #[test]
    fn dark_colours_have_finer_steps_on_the_curve() {
        let dark = Levels(vec![vec![[0.004, 0.2, 1.0, 0.5]]]);
        assert_eq!(dark.bytes(false), [[1, 51, 255, 128]]);
        assert_eq!(dark.bytes(true), [[13, 124, 255, 128]]);
    }

    #[test]
    fn the_dot_is_round_and_ends_at_its_edge() {
        let dot = Levels::dot(SIDE);
        let at = |x: usize, y: usize| dot.0[0][y * SIDE + x][3];
        assert!(at(31, 31) > 0.99 && at(0, 31) < 0.01 && at(0, 0) == 0.0);
        assert_eq!(at(10, 31), at(31, 10));
        // The integral of (1 - r²)² over the disc is pi / 3, of a square of 4; 64 texels a side err by less
        // than their square.
        assert!((dot.mean()[3] - std::f32::consts::PI / 12.0).abs() < 1e-3);
    }
}
