//! What is on a fish's skin: a picture of both sides, the fins and the iris, painted from the species' table.
//!
//! From left to right: from the back to the belly of either side, then from the fins' roots to their edges,
//! then the iris. From the last row up: from the nose to the tail fin's edge.

use reef_flow::{color::texels, random::mix};

use crate::look::{Look, Pattern};

/// Texels across and along.
pub const SIZE: [u32; 2] = [256, 512];
/// u of the fins' roots and edges.
pub const FIN_ROOT: f64 = 0.54;
/// The other one.
pub const FIN_EDGE: f64 = 0.9;
/// u of the iris.
pub const IRIS: f64 = 0.955;

/// Where the iris begins and ends on the picture.
const IRIS_PART: [f32; 2] = [0.925, 0.985];
/// Between body and fins.
const BODY_PART: f32 = 0.52;
/// From where on a fin is of its edge's colour, as a share of its height.
const EDGE: f32 = 0.82;
/// How far a bar goes out on the fins.
const ON_FINS: f32 = 0.3;
/// Width of the lines around bars, as a share of the length.
const LINE: f32 = 0.014;
/// How soft edges are [shares of the length].
const SOFT: f32 = 0.004;
/// Rays of a fin along the whole length.
const RAYS: f32 = 110.0;
/// Rays of half a tail fin.
const TAIL_RAYS: f32 = 14.0;

type Rgb = [f32; 3];

/// Texels, sRGB with alpha.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Four bytes a texel, [`SIZE`] of them.
    pub texels: Vec<u8>,
}

/// Paints a species whose last section is at a share of its length.
pub fn paint(look: &Look, last: f64) -> Picture {
    let paints = Paints::new(look, last as f32);
    let texels = texels(SIZE, |u, v| {
        let [r, g, b] = paints.at(u as f32, v as f32).map(|x| (x.clamp(0.0, 1.0) * 255.0 + 0.5) as u8);
        [r, g, b, 255]
    });
    Picture { texels }
}

/// The colours of a look, 0 to 1, sRGB: they are mixed as painters do.
struct Paints<'a> {
    look: &'a Look,
    back: Rgb,
    side: Rgb,
    belly: Rgb,
    fin: Rgb,
    edge: Rgb,
    tail: Rgb,
    iris: Rgb,
    mark: Rgb,
    line: Rgb,
    /// Where the tail fin's colour begins.
    tail_from: f32,
}

/// From where on the tail fin has its own colour, as a share of the way from the last section to its edge.
const STALK: f32 = 0.15;

fn rgb(text: &str) -> Rgb {
    let digits = text.strip_prefix('#').filter(|digits| digits.is_ascii()).unwrap_or("");
    let channel = |at: usize| digits.get(at..at + 2).and_then(|byte| u8::from_str_radix(byte, 16).ok());
    [0, 2, 4].map(|at| f32::from(channel(at).unwrap_or(128)) / 255.0)
}

fn mixed(a: Rgb, b: Rgb, share: f32) -> Rgb {
    core::array::from_fn(|i| a[i] + (b[i] - a[i]) * share)
}

fn smooth(from: f32, to: f32, x: f32) -> f32 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Smooth chance in the plane, 0 to 1.
fn noise(x: f32, y: f32, seed: u64) -> f32 {
    let corner = |i: i32, j: i32| {
        let hash = mix(mix(seed ^ u64::from(i as u32)) ^ (u64::from(j as u32) << 32));
        (hash >> 40) as f32 / (1 << 24) as f32
    };
    let (i, j) = (x.floor(), y.floor());
    let (s, t) = (smooth(0.0, 1.0, x - i), smooth(0.0, 1.0, y - j));
    let (i, j) = (i as i32, j as i32);
    let low = corner(i, j) + (corner(i + 1, j) - corner(i, j)) * s;
    let high = corner(i, j + 1) + (corner(i + 1, j + 1) - corner(i, j + 1)) * s;
    low + (high - low) * t
}

impl<'a> Paints<'a> {
    fn new(look: &'a Look, last: f32) -> Self {
        Self {
            back: rgb(&look.back),
            side: rgb(&look.side),
            belly: rgb(&look.belly),
            fin: rgb(&look.fin),
            edge: rgb(&look.edge),
            tail: rgb(&look.tail),
            iris: rgb(&look.iris),
            mark: rgb(&look.mark),
            line: rgb(&look.line),
            tail_from: last + STALK * (1.0 - last),
            look,
        }
    }

    fn at(&self, u: f32, v: f32) -> Rgb {
        if u < BODY_PART {
            self.body(1.0 - 4.0 * u.min(0.5), v)
        } else if (IRIS_PART[0]..IRIS_PART[1]).contains(&u) {
            self.iris
        } else if u >= IRIS_PART[1] {
            // Beside the back, across the picture's seam.
            self.body(1.0, v)
        } else {
            let (root, edge) = (FIN_ROOT as f32, FIN_EDGE as f32);
            self.fin(((u - root) / (edge - root)).clamp(0.0, 1.0), v)
        }
    }

    /// The body at a height from 1 (back) to −1 (belly).
    fn body(&self, y: f32, v: f32) -> Rgb {
        let lower = mixed(self.belly, self.side, smooth(-0.6, -0.05, y));
        let mut color = mixed(lower, self.back, smooth(0.2, 0.8, y));
        color = self.marked(color, y, v);
        // The stalk goes over into the tail fin.
        color = mixed(color, self.tail, smooth(self.tail_from - 0.01, self.tail_from + 0.03, v));
        // No skin is even.
        let uneven = 0.94 + 0.12 * noise(v * 40.0, y * 9.0, 7);
        let scale = self.scale(y, v);
        // A fold behind the head: the gill's edge.
        let gill = 1.0
            - self.look.gill as f32
                * near(v - 0.2 - 0.03 * (1.0 - y * y), 0.004)
                * smooth(0.75, 0.4, y.abs());
        // And a mouth.
        let mouth = 1.0 - 0.6 * near(y + 0.22 + 2.0 * v, 0.09) * smooth(0.055, 0.035, v);
        color.map(|x| x * uneven * scale * gill * mouth)
    }

    /// Scales are darker at their rear edges, row by row.
    fn scale(&self, y: f32, v: f32) -> f32 {
        let along = self.look.scales as f32;
        if along <= 0.0 || !(0.2..0.8).contains(&v) {
            return 1.0;
        }
        // As high as long, on a side about a third as high as the fish is long.
        let (x, row) = (v * along, y * along / 6.0);
        let shifted = x + 0.5 * (row.floor() - 2.0 * (row.floor() * 0.5).floor());
        let (s, t) = (shifted - shifted.floor() - 0.5, row - row.floor() - 0.5);
        1.03 - 0.11 * smooth(0.1, 0.5, s + 0.8 * t * t)
    }

    /// A fin at a share of the way from its root to its edge.
    fn fin(&self, out: f32, v: f32) -> Rgb {
        let own = mixed(self.fin, self.tail, smooth(self.tail_from - 0.02, self.tail_from + 0.02, v));
        let mut color = mixed(own, self.edge, smooth(EDGE - 0.06, EDGE + 0.03, out));
        if v < self.tail_from && self.look.pattern == Pattern::Bars {
            let bars = self.marked(color, 0.9, v);
            color = mixed(color, bars, smooth(ON_FINS + 0.05, ON_FINS - 0.05, out));
        }
        // Those of the tail fin run along it.
        let tail = smooth(self.tail_from - 0.02, self.tail_from, v);
        let rear = smooth(0.955, 0.985, v);
        color = mixed(color, self.edge, rear);
        let ray = if tail > 0.5 { out * TAIL_RAYS } else { v * RAYS };
        let ray = 1.0 - 0.22 * smooth(0.3, 0.5, (ray - ray.floor() - 0.5).abs());
        color.map(|x| x * ray)
    }

    /// The pattern over a colour.
    fn marked(&self, color: Rgb, y: f32, v: f32) -> Rgb {
        let broad = self.look.broad as f32;
        let marks = self.look.marks.iter().map(|mark| *mark as f32);
        match self.look.pattern {
            Pattern::Plain => color,
            Pattern::Bars => marks.fold(color, |color, mark| {
                // Bars bow forward at the back and the belly, and are broader in the middle.
                let bow = 0.02 * (noise(y * 2.5 + 9.0, mark * 20.0, 3) - 0.5);
                let off = (v - mark + 0.012 * y * y + bow).abs();
                let half = 0.5 * broad * (1.1 - 0.35 * y * y);
                let lined = mixed(color, self.line, smooth(half + LINE + SOFT, half + LINE - SOFT, off));
                mixed(lined, self.mark, smooth(half + SOFT, half - SOFT, off))
            }),
            Pattern::Stripes => marks.fold(color, |color, mark| {
                let on = smooth(broad, 0.4 * broad, (y - mark).abs()) * smooth(0.1, 0.22, v);
                mixed(color, self.mark, on)
            }),
            Pattern::Blotches => {
                let chance = 0.6 * noise(v * 26.0, y * 4.0 + 40.0, 11) + 0.4 * noise(v * 58.0, y * 9.0, 13);
                let level = 0.28 + 0.5 * (1.0 - broad);
                mixed(color, self.mark, smooth(level - 0.04, level + 0.04, chance))
            }
            Pattern::Palette => {
                // A dark band from the eye along the back to the tail, and one below it that it meets there;
                // between them an oval in the side's colour.
                let back = smooth(-0.02, 0.02, y - 0.1 + 0.9 * smooth(0.34, 0.1, v)) * smooth(0.08, 0.11, v);
                let lower = near(y + 0.05 - 0.1 * (v - 0.5), 0.26) * smooth(0.3, 0.34, v);
                let dark = back.max(lower) * smooth(1.05, 0.93, y);
                let (dx, dy) = ((v - 0.4) / 0.13, (y - 0.34) / 0.3);
                let oval = smooth(1.06, 0.94, dx * dx + dy * dy);
                // A wedge of the tail's colour before the tail fin.
                let wedge = smooth(-0.02, 0.02, v - 0.72 - 0.12 * y.abs());
                let dark = mixed(color, self.mark, dark * (1.0 - oval));
                mixed(dark, self.tail, wedge)
            }
        }
    }
}

/// 1 at 0, 0 from `half` on.
fn near(x: f32, half: f32) -> f32 {
    smooth(half, 0.6 * half, x.abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texel(picture: &Picture, u: f32, v: f32) -> [u8; 3] {
        let [width, height] = SIZE.map(|size| size as f32);
        let row = ((1.0 - v) * height) as usize;
        let at = 4 * (row * SIZE[0] as usize + (u * width) as usize);
        [picture.texels[at], picture.texels[at + 1], picture.texels[at + 2]]
    }

    #[test]
    fn bars_lie_where_the_table_says_and_have_lines_around_them() {
        let look = Look {
            back: "#F26A1B".into(),
            side: "#F26A1B".into(),
            pattern: Pattern::Bars,
            mark: "#F6F4EC".into(),
            line: "#000000".into(),
            marks: vec![0.5],
            broad: 0.1,
            scales: 0.0,
            ..Look::default()
        };
        let picture = paint(&look, 0.76);
        let [inside, beside, line] = [0.5, 0.7, 0.5 + 0.055 + 0.007].map(|v| texel(&picture, 0.25, v));
        assert!(inside[2] > 180, "{inside:?}");
        assert!(beside[0] > 180 && beside[2] < 60, "{beside:?}");
        assert!(line.iter().all(|x| *x < 60), "{line:?}");
    }

    #[test]
    fn the_back_is_next_to_itself_across_the_seam() {
        let picture = paint(&Look::default(), 0.76);
        for v in [0.3, 0.5, 0.7] {
            let [left, right] = [0.001, 0.998].map(|u| texel(&picture, u, v));
            assert!(left.iter().zip(right).all(|(a, b)| a.abs_diff(b) < 24), "{left:?} {right:?}");
        }
    }
}
