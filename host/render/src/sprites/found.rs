//! Culling: what of a part of the streams is seen, and what the device is told of it.

use std::sync::LazyLock;

use glam::Vec3;
use reef_abi as abi;

use super::{Eye, FAINTEST, GpuSprite, Kind, Layer, Sizes, sort::key};

/// Some of one instance's sprites, and what they refer to.
pub struct Batch<'a> {
    pub sprites: &'a [abi::Billboard],
    /// Origins of the objects relative to the eye [m].
    pub origins: &'a [Vec3],
    /// The layer of each texture of the instance.
    pub layers: &'a [(u32, Layer)],
    pub dot: Layer,
}

impl Batch<'_> {
    fn layer(&self, id: u32) -> Layer {
        match id {
            0 => self.dot,
            _ => self.layers.iter().find(|(known, _)| *known == id).map_or(self.dot, |(_, layer)| *layer),
        }
    }
}

/// The eye with what is the same for all sprites.
pub struct Gaze {
    eye: Eye,
    /// Lengths that a sphere's radius has at the sides of the picture.
    sides: [f32; 2],
    /// The same in its corners.
    corner: f32,
    back: f32,
    sizes: Sizes,
}

impl Gaze {
    pub fn new(eye: &Eye, back: f32, sizes: Sizes) -> Self {
        let [x, y] = eye.tangent.map(|t| t * t);
        let sides = [1.0 + x, 1.0 + y].map(f32::sqrt);
        Self { eye: *eye, sides, corner: (1.0 + x + y).sqrt(), back, sizes }
    }

    /// What is too near to be sharp fades: nothing fills the picture. And nothing goes with a jump when the
    /// eye passes through it, or by its side: where the middle of a sprite is beside the eye, something of it
    /// is in the picture, however it is turned, only as long as it is nearer than its radius times that of
    /// the picture's corner. There it has faded.
    pub fn nearness(&self, distance: f32, size: f32) -> f32 {
        let gone = 0.06 + 0.5 * size * self.corner;
        let t = ((distance - gone) / (0.06 + 0.8 * size)).clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t)
    }
}

/// What was found in one part of the streams, in their order.
#[derive(Debug, Default)]
pub struct Found {
    pub keys: Vec<u16>,
    pub sprites: Vec<GpuSprite>,
}

impl Found {
    pub fn clear(&mut self) {
        self.keys.clear();
        self.sprites.clear();
    }

    pub fn cull(&mut self, batch: &Batch<'_>, gaze: &Gaze) {
        let Gaze { eye, sizes, .. } = gaze;
        let [nearest, farthest] = eye.depths;
        // Neighbours share texture and colour.
        let mut texture = (0, batch.dot);
        let mut color = (0, [0.0; 3]);
        for sprite in batch.sprites {
            let Some(origin) = batch.origins.get(sprite.object as usize) else { continue };
            let mut place = *origin + Vec3::from(sprite.position);
            if sprite.flags & abi::FLAG_NO_BLEND == 0 {
                place -= Vec3::from(sprite.velocity) * gaze.back;
            }
            let radius = sprite.size * 0.5;
            let depth = place.dot(eye.forward);
            if depth < nearest || depth - radius > farthest {
                continue;
            }
            let pixels = sprite.size * eye.pixels / depth;
            // A point is as wide as it has to be at least; a quad reaches as far as its corners.
            let reach = radius.max(0.5 * sizes.least * depth / eye.pixels) * std::f32::consts::SQRT_2;
            if place.dot(eye.right).abs() > depth * eye.tangent[0] + gaze.sides[0] * reach
                || place.dot(eye.up).abs() > depth * eye.tangent[1] + gaze.sides[1] * reach
            {
                continue;
            }
            if texture.0 != sprite.texture {
                texture = (sprite.texture, batch.layer(sprite.texture));
            }
            let layer = texture.1;
            let square = place.length_squared();
            let distance = square.sqrt();
            let facing = sprite.flags & abi::BILLBOARD_FACING != 0;
            let lies = if facing { 1.0 } else { Vec3::from(sprite.axis).dot(place).abs() / distance };
            let opacity = sprite.opacity * gaze.nearness(distance, sprite.size);
            let kind = if pixels < sizes.speck { Kind::Speck } else { Kind::Quad };
            let share = (pixels / sizes.least).min(1.0);
            if opacity * share * share * lies * layer.mean[3].max(0.05) < FAINTEST {
                continue;
            }
            if color.0 != sprite.color || self.keys.is_empty() {
                color = (sprite.color, light(sprite.color));
            }
            // From afar only the mean of the texture is left.
            let [r, g, b] = color.1;
            let (opacity, [mr, mg, mb, ma]) = match kind {
                Kind::Speck => (opacity * lies, layer.mean),
                Kind::Quad => (opacity, [1.0; 4]),
            };
            let tint =
                [half(r * mr * opacity), half(g * mg * opacity), half(b * mb * opacity), half(ma * opacity)];
            self.keys.push(key(square, kind));
            self.sprites.push(GpuSprite {
                place: place.to_array(),
                size: sprite.size,
                axis: if facing { [0.0; 3] } else { sprite.axis },
                roll: sprite.roll,
                tint,
                layer: layer.index,
            });
        }
    }
}

/// Linear light of a colour 0xAABBGGRR; its alpha is not read: opacity has a field of its own.
fn light(color: u32) -> [f32; 3] {
    [0, 8, 16].map(|shift| linear((color >> shift) as u8))
}

/// Linear light of an sRGB channel.
pub fn linear(channel: u8) -> f32 {
    static CURVE: LazyLock<[f32; 256]> = LazyLock::new(|| {
        std::array::from_fn(|i| {
            let v = i as f32 / 255.0;
            if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
        })
    });
    CURVE[usize::from(channel)]
}

/// A half float of a number in 0..1; what is too small for one is 0.
fn half(v: f32) -> u16 {
    if v < 6.2e-5 {
        return 0;
    }
    // Exponent and mantissa move down; half a step is added, and may carry.
    let bits = v.min(1.0).to_bits() + 0x1000;
    ((bits >> 13) - (112 << 10)) as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_are_what_the_shader_unpacks() {
        for (value, bits) in [(0.0, 0), (1.0, 0x3c00), (0.5, 0x3800), (0.25, 0x3400), (0.1, 0x2e66)] {
            assert_eq!(half(value), bits, "{value}");
        }
        assert_eq!(half(7.0), 0x3c00, "no opacity is above 1");
    }

    #[test]
    fn colours_are_srgb_with_red_in_the_lowest_byte() {
        let [r, g, b] = light(0xff00_80ff);
        assert_eq!((r, b), (1.0, 0.0));
        assert!((g - 0.2159).abs() < 1e-3, "{g}");
    }
}
