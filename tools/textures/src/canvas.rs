//! A small picture that shapes are laid over one another on, with smooth edges.

use crate::SIDE;

/// Points along each side of a texel at which a shape is asked: its edges are smooth by their mean.
const SAMPLES: usize = 4;

/// A colour: linear red, green and blue, times how much of the texel it covers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Texel {
    /// Premultiplied linear light.
    pub color: [f64; 3],
    /// Share that is covered, 0..1.
    pub alpha: f64,
}

impl Texel {
    /// Lays `shape` over what was there.
    pub fn cover(&mut self, shape: Texel) {
        let rest = 1.0 - shape.alpha;
        for (below, above) in self.color.iter_mut().zip(shape.color) {
            *below = *below * rest + above;
        }
        self.alpha = self.alpha * rest + shape.alpha;
    }

    /// Eight bits a channel: sRGB, straight alpha. Where nothing is seen the colour is black.
    pub fn encode(&self) -> [u8; 4] {
        let eight = |v: f64| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
        let alpha = eight(self.alpha);
        if alpha == 0 {
            return [0; 4];
        }
        let [r, g, b] = self.color.map(|c| eight(encoded(c / self.alpha)));
        [r, g, b, alpha]
    }
}

/// A colour like 0xE3D6B8 as linear light.
pub fn linear(srgb: u32) -> [f64; 3] {
    [16, 8, 0].map(|shift| decoded(f64::from((srgb >> shift) & 0xff) / 255.0))
}

/// sRGB's curve by its usual quarter-power neighbours: x^2.4 as a mix of x², x³ whose greatest error is below
/// half of an eight-bit step. No power function, so that all machines agree.
fn decoded(x: f64) -> f64 {
    if x <= 0.04045 {
        return x / 12.92;
    }
    let u = (x + 0.055) / 1.055;
    // u^2.4 = u² · u^0.4, and u^0.4 = (u²)^(1/5) by Newton's method.
    u * u * root(u * u, 5)
}

fn encoded(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    if x <= 0.003_130_8 {
        return x * 12.92;
    }
    // x^(1/2.4) = (x^5)^(1/12).
    1.055 * root(x * x * x * x * x, 12) - 0.055
}

/// The n-th root of a number in 0..1 by Newton's method, from above.
fn root(x: f64, n: i32) -> f64 {
    let mut y = 1.0_f64;
    for _ in 0..200 {
        let mut power = 1.0;
        for _ in 1..n {
            power *= y;
        }
        let next = y - (y * power - x) / (f64::from(n) * power);
        if next >= y {
            break;
        }
        y = next;
    }
    y
}

/// The picture: texels row after row.
#[derive(Clone, Debug, PartialEq)]
pub struct Canvas {
    /// `SIDE * SIDE` of them.
    pub texels: Vec<Texel>,
}

impl Default for Canvas {
    fn default() -> Self {
        Self { texels: vec![Texel::default(); SIDE * SIDE] }
    }
}

impl Canvas {
    /// Lays a shape over the picture. It is asked for its colour (linear) and its opacity at points of the
    /// square from −1 to 1, y downward; outside of its reach it has none.
    pub fn paint(&mut self, center: [f64; 2], reach: f64, shape: impl Fn([f64; 2]) -> ([f64; 3], f64)) {
        let step = 2.0 / SIDE as f64;
        for (i, texel) in self.texels.iter_mut().enumerate() {
            let corner = [(i % SIDE) as f64 * step - 1.0, (i / SIDE) as f64 * step - 1.0];
            let far = |axis: usize| (corner[axis] + 0.5 * step - center[axis]).abs() > reach + step;
            if far(0) || far(1) {
                continue;
            }
            let mut sum = Texel::default();
            for s in 0..SAMPLES * SAMPLES {
                let place = |n: usize| (n as f64 + 0.5) / SAMPLES as f64 * step;
                let p = [corner[0] + place(s % SAMPLES), corner[1] + place(s / SAMPLES)];
                let (color, alpha) = shape(p);
                let share = alpha.clamp(0.0, 1.0) / (SAMPLES * SAMPLES) as f64;
                sum.alpha += share;
                for (sum, color) in sum.color.iter_mut().zip(color) {
                    *sum += color * share;
                }
            }
            texel.cover(sum);
        }
    }
}

/// 0 below `a`, 1 above `b`, smooth between.
pub fn smooth(a: f64, b: f64, x: f64) -> f64 {
    let t = ((x - a) / (b - a)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// A sequence of numbers that look random: splitmix64.
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    /// The same seed gives the same numbers.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// In 0..1.
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        (mixed(self.0) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// In `low..high`.
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// A unit vector, every direction as likely.
    pub fn direction(&mut self) -> [f64; 2] {
        loop {
            let p = [self.within(-1.0, 1.0), self.within(-1.0, 1.0)];
            let square = p[0] * p[0] + p[1] * p[1];
            if (1e-3..=1.0).contains(&square) {
                return p.map(|v| v / square.sqrt());
            }
        }
    }

    /// A point of the disc, more of them in its middle.
    pub fn in_disc(&mut self, radius: f64) -> [f64; 2] {
        let r = radius * self.unit();
        self.direction().map(|v| v * r)
    }
}

fn mixed(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// Smooth noise in 0..1 with features of size 1, four layers of it, each half as great and half as strong.
pub fn noise(p: [f64; 2], seed: u64) -> f64 {
    let (mut sum, mut weight, mut scale) = (0.0, 0.5, 1.0);
    for layer in 0..4 {
        sum += weight * layer_of_noise(p.map(|v| v * scale), seed.wrapping_add(layer * 977));
        weight *= 0.5;
        scale *= 2.0;
    }
    sum / 0.9375
}

fn layer_of_noise(p: [f64; 2], seed: u64) -> f64 {
    let cell = p.map(f64::floor);
    let t = [smooth(0.0, 1.0, p[0] - cell[0]), smooth(0.0, 1.0, p[1] - cell[1])];
    let at = |dx: i64, dy: i64| {
        let key = ((cell[0] as i64 + dx) as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15)
            ^ ((cell[1] as i64 + dy) as u64).wrapping_mul(0xc2b2_ae3d_27d4_eb4f)
            ^ seed.wrapping_mul(0x1656_67b1_9e37_79f9);
        (mixed(key) >> 11) as f64 / (1_u64 << 53) as f64
    };
    let row = |dy: i64| at(0, dy) + (at(1, dy) - at(0, dy)) * t[0];
    row(0) + (row(1) - row(0)) * t[1]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curves_are_srgbs_and_undo_each_other() {
        for i in 0..=255_u32 {
            let x = f64::from(i) / 255.0;
            let exact = if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) };
            // Newton's method stops where f64 cannot tell the next value.
            assert!((decoded(x) - exact).abs() < 1e-12, "{i}");
            assert!((encoded(decoded(x)) - x).abs() < 1e-12, "{i}");
        }
    }

    #[test]
    fn a_shape_covers_as_much_as_its_area() {
        let mut canvas = Canvas::default();
        canvas.paint([0.1, -0.2], 0.5, |[x, y]| {
            let inside = (x - 0.1) * (x - 0.1) + (y + 0.2) * (y + 0.2) < 0.25;
            ([1.0, 0.5, 0.0], f64::from(u8::from(inside)))
        });
        let area: f64 = canvas.texels.iter().map(|t| t.alpha).sum::<f64>() * 4.0 / (SIDE * SIDE) as f64;
        // 800 points along the edge, each right within half a step of 1/128.
        assert!((area - std::f64::consts::PI * 0.25).abs() < 2e-3, "{area}");
    }
}
