//! What each particle looks like: drawn from a box's few tables by a hash of its number.

use core::f64::consts::TAU;

use reef_flow::{
    color::{byte, linear},
    math::cos_sin_f64,
    random::mix,
};

use crate::{config::BoxPlan, kind::Orientation, texture::Mean};

const SIZES: usize = 256;
const COLORS: usize = 16;
const AXES: usize = 256;
const ROLLS: f32 = core::f32::consts::TAU / 256.0;

/// The looks of a box's particles.
#[derive(Clone, Debug, PartialEq)]
pub struct Looks {
    seed: u64,
    sizes: Vec<f32>,
    colors: Vec<u32>,
    axes: Vec<[f32; 3]>,
    /// 0..1
    pub opacity: f32,
    /// Turned to the viewer.
    pub facing: bool,
    /// The host's number of the picture.
    pub texture: u32,
    /// The picture from afar.
    pub mean: Mean,
    /// Linear colour of all without variation.
    pub color: [f64; 3],
}

/// The looks of one particle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Diameter [m].
    pub size: f32,
    /// sRGB 0xAABBGGRR.
    pub color: u32,
    /// Unit normal.
    pub axis: [f32; 3],
    /// [rad]
    pub roll: f32,
}

impl Looks {
    /// The looks of a box.
    pub fn new(plan: &BoxPlan, texture: u32, mean: Mean) -> Self {
        let [least, most] = plan.size;
        let share = |i: usize, of: usize| (i as f64 + 0.5) / of as f64;
        let color = [16, 8, 0].map(|shift| linear((plan.color >> shift) as u8));
        Self {
            seed: mix(plan.seed ^ 0x6c6f_6f6b),
            // Small ones are more.
            sizes: (0..SIZES).map(|i| (least + (most - least) * share(i, SIZES).powi(2)) as f32).collect(),
            colors: (0..COLORS)
                .map(|i| {
                    let light = 1.0 + plan.variation * (2.0 * share(i, COLORS) - 1.0);
                    packed(color.map(|c| c * light))
                })
                .collect(),
            axes: sphere(),
            opacity: plan.opacity as f32,
            facing: plan.orientation == Orientation::Facing,
            texture,
            mean,
            color,
        }
    }

    /// The looks of a particle by its number in the box.
    #[inline(always)]
    pub fn of(&self, number: u64) -> Look {
        let hash = mix(self.seed ^ number);
        Look {
            size: self.sizes[hash as usize % SIZES],
            color: self.colors[(hash >> 8) as usize % COLORS],
            axis: self.axes[(hash >> 16) as usize % AXES],
            roll: (hash >> 24 & 0xff) as f32 * ROLLS,
        }
    }

    /// Sum of the squares of all diameters [m²].
    pub fn squares(&self, count: u64) -> f64 {
        (0..count).map(|number| f64::from(self.of(number).size).powi(2)).sum()
    }
}

/// sRGB 0xAABBGGRR of a linear colour.
pub fn packed(color: [f64; 3]) -> u32 {
    u32::from_le_bytes([byte(color[0]), byte(color[1]), byte(color[2]), 0xff])
}

/// Directions spread evenly over the sphere, by the golden angle.
fn sphere() -> Vec<[f32; 3]> {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    (0..AXES)
        .map(|i| {
            let y = 1.0 - (2.0 * i as f64 + 1.0) / AXES as f64;
            let radius = (1.0 - y * y).max(0.0).sqrt();
            let (cosine, sine) = cos_sin_f64(TAU * (i as f64 * GOLDEN).fract());
            [(radius * cosine) as f32, y as f32, (radius * sine) as f32]
        })
        .collect()
}
