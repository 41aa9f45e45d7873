//! What is on a bell: a picture of both of its sides, painted from the species' table, and how much of what
//! is behind it each place hides.
//!
//! From left to right: around the bell. From the last row up: from the outer apex over the margin to the
//! inner one, as the mesh's v goes.

use reef_flow::{
    color::{byte, linear_rgb, texels},
    math::smoothstep,
};

use crate::species::Look;

/// Texels around and along.
pub const SIZE: [u32; 2] = [256, 256];
/// Opacity of the material; the vertices have shares of it.
pub const DENSEST: f64 = 0.9;
/// Most that canals, gonads, and the margin hide.
const CANAL: f64 = 0.26;
const GONAD: f64 = 0.6;
const MARGIN: f64 = 0.3;
/// Where the margin begins, as a share of the way from the apex.
const MARGIN_FROM: f64 = 0.9;
/// Streaks around the exumbrella, and from where on they are.
const STREAKS: f64 = 16.0;
const STREAKS_FROM: f64 = 0.3;
/// Middle and radius of a horseshoe, and half of its width, as shares of the way to the margin.
const SHOE_AT: f64 = 0.34;
const SHOE: f64 = 0.15;
const SHOE_WIDE: f64 = 0.045;

type Rgb = [f64; 3];

/// A species' bell.
#[derive(Clone, Debug)]
pub struct Paint {
    look: Look,
    bell: Rgb,
    rim: Rgb,
    gonads: Rgb,
}

fn rgb(text: &str) -> Rgb {
    linear_rgb(text).unwrap_or([0.5; 3]).map(f64::from)
}

fn mix(from: Rgb, to: Rgb, share: f64) -> Rgb {
    core::array::from_fn(|i| from[i] + (to[i] - from[i]) * share)
}

/// How near a place around the bell is to one of so many lines: 1 on it, 0 half way to the next.
fn nearness(u: f64, count: f64) -> f64 {
    let place = u * count;
    1.0 - 2.0 * (place - (place + 0.5).floor()).abs()
}

impl Paint {
    /// Of colours that were checked.
    pub fn new(look: &Look) -> Self {
        let [bell, rim, gonads] = [&look.bell, &look.rim, &look.gonads].map(|text| rgb(text));
        Self { look: look.clone(), bell, rim, gonads }
    }

    /// Shares of canals, gonads, margin and streaks at a place.
    fn marks(&self, u: f64, v: f64) -> [f64; 4] {
        let inner = v > 0.5;
        let share = if inner { 2.0 * (1.0 - v) } else { 2.0 * v };
        let margin = smoothstep(MARGIN_FROM, 1.0, share);
        let count = f64::from(self.look.canals);
        let canal = if inner && count > 0.0 {
            // Every other one forks half way.
            let fork = smoothstep(0.45, 0.75, share) * nearness(u, 2.0 * count);
            smoothstep(0.55, 0.95, nearness(u, count).max(fork)) * smoothstep(0.2, 0.35, share)
        } else {
            0.0
        };
        let gonads = f64::from(self.look.gonad_count);
        let gonad = if inner && gonads > 0.0 {
            let (cos, sin) =
                reef_flow::math::cos_sin_f64(core::f64::consts::TAU * (u * gonads).fract() / gonads);
            let turn = core::f64::consts::PI / gonads;
            let (c, s) = reef_flow::math::cos_sin_f64(turn);
            // Across the horseshoe's middle line, and along it from its middle on.
            let (x, y) = (share * (sin * c - cos * s), share * (cos * c + sin * s) - SHOE_AT);
            let off = ((x * x + y * y).sqrt() - SHOE).abs();
            // Open toward the mouth.
            let open = smoothstep(-0.75, -0.45, y / SHOE);
            (1.0 - smoothstep(0.5 * SHOE_WIDE, 1.5 * SHOE_WIDE, off)) * open
        } else {
            0.0
        };
        let streak = if inner {
            0.0
        } else {
            let wide = smoothstep(STREAKS_FROM, 1.0, share);
            self.look.streaks * wide * smoothstep(0.85 - 0.55 * wide, 1.0, nearness(u, STREAKS))
        };
        [canal, gonad, margin, streak]
    }

    /// Linear light of the tissue at a place of the mesh: u around, v from the outer to the inner apex.
    pub fn color(&self, u: f64, v: f64) -> [f64; 3] {
        let [canal, gonad, margin, streak] = self.marks(u, v);
        let color = mix(self.bell, self.rim, (0.8 * canal).max(0.7 * margin).max(streak));
        mix(color, self.gonads, gonad)
    }

    /// How much of what is behind it one sheet hides at a place.
    pub fn opacity(&self, u: f64, v: f64) -> f64 {
        let [canal, gonad, margin, streak] = self.marks(u, v);
        // A line of sight through the middle crosses four sheets: (1 − a)⁴ = 1 − opacity.
        let through = 1.0 - self.look.opacity.clamp(0.0, 0.99);
        let sheet = 1.0 - through.sqrt().sqrt();
        let marks = (CANAL * canal).max(GONAD * gonad).max(MARGIN * margin).max(MARGIN * streak);
        sheet.max(marks).min(DENSEST)
    }

    /// The texels, four bytes each, [`SIZE`] of them, sRGB.
    pub fn texels(&self) -> Vec<u8> {
        texels(SIZE, |u, v| {
            let [r, g, b] = self.color(u, v).map(byte);
            [r, g, b, 255]
        })
    }
}
