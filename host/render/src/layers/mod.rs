//! The textures of sprites and of materials as the shaders see them: three arrays of pictures with their
//! smaller levels, because not every device may choose between pictures while it draws (lavapipe cannot). An
//! array holds pictures of one size, 64, 256 or 512 texels a side; a texture is brought to the next greater
//! size. What the shaders know it by, its *handle*, names the size in the high half and the layer in the low
//! one. Handle 0 is a soft round dot.
//!
//! Memory is bounded by [`Size::most`]: 140 MB in all.

mod levels;

use std::collections::HashMap;

use ash::vk;
use reef_gpu::{Gpu, Image, ImageDesc, Resource, Result, SamplerDesc};
use reef_streams::{frame::Frame, textures::Texture};

use crate::sprites::Layer;
use levels::Levels;

/// Pictures of one size.
struct Size {
    name: &'static str,
    /// Texels along a side.
    side: usize,
    /// Layers at most; every device has as many.
    most: usize,
    /// Red, green and blue lie on sRGB's curve: so the dark colours of leaves have steps that nobody sees.
    /// Sprites are pale, and light costs a software sampler less.
    curved: bool,
}

/// From the smallest; with their levels 6, 45 and 90 MB at most. The first has the dot among its layers.
const SIZES: [Size; 3] = [
    Size { name: "textures of 64 texels", side: 64, most: 256, curved: false },
    Size { name: "textures of 256 texels", side: 256, most: 128, curved: true },
    Size { name: "textures of 512 texels", side: 512, most: 64, curved: true },
];

/// How a texture goes on beyond its edges.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Edges {
    /// As its last texel: sprites.
    Hold,
    /// Around: the right edge joins the left one. Along the other axis as its last texel. Materials.
    Around,
}

/// Content, and whether it goes around.
type Key = ([u8; 32], bool);

/// Which texture lies where.
#[derive(Clone, Debug)]
pub struct Catalogue {
    /// By what they show; the dot is not among them.
    layers: HashMap<[u8; 32], Layer>,
    dot: Layer,
}

impl Default for Catalogue {
    fn default() -> Self {
        Self { layers: HashMap::new(), dot: Layer { index: 0, mean: Levels::dot(SIZES[0].side).mean() } }
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

/// The bit of a handle's size, as `SIZES` of `shaders/textures.glsl` has it.
pub fn size_bit(handle: u32) -> u32 {
    1 << (handle >> 16)
}

/// One size's pictures on the device.
#[derive(Default)]
struct Array {
    image: Option<Image>,
    held: Vec<Key>,
    means: Vec<[f32; 4]>,
}

/// The arrays.
pub struct Layers {
    gpu: Gpu,
    hold: vk::Sampler,
    around: vk::Sampler,
    arrays: [Array; SIZES.len()],
    catalogue: Catalogue,
    /// What the sea holds now, in the order of its instances.
    held: Vec<Key>,
    /// How many of these were not drawn as large as they are.
    small: usize,
}

impl Layers {
    /// Nothing is brought to the device before the first picture with sprites, or with a material that has a
    /// texture.
    pub fn new(gpu: &Gpu) -> Result<Self> {
        let sampler = |repeat| gpu.sampler(SamplerDesc { linear: true, repeat, anisotropic: false });
        Ok(Self {
            gpu: gpu.clone(),
            hold: sampler([false; 2])?,
            around: sampler([true, false])?,
            arrays: Default::default(),
            catalogue: Catalogue::default(),
            held: Vec::new(),
            small: 0,
        })
    }

    /// Makes the arrays hold what the instances of this step have. An array in which something changed is
    /// made anew: textures change when instances begin, not while they run.
    pub fn update(&mut self, frame: &Frame) -> Result<()> {
        let wanted = wanted(frame);
        let keys = || wanted.iter().map(|&(texture, around)| (texture.hash, around));
        if self.arrays[0].image.is_some() && self.held.iter().copied().eq(keys()) {
            return Ok(());
        }
        let places = places(wanted.iter().map(|(texture, _)| [texture.width, texture.height]));
        self.tell(&wanted, &places);
        self.catalogue.layers.clear();
        for (number, (size, array)) in SIZES.iter().zip(&mut self.arrays).enumerate() {
            let here = wanted.iter().zip(&places).filter(|(_, place)| place.is_some_and(|p| p.0 == number));
            let here: Vec<(&Texture, bool)> = here.map(|(&texture, _)| texture).collect();
            array.update(&self.gpu, size, &here, number == 0)?;
        }
        for ((texture, _), place) in wanted.iter().zip(&places) {
            let Some((size, layer)) = *place else { continue };
            let layer = Layer { index: (size << 16 | layer) as u32, mean: self.arrays[size].means[layer] };
            self.catalogue.layers.insert(texture.hash, layer);
        }
        self.held = keys().collect();
        Ok(())
    }

    /// Says what is drawn smaller than it is, once for each number of them.
    fn tell(&mut self, wanted: &[(&Texture, bool)], places: &[Option<(usize, usize)>]) {
        let own = |(texture, _): &(&Texture, bool)| size_of([texture.width, texture.height]);
        let dots = places.iter().filter(|place| place.is_none()).count();
        let small =
            wanted.iter().zip(places).filter(|(texture, place)| place.map(|p| p.0) != Some(own(texture)));
        let small = small.count();
        if small > self.small {
            tracing::warn!(
                "the sea has {} textures: {} are drawn with fewer texels than they have, {dots} as dots; there is room for \
                 {} of 64 texels, {} of 256, {} of 512",
                wanted.len(),
                small - dots,
                SIZES[0].most - 1,
                SIZES[1].most,
                SIZES[2].most,
            );
        }
        self.small = small;
    }

    /// Which texture lies where.
    pub fn catalogue(&self) -> &Catalogue {
        &self.catalogue
    }

    /// The arrays as three bindings, from the `first` on; none before the first update.
    pub fn bindings(&self, first: u32, edges: Edges) -> Vec<(u32, Resource<'_>)> {
        let sampler = match edges {
            Edges::Hold => self.hold,
            Edges::Around => self.around,
        };
        let numbered = (first..).zip(self.arrays.iter().filter_map(|array| array.image.as_ref()));
        numbered.map(|(number, image)| (number, Resource::Texture(image, sampler))).collect()
    }
}

impl Array {
    /// Makes it hold these, behind the dot where it has that.
    fn update(&mut self, gpu: &Gpu, size: &Size, textures: &[(&Texture, bool)], dot: bool) -> Result<()> {
        let keys = || textures.iter().map(|&(texture, around)| (texture.hash, around));
        if self.image.is_some() && self.held.iter().copied().eq(keys()) {
            return Ok(());
        }
        use vk::ImageUsageFlags as U;
        let format = if size.curved { vk::Format::R8G8B8A8_SRGB } else { vk::Format::R8G8B8A8_UNORM };
        let dot = dot.then(|| Levels::dot(size.side));
        let made = textures.iter().map(|(texture, around)| Levels::of(texture, size.side, *around));
        self.means.clear();
        // As bytes at once: four floats a texel of a whole array would be half a gigabyte.
        let mut layers: Vec<Vec<Vec<u8>>> = Vec::new();
        for levels in dot.into_iter().chain(made) {
            self.means.push(levels.mean());
            layers.push(levels.bytes(size.curved));
        }
        // An array of nothing is one texel a layer. A single layer would be no array to the shader.
        let nothing = vec![vec![0; 4]];
        let side = if layers.is_empty() { 1 } else { size.side as u32 };
        while layers.len() < 2 {
            layers.push(layers.first().unwrap_or(&nothing).clone());
        }
        let desc = ImageDesc {
            layers: layers.len() as u32,
            mips: side.ilog2() + 1,
            ..ImageDesc::new(size.name, (side, side), format, U::SAMPLED | U::TRANSFER_DST)
        };
        let levels = 0..desc.mips as usize;
        let pieces: Vec<&[u8]> = levels.flat_map(|level| layers.iter().map(move |l| &l[level][..])).collect();
        let texels = pieces.concat();
        // The one before is given back first: both would be too much.
        self.image = None;
        let image = Image::new(gpu, &desc)?;
        gpu.write_levels(&image, &texels)?;
        self.image = Some(image);
        self.held = keys().collect();
        Ok(())
    }
}

/// The textures of a step, one of each content, in the order of its instances; and whether they go around: a
/// material has them.
fn wanted(frame: &Frame) -> Vec<(&Texture, bool)> {
    let mut all: Vec<(&Texture, bool)> = Vec::new();
    for outputs in &frame.outputs {
        if outputs.textures.is_empty() {
            continue;
        }
        let mut worn: Vec<u32> = outputs.materials.iter().map(|m| m.texture).filter(|id| *id != 0).collect();
        worn.sort_unstable();
        worn.dedup();
        for texture in outputs.textures.iter() {
            let around = worn.binary_search(&texture.id).is_ok();
            match all.iter_mut().find(|(known, _)| known.hash == texture.hash) {
                Some((_, known)) => *known |= around,
                None => all.push((texture, around)),
            }
        }
    }
    all
}

/// The size of a picture: the next greater one; what is greater than all has the greatest.
fn size_of([width, height]: [u32; 2]) -> usize {
    let longest = width.max(height) as usize;
    SIZES.iter().position(|size| longest <= size.side).unwrap_or(SIZES.len() - 1)
}

/// Size and layer of each of these pictures [texels]. Where its size is full, one has the next smaller; None:
/// all are full.
fn places(pictures: impl Iterator<Item = [u32; 2]>) -> Vec<Option<(usize, usize)>> {
    // The first layer is the dot.
    let mut used = [1, 0, 0];
    let mut place = |picture| {
        let size = (0..=size_of(picture)).rev().find(|size| used[*size] < SIZES[*size].most)?;
        used[size] += 1;
        Some((size, used[size] - 1))
    };
    pictures.map(&mut place).collect()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::DVec3;
    use reef_abi as abi;
    use reef_streams::Outputs;

    use super::*;
    use crate::sample;

    #[test]
    fn a_picture_has_the_next_greater_size_and_the_greatest_if_there_is_none() {
        let sizes = [[1, 1], [64, 64], [65, 1], [1, 256], [257, 3], [512, 512], [1024, 1024]];
        assert_eq!(sizes.map(size_of), [0, 0, 1, 1, 2, 2, 2]);
    }

    #[test]
    fn what_finds_its_size_full_has_the_next_smaller_and_at_last_none() {
        let most: usize = SIZES.iter().map(|size| size.most).sum();
        let places = places((0..most).map(|_| [1024, 700]));
        let count = |size: usize| places.iter().flatten().filter(|place| place.0 == size).count();
        assert_eq!([0, 1, 2].map(count), [255, 128, 64]);
        // No two have one place, and none has the dot's.
        let mut seen: Vec<_> = places.iter().flatten().collect();
        seen.sort_unstable();
        seen.dedup();
        assert_eq!((seen.len(), seen[0]), (most - 1, &(0, 1)));
        assert_eq!(places.last(), Some(&None));
        let bytes = |size: &Size| size.most * size.side * size.side * 4 * 4 / 3;
        assert!(SIZES.iter().map(bytes).sum::<usize>() < 141_000_000);
    }

    #[test]
    fn a_texture_goes_around_where_some_material_has_it() {
        let texture = |id: u32, hash: u8| {
            let texels = vec![0; 4];
            Arc::new(Texture {
                id,
                name: String::new(),
                width: 1,
                height: 1,
                srgb: false,
                texels,
                hash: [hash; 32],
            })
        };
        let camera = sample::looking_at(DVec3::ONE, DVec3::ZERO);
        let material = |texture| abi::Material { texture, ..sample::tissue() };
        let outputs = Outputs {
            materials: vec![material(0), material(2)],
            textures: Arc::new(vec![texture(1, 1), texture(2, 2), texture(3, 3)]),
            ..Outputs::default()
        };
        let mut frame = sample::frame(1, camera, outputs);
        // Another instance's numbers are its own.
        frame.outputs.push(Arc::new(Outputs {
            materials: vec![material(1)],
            textures: Arc::new(vec![texture(1, 3), texture(2, 4)]),
            ..Outputs::default()
        }));
        let seen: Vec<_> = wanted(&frame).iter().map(|(t, around)| (t.hash[0], *around)).collect();
        assert_eq!(seen, [(1, false), (2, true), (3, true), (4, false)]);
    }
}
