//! The textures of sprites and of fibres' materials as the shaders see them: one array of pictures of the
//! same size with their smaller levels, because not every device may choose between pictures while it draws
//! (lavapipe cannot). Layer 0 is a soft round dot; the others are what instances made, brought to that size.
//!
//! Texels hold linear light times coverage, so that blending them keeps no dark or bright fringe.

use std::{collections::HashMap, sync::Arc};

use ash::vk;
use reef_gpu::{Gpu, Image, ImageDesc, Result, SamplerDesc};
use reef_streams::{frame::Frame, textures::Texture};

use crate::sprites::{Layer, linear};

/// Texels along a side of a layer.
pub const SIDE: usize = 64;
/// A layer and its halves down to one texel.
const LEVELS: usize = 7;
/// Layers at most, the dot among them: every device has as many.
pub const MOST_LAYERS: usize = 256;

/// One layer's levels, largest first: four floats a texel.
#[derive(Clone, Debug, PartialEq)]
struct Levels(Vec<Vec<[f32; 4]>>);

/// Which texture lies where.
#[derive(Clone, Debug)]
pub struct Catalogue {
    /// By what they show; the dot is not among them.
    layers: HashMap<[u8; 32], Layer>,
    dot: Layer,
}

impl Default for Catalogue {
    fn default() -> Self {
        Self { layers: HashMap::new(), dot: Layer { index: 0, mean: dot().mean() } }
    }
}

impl Catalogue {
    /// The layer of a texture; the dot for one that there is no room for.
    pub fn of(&self, texture: &Texture) -> Layer {
        self.layers.get(&texture.hash).copied().unwrap_or(self.dot)
    }

    /// The layer of texture 0.
    pub fn dot(&self) -> Layer {
        self.dot
    }
}

/// The array.
pub struct Layers {
    gpu: Gpu,
    sampler: vk::Sampler,
    image: Option<Image>,
    catalogue: Catalogue,
    /// Hashes of what the sea holds now, in order of their layers.
    held: Vec<[u8; 32]>,
    full: bool,
}

impl Layers {
    /// Nothing is brought to the device before the first picture with sprites, or with a fibre that has a
    /// texture.
    pub fn new(gpu: &Gpu) -> Result<Self> {
        let sampler = gpu.sampler(SamplerDesc { linear: true, repeat: false, anisotropic: false })?;
        Ok(Self {
            gpu: gpu.clone(),
            sampler,
            image: None,
            catalogue: Catalogue::default(),
            held: Vec::new(),
            full: false,
        })
    }

    /// Makes the array hold what the instances of this step have. Where that changed, it is made anew:
    /// textures change when instances begin, not while they run.
    pub fn update(&mut self, frame: &Frame) -> Result<()> {
        let mut wanted: Vec<&Arc<Texture>> = Vec::new();
        let mut same = true;
        for texture in frame.outputs.iter().flat_map(|outputs| outputs.textures.iter()) {
            if !wanted.iter().any(|known| known.hash == texture.hash) {
                same &= self.held.get(wanted.len()) == Some(&texture.hash);
                wanted.push(texture);
            }
        }
        if same && wanted.len() == self.held.len() && self.image.is_some() {
            return Ok(());
        }
        self.held = wanted.iter().map(|texture| texture.hash).collect();
        let full = wanted.len() >= MOST_LAYERS;
        if full && !self.full {
            tracing::warn!(
                "the sea has {} textures: {} are drawn, the others as dots",
                wanted.len(),
                MOST_LAYERS - 1
            );
        }
        self.full = full;
        wanted.truncate(MOST_LAYERS - 1);
        let mut all = vec![dot()];
        self.catalogue.layers.clear();
        for texture in wanted {
            let levels = Levels::of(texture);
            let layer = Layer { index: all.len() as u32, mean: levels.mean() };
            self.catalogue.layers.insert(texture.hash, layer);
            all.push(levels);
        }
        self.image = Some(self.bring(&all)?);
        Ok(())
    }

    /// Which texture lies where.
    pub fn catalogue(&self) -> &Catalogue {
        &self.catalogue
    }

    /// The array and how to sample it; None before the first update.
    pub fn image(&self) -> Option<(&Image, vk::Sampler)> {
        self.image.as_ref().map(|image| (image, self.sampler))
    }

    fn bring(&self, all: &[Levels]) -> Result<Image> {
        use vk::ImageUsageFlags as U;
        let size = (SIDE as u32, SIDE as u32);
        let usage = U::SAMPLED | U::TRANSFER_DST;
        let desc = ImageDesc {
            // A single layer would be no array to the shader.
            layers: (all.len() as u32).max(2),
            mips: LEVELS as u32,
            ..ImageDesc::new("sprites", size, vk::Format::R8G8B8A8_UNORM, usage)
        };
        let image = Image::new(&self.gpu, &desc)?;
        let mut texels = Vec::new();
        for level in 0..LEVELS {
            for layer in 0..desc.layers as usize {
                let levels = all.get(layer).unwrap_or(&all[0]);
                let eight = |v: f32| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
                texels.extend(levels.0[level].iter().flat_map(|texel| texel.map(eight)));
            }
        }
        self.gpu.write_levels(&image, &texels)?;
        Ok(image)
    }
}

impl Levels {
    fn of(texture: &Texture) -> Self {
        let whole = texture.texels.chunks_exact(4).map(|t| covered(t, texture.srgb)).collect::<Vec<_>>();
        let rows = resampled(&whole, texture.width as usize, texture.height as usize);
        Self::below(rows)
    }

    /// The smaller levels under the first.
    fn below(first: Vec<[f32; 4]>) -> Self {
        let mut levels = vec![first];
        let mut side = SIDE;
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

    fn mean(&self) -> [f32; 4] {
        self.0.last().and_then(|level| level.first()).copied().unwrap_or_default()
    }
}

/// Linear light times coverage of a texel of four bytes with straight alpha.
fn covered(texel: &[u8], srgb: bool) -> [f32; 4] {
    let alpha = f32::from(texel[3]) / 255.0;
    let light = |byte: u8| if srgb { linear(byte) } else { f32::from(byte) / 255.0 } * alpha;
    [light(texel[0]), light(texel[1]), light(texel[2]), alpha]
}

/// A picture of any size at the size of a layer: rows, then columns, each by a tent as wide as the coarser of
/// both grids.
fn resampled(texels: &[[f32; 4]], width: usize, height: usize) -> Vec<[f32; 4]> {
    if (width, height) == (SIDE, SIDE) {
        return texels.to_vec();
    }
    let wide = along(texels, width, height, |x, y| y * width + x);
    // `wide` holds column after column.
    along(&wide, height, SIDE, |y, x| x * height + y)
}

/// Resamples `lines` lines of `length` texels; `at(i, line)` says where a texel lies. The result holds, for
/// each of the SIDE new places, one texel of every line, place after place.
fn along(
    texels: &[[f32; 4]],
    length: usize,
    lines: usize,
    at: impl Fn(usize, usize) -> usize,
) -> Vec<[f32; 4]> {
    let scale = length as f32 / SIDE as f32;
    let reach = scale.max(1.0);
    let mut out = Vec::with_capacity(SIDE * lines);
    for place in 0..SIDE {
        let center = (place as f32 + 0.5) * scale - 0.5;
        let first = (center - reach).ceil() as isize;
        let last = (center + reach).floor() as isize;
        for line in 0..lines {
            let (mut sum, mut weights) = ([0.0_f32; 4], 0.0);
            for i in first..=last {
                let weight = (1.0 - (i as f32 - center).abs() / reach).max(0.0);
                let texel = texels[at(i.clamp(0, length as isize - 1) as usize, line)];
                sum.iter_mut().zip(texel).for_each(|(sum, v)| *sum += v * weight);
                weights += weight;
            }
            out.push(sum.map(|v| v / weights.max(1e-6)));
        }
    }
    out
}

/// Texture 0: white, opaque in the middle, gone with its slope at the edge.
fn dot() -> Levels {
    let texel = |i: usize| {
        let place = |n: usize| (n as f32 + 0.5) / SIDE as f32 * 2.0 - 1.0;
        let r = place(i % SIDE).hypot(place(i / SIDE)).min(1.0);
        let fall = (1.0 - r * r) * (1.0 - r * r);
        [fall; 4]
    };
    Levels::below((0..SIDE * SIDE).map(texel).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texture(width: u32, height: u32, texel: impl Fn(u32, u32) -> [u8; 4]) -> Texture {
        let texels = (0..width * height).flat_map(|i| texel(i % width, i / width)).collect();
        Texture { id: 1, name: "test".into(), width, height, srgb: false, texels, hash: [0; 32] }
    }

    #[test]
    fn a_texture_of_the_arrays_size_is_taken_as_it_is_and_its_mean_is_its_last_level() {
        let levels =
            Levels::of(&texture(64, 64, |x, _| if x < 32 { [255, 0, 0, 255] } else { [0, 255, 0, 0] }));
        assert_eq!(levels.0.len(), LEVELS);
        assert_eq!((levels.0[0][0], levels.0[0][63]), ([1.0, 0.0, 0.0, 1.0], [0.0; 4]));
        // What is not covered gives no colour: no green comes into the mean.
        assert_eq!(levels.mean(), [0.5, 0.0, 0.0, 0.5]);
    }

    #[test]
    fn other_sizes_keep_orientation_and_mean() {
        for (width, height) in [(1, 1), (16, 8), (100, 200), (1024, 3)] {
            let levels = Levels::of(&texture(width, height, |x, y| {
                let ramp = |v: u32, n: u32| ((v * 2 + 1) * 255 / (n * 2)) as u8;
                [ramp(x, width), ramp(y, height), 0, 255]
            }));
            let mean = levels.mean();
            // Rounding to eight bits, and the tent's hold of the outermost texels.
            assert!(
                (mean[0] - 0.5).abs() < 0.01 && (mean[1] - 0.5).abs() < 0.01,
                "{width}x{height}: {mean:?}"
            );
            assert!((mean[3] - 1.0).abs() < 1e-5);
            let at = |x: usize, y: usize| levels.0[0][y * SIDE + x];
            if width > 1 {
                assert!(at(60, 5)[0] > at(3, 5)[0] + 0.5, "x stays x");
            }
            if height > 1 {
                assert!(at(5, 60)[1] > at(5, 3)[1] + 0.5, "y stays y");
            }
        }
    }

    #[test]
    fn the_dot_is_round_and_ends_at_its_edge() {
        let dot = dot();
        let at = |x: usize, y: usize| dot.0[0][y * SIDE + x][3];
        assert!(at(31, 31) > 0.99 && at(0, 31) < 0.01 && at(0, 0) == 0.0);
        assert_eq!(at(10, 31), at(31, 10));
        // The integral of (1 - r²)² over the disc is pi / 3, of a square of 4; 64 texels a side err by less
        // than their square.
        assert!((dot.mean()[3] - std::f32::consts::PI / 12.0).abs() < 1e-3);
    }
}
