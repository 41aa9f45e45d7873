//! The sand of low quality: a tile of ripples, tones and crumbs that is made when a scene begins, so that a
//! pixel of ground costs one texture. It is what `sand_at` of `shaders/ground.glsl` makes pixel by pixel,
//! bent so that it tiles.

use std::f32::consts::TAU;

use glam::{Vec2, Vec4};
use reef_streams::environment::Ripples;

use super::noise;

/// Side of the tile [px].
pub const SIZE: usize = 1024;
/// Side of the tile [m], as in `shaders/terrain_low.frag`.
const EXTENT: f32 = 8.0;
/// Steepest slope that a texel holds, as in `shaders/terrain_low.frag`.
const STEEPEST: f32 = 1.28;
/// Brightest factor that a texel holds, as in `shaders/terrain_low.frag`.
const BRIGHTEST: f32 = 1.15;

/// RGBA8, row after row along z: r from dark to light sand, g and b the slope along x and z around ½, a
/// brightness.
pub fn texels(ripples: &Ripples, noise: &[u8]) -> Vec<u8> {
    let sand = Sand::new(ripples, noise);
    let mut texels = Vec::with_capacity(SIZE * SIZE * 4);
    let cell = EXTENT / SIZE as f32;
    for z in 0..SIZE {
        for x in 0..SIZE {
            let (tone, gradient, brightness) = sand.at(Vec2::new(x as f32 + 0.5, z as f32 + 0.5) * cell);
            let slope = gradient / (2.0 * STEEPEST) + 0.5;
            texels.extend([tone, slope.x, slope.y, brightness / BRIGHTEST].map(byte));
        }
    }
    texels
}

fn byte(v: f32) -> u8 {
    (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
}

fn smoothstep(from: f32, to: f32, v: f32) -> f32 {
    let t = ((v - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

struct Sand<'a> {
    noise: &'a [u8],
    /// Wave vectors of the two ripple trains [rad/m], a whole number of waves over the tile.
    trains: [Vec2; 2],
    amplitude: f32,
}

impl<'a> Sand<'a> {
    fn new(ripples: &Ripples, noise: &'a [u8]) -> Self {
        let k = TAU / ripples.spacing.max(0.01);
        let (sin, cos) = ripples.direction.sin_cos();
        let whole = |v: Vec2| (v * EXTENT / TAU).round() * TAU / EXTENT;
        // The second train runs a quarter of a radian aside, as in ground.glsl.
        let other = Vec2::new(sin * 0.966 - cos * 0.259, sin * 0.259 + cos * 0.966);
        Self {
            noise,
            trains: [whole(Vec2::new(sin, cos) * k), whole(other * (k * 0.87))],
            amplitude: ripples.height * 0.5,
        }
    }

    /// Tone, slope and brightness at a place [m].
    fn at(&self, x: Vec2) -> (f32, Vec2, f32) {
        let slow = self.noise(x / EXTENT);
        let mid = self.noise(Vec2::new(x.y, x.x) * (5.0 / EXTENT) + 0.37);
        let grain = self.noise(x * (77.0 / EXTENT));
        let warp = (slow.x - 0.5) * 16.0 + (mid.x - 0.5) * 1.6;
        let a = [self.trains[0].dot(x) + warp, self.trains[1].dot(x) - warp * 0.8 + 1.7];
        let weight = smoothstep(0.42, 0.60, slow.w);
        let patches = smoothstep(0.25, 0.50, slow.w + (mid.w - slow.w) * 0.25) * 0.7 + 0.3;
        // Crests sharper than troughs.
        let [first, second] = [0, 1].map(|i| self.trains[i] * (a[i].cos() * (1.0 + 0.45 * a[i].sin())));
        let slope = first.lerp(second, weight) * (self.amplitude * patches * 1.5)
            + Vec2::new(mid.y - 0.5, mid.z - 0.5) * 0.16
            + Vec2::new(grain.y - 0.5, grain.z - 0.5) * 0.25;
        let crest = a[0].sin() + (a[1].sin() - a[0].sin()) * weight;
        let trough = (0.5 - 0.5 * crest) * patches;
        let brightness = (1.0 - 0.42 * trough * trough) * (1.0 + 0.30 * (grain.x - 0.5));
        (0.15 + 0.55 * slow.x + 0.5 * (mid.w - 0.3), slope, brightness)
    }

    /// The noise texture at a place in 0..1, blended between texels.
    fn noise(&self, at: Vec2) -> Vec4 {
        let side = noise::SIZE as i32;
        let at = at * side as f32 - 0.5;
        let corner = at.floor();
        let t = at - corner;
        let texel = |dx: i32, dz: i32| {
            let x = (corner.x as i32 + dx).rem_euclid(side);
            let z = (corner.y as i32 + dz).rem_euclid(side);
            let i = (z * side + x) as usize * 4;
            let c = |k: usize| f32::from(self.noise[i + k]) / 255.0;
            Vec4::new(c(0), c(1), c(2), c(3))
        };
        texel(0, 0).lerp(texel(1, 0), t.x).lerp(texel(0, 1).lerp(texel(1, 1), t.x), t.y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sand_tiles_and_its_ripples_are_as_far_apart_as_the_scene_says() {
        let noise = noise::texels();
        let ripples = Ripples { spacing: 0.2, height: 0.03, direction: 0.0 };
        let texels = texels(&ripples, &noise);
        let slope = |x: usize, z: usize| f32::from(texels[(z * SIZE + x) * 4 + 2]) / 255.0 - 0.5;
        for x in (0..SIZE).step_by(37) {
            let seam = (slope(x, SIZE - 1) - slope(x, 0)).abs();
            let inner = (0..SIZE - 1).map(|z| (slope(x, z) - slope(x, z + 1)).abs()).fold(0.0, f32::max);
            assert!(seam <= inner, "column {x}: {seam} over the edge, {inner} inside");
        }
        // Along z, across the crests: each ripple is climbed once. Where trains fork one is lost or won.
        let climbs = |x: usize| {
            let smooth = |z: usize| (0..5).map(|i| slope(x, (z + i) % SIZE)).sum::<f32>();
            (0..SIZE).filter(|&z| smooth(z) < 0.0 && smooth((z + 1) % SIZE) >= 0.0).count() as f32
        };
        let mean = (0..SIZE).step_by(64).map(climbs).sum::<f32>() / 16.0;
        assert!((30.0..60.0).contains(&mean), "{mean} ripples over 8 m, 40 and 35 are asked for");
    }
}
