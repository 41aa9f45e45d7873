//! A small tiling noise texture: two noises and the slope of the first, made when the program starts.

/// Side of the texture [px].
pub const SIZE: usize = 256;

/// RGBA8, row after row: r and a are noises of mean ½, g and b the slope of r along x and z around ½.
pub fn texels() -> Vec<u8> {
    let first = field(0x51f1);
    let second = field(0x93c7);
    let mut texels = Vec::with_capacity(SIZE * SIZE * 4);
    for z in 0..SIZE {
        for x in 0..SIZE {
            let at = |dx: usize, dz: usize| first[(z + dz) % SIZE * SIZE + (x + dx) % SIZE];
            let slope_x = at(1, 0) - at(SIZE - 1, 0);
            let slope_z = at(0, 1) - at(0, SIZE - 1);
            let byte = |v: f32| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
            texels.extend([
                byte(at(0, 0)),
                byte(0.5 + slope_x * 2.0),
                byte(0.5 + slope_z * 2.0),
                byte(second[z * SIZE + x]),
            ]);
        }
    }
    texels
}

/// Five octaves of tiling gradient noise, stretched to mean ½ and a standard deviation of 0.17.
fn field(seed: u32) -> Vec<f32> {
    let mut sum = vec![0.0_f32; SIZE * SIZE];
    for octave in 0..5_u32 {
        let cells = 8_usize << octave;
        let weight = 0.55_f32.powi(octave as i32);
        for z in 0..SIZE {
            for x in 0..SIZE {
                let at = [x as f32, z as f32].map(|v| v * cells as f32 / SIZE as f32);
                sum[z * SIZE + x] += weight * gradient_noise(at, cells, seed ^ octave.wrapping_mul(0x9e37));
            }
        }
    }
    let count = sum.len() as f32;
    let mean = sum.iter().sum::<f32>() / count;
    let deviation = (sum.iter().map(|v| (v - mean) * (v - mean)).sum::<f32>() / count).sqrt().max(1e-6);
    sum.iter().map(|v| 0.5 + (v - mean) / deviation * 0.17).collect()
}

fn hash(x: u32) -> u32 {
    let x = (x ^ x >> 16).wrapping_mul(0x7feb_352d);
    let x = (x ^ x >> 15).wrapping_mul(0x846c_a68b);
    x ^ x >> 16
}

fn gradient_noise(at: [f32; 2], cells: usize, seed: u32) -> f32 {
    let corner = at.map(|v| v.floor());
    let t = [at[0] - corner[0], at[1] - corner[1]];
    let fade = t.map(|v| v * v * v * (v * (v * 6.0 - 15.0) + 10.0));
    let value = |dx: usize, dz: usize| {
        let x = (corner[0] as usize + dx) % cells;
        let z = (corner[1] as usize + dz) % cells;
        let angle =
            (hash(hash(x as u32 ^ seed) ^ z as u32) >> 8) as f32 / (1 << 24) as f32 * std::f32::consts::TAU;
        angle.cos() * (t[0] - dx as f32) + angle.sin() * (t[1] - dz as f32)
    };
    let low = value(0, 0) + (value(1, 0) - value(0, 0)) * fade[0];
    let high = value(0, 1) + (value(1, 1) - value(0, 1)) * fade[0];
    low + (high - low) * fade[1]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_texture_tiles_and_uses_its_range() {
        let texels = texels();
        let r = |x: usize, z: usize| i32::from(texels[(z * SIZE + x) * 4]);
        let inner: i32 = (0..SIZE).map(|z| (r(100, z) - r(101, z)).abs()).max().unwrap_or(0);
        let seam: i32 = (0..SIZE).map(|z| (r(SIZE - 1, z) - r(0, z)).abs()).max().unwrap_or(0);
        assert!(seam <= inner * 2 + 8, "a step of {seam} over the edge, {inner} inside");
        let low = texels.iter().step_by(4).min().copied().unwrap_or(0);
        let high = texels.iter().step_by(4).max().copied().unwrap_or(0);
        assert!(low < 40 && high > 215, "{low}..{high}");
    }
}
