//! What hangs from the bell, many around: tentacles and oral arms, by the same discs as the bell (§3.4).
//!
//! Each is a tube of four sides along the points where its angle meets the discs. Lanes go over tubes.

use core::f64::consts::TAU;

use fearless_simd::{Simd, f32x8, prelude::*};
use glam::Vec3;
use reef_flow::{
    Level,
    math::cos_sin_f64,
    random::Random,
    simd::{mul_add, splat},
};
use reef_sdk::abi::{DrawVertex, FibreNode, MeshVertex};

use super::{disc::Disc, normals::pack};
use crate::lanes::WIDTH;

/// Vertices around a tube.
const SIDES: usize = 4;
/// Radius of a tip as a node, as a share of that at the root.
const THINNEST: f32 = 0.15;
/// Most tubes of a fringe, and most points along them.
const MOST: [usize; 2] = [256, 128];

/// Tubes around the bell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FringeForm {
    /// How many: a multiple of 8, up to 256; 0: none.
    pub count: usize,
    /// Radius at the root, across its way around the bell and along it [m].
    pub radius: [f64; 2],
    /// Radius at the tip as a share.
    pub taper: f64,
    /// Frills along its edges, as a share of the radius, and how many there are.
    pub frill: f64,
    /// How many frills there are along it.
    pub frills: f64,
    /// Differences of lengths, ± this share.
    pub variation: f64,
}

impl Default for FringeForm {
    fn default() -> Self {
        Self { count: 24, radius: [4e-4; 2], taper: 0.4, frill: 0.0, frills: 0.0, variation: 0.3 }
    }
}

/// The surface of a fringe, with the room to make it.
#[derive(Clone, Debug)]
pub struct Fringe {
    form: FringeForm,
    points: usize,
    /// cos, sin, and length over the mean, of each tube.
    tables: [Vec<f32>; 3],
    /// Radii of each point along a tube.
    radii: Vec<[f32; 2]>,
    /// Greatest length over the mean, of a tube or of the mean; and the greatest radius of a node [m].
    longest: f32,
    thickest: f32,
    /// Of each point along the tubes.
    discs: Vec<Disc>,
    /// Places of the points along eight tubes.
    lines: Vec<[[f32; WIDTH]; 3]>,
}

impl Fringe {
    /// For tubes of so many points.
    ///
    /// # Errors
    /// The key, what is wrong with it, and what is allowed.
    pub fn new(form: FringeForm, points: usize, seed: u64) -> Result<Self, String> {
        let [most, most_points] = MOST;
        if !form.count.is_multiple_of(WIDTH) || form.count > most {
            return Err(format!("count must be a multiple of {WIDTH} up to {most}, is {}", form.count));
        }
        if !(2..=most_points).contains(&points) {
            return Err(format!("a tube must have 2 to {most_points} points, has {points}"));
        }
        let shares = [
            ("radius", form.radius[0], 1.0),
            ("radius", form.radius[1], 1.0),
            ("taper", form.taper, 10.0),
            ("frill", form.frill, 0.95),
            ("frills", form.frills, 100.0),
            ("variation", form.variation, 0.9),
        ];
        for (key, value, most) in shares {
            if !(0.0..=most).contains(&value) {
                return Err(format!("{key} must be 0 to {most}, is {value}"));
            }
        }
        let mut random = Random::new(seed, u64::from_le_bytes(*b"fringe\0\0"));
        let mut tables = [vec![], vec![], vec![]];
        for tube in 0..form.count {
            let (cos, sin) = cos_sin_f64(TAU * (tube as f64 + 0.5) / form.count as f64);
            let length = 1.0 + form.variation * random.signed();
            for (table, value) in tables.iter_mut().zip([cos, sin, length]) {
                table.push(value as f32);
            }
        }
        let radii: Vec<[f32; 2]> = (0..points)
            .map(|k| {
                let along = k as f64 / (points - 1) as f64;
                // The tip is closed: its ring is a point.
                let taper = if k + 1 == points { 0.0 } else { 1.0 + (form.taper - 1.0) * along };
                let frill = 1.0 + form.frill * cos_sin_f64(TAU * form.frills * along).1;
                form.radius.map(|radius| (radius * taper * frill) as f32)
            })
            .collect();
        Ok(Self {
            points,
            longest: tables[2].iter().copied().fold(1.0, f32::max),
            thickest: radii.as_flattened().iter().copied().fold(thinnest(&form), f32::max),
            tables,
            radii,
            discs: vec![Disc::default(); points],
            lines: vec![[[0.0; WIDTH]; 3]; points],
            form,
        })
    }

    /// Vertices, tube after tube, from root to tip, four around.
    pub fn vertices(&self) -> usize {
        self.form.count * self.points * SIDES
    }

    /// Tubes.
    pub fn count(&self) -> usize {
        self.form.count
    }

    /// Points along a tube.
    pub fn points(&self) -> usize {
        self.points
    }

    /// Triangles, counter-clockwise from outside, the first vertex has the number 0.
    pub fn indices(&self) -> Vec<u32> {
        let (points, sides) = (self.points as u32, SIDES as u32);
        let mut indices = Vec::new();
        for tube in 0..self.form.count as u32 {
            for k in 0..points - 1 {
                for side in 0..sides {
                    let at = |k: u32, side: u32| (tube * points + k) * sides + side % sides;
                    let [a, b] = [at(k, side), at(k, side + 1)];
                    let [c, d] = [at(k + 1, side), at(k + 1, side + 1)];
                    indices.extend([a, c, b]);
                    // At the tip the second triangle has no area.
                    if k + 2 < points {
                        indices.extend([b, c, d]);
                    }
                }
            }
        }
        indices
    }

    /// Texture coordinates: u around a tube, v from root to tip.
    pub fn mesh(&self) -> Vec<MeshVertex> {
        let vertex = |k: usize, side: usize| MeshVertex {
            uv: [side as f32 / SIDES as f32, k as f32 / (self.points - 1) as f32],
            glow: 1.0,
            color: u32::MAX,
            ..MeshVertex::default()
        };
        let tube = (0..self.points).flat_map(|k| (0..SIDES).map(move |side| vertex(k, side)));
        (0..self.form.count).flat_map(|_| tube.clone()).collect()
    }

    /// Takes the discs that its tubes meet from root to tip.
    pub fn hang(&mut self, discs: impl Iterator<Item = Disc>) {
        self.discs.iter_mut().zip(discs).for_each(|(own, disc)| *own = disc);
    }

    /// Nothing of it is farther from the origin [m].
    pub fn reach(&self) -> f32 {
        let Some(root) = self.discs.first().filter(|_| self.form.count > 0) else { return 0.0 };
        let root_far = root.reach();
        let far = self
            .discs
            .iter()
            .map(|disc| disc.reach().max(root_far) + (self.longest - 1.0) * disc.less(root).reach());
        far.fold(0.0, f32::max) + self.thickest
    }

    /// Makes all vertices, [`Fringe::vertices`] of them.
    pub fn write(&mut self, level: Level, into: &mut [DrawVertex]) {
        reef_flow::dispatch!(level, simd => {
            for (block, into) in into.chunks_exact_mut(WIDTH * self.points * SIDES).enumerate() {
                self.eight(simd, block * WIDTH, into);
            }
        });
    }

    /// Middles of all tubes, [`Fringe::count`] times [`Fringe::points`], tube after tube from root to tip.
    pub fn write_nodes(&mut self, level: Level, into: &mut [FibreNode]) {
        reef_flow::dispatch!(level, simd => {
            for (block, into) in into.chunks_exact_mut(WIDTH * self.points).enumerate() {
                self.along(simd, block * WIDTH);
                for (k, (line, radii)) in self.lines.iter().zip(&self.radii).enumerate() {
                    let radius = radii[0].max(thinnest(&self.form));
                    for lane in 0..WIDTH {
                        let position = [line[0][lane], line[1][lane], line[2][lane]];
                        into[lane * self.points + k] = FibreNode { position, radius };
                    }
                }
            }
        });
    }

    /// The middles of eight tubes, into `lines`.
    #[inline(always)]
    fn along<S: Simd>(&mut self, simd: S, first: usize) {
        let [cos, sin, length] = &self.tables;
        let cos = f32x8::from_slice(simd, &cos[first..first + WIDTH]);
        let sin = f32x8::from_slice(simd, &sin[first..first + WIDTH]);
        let length = f32x8::from_slice(simd, &length[first..first + WIDTH]);
        let cos_cos = cos * cos;
        // The root stays on the bell; what follows is longer or shorter.
        let mut root = [splat(simd, 0.0); 3];
        for (k, (disc, line)) in self.discs.iter().zip(&mut self.lines).enumerate() {
            let Disc { centre, half, side, twist, .. } = *disc;
            let twisted = twist != Vec3::ZERO;
            for part in 0..3 {
                let [half, side] = [half, side].map(|way| splat(simd, way[part]));
                let mut middle = splat(simd, centre[part] - twist[part]);
                if twisted {
                    middle = mul_add(splat(simd, 2.0 * twist[part]), cos_cos, middle);
                }
                let place = mul_add(half, cos, mul_add(side, sin, middle));
                if k == 0 {
                    root[part] = place;
                }
                mul_add(place - root[part], length, root[part]).store_slice(&mut line[part]);
            }
        }
    }

    #[inline(always)]
    fn eight<S: Simd>(&mut self, simd: S, first: usize, into: &mut [DrawVertex]) {
        self.along(simd, first);
        let [cos, sin, _] = &self.tables;
        let cos = f32x8::from_slice(simd, &cos[first..first + WIDTH]);
        let sin = f32x8::from_slice(simd, &sin[first..first + WIDTH]);
        for k in 0..self.points {
            let (before, after) = (k.saturating_sub(1), (k + 1).min(self.points - 1));
            let Disc { half, aside, .. } = self.discs[k];
            let half = half.normalize_or(aside.any_orthonormal_vector());
            let mut along = [splat(simd, 0.0); 3];
            let mut around = along;
            let mut place = along;
            for part in 0..3 {
                place[part] = f32x8::from_slice(simd, &self.lines[k][part]);
                along[part] = f32x8::from_slice(simd, &self.lines[after][part])
                    - f32x8::from_slice(simd, &self.lines[before][part]);
                around[part] = splat(simd, aside[part]) * cos - splat(simd, half[part]) * sin;
            }
            // Outward: across the tube and its way around the bell.
            let out = unit(simd, cross(around, along));
            let sideways = unit(simd, cross(along, out));
            let [wide, deep] = self.radii[k];
            for (side, normal) in [sideways, out, negative(sideways), negative(out)].into_iter().enumerate() {
                let radius = splat(simd, if side % 2 == 0 { wide } else { deep });
                let packed: [i32; WIDTH] = pack(simd, normal).into();
                let mut parts = [[0.0; WIDTH]; 3];
                for part in 0..3 {
                    mul_add(normal[part], radius, place[part]).store_slice(&mut parts[part]);
                }
                for lane in 0..WIDTH {
                    into[(lane * self.points + k) * SIDES + side] = DrawVertex {
                        position: [parts[0][lane], parts[1][lane], parts[2][lane]],
                        normal: packed[lane].cast_unsigned(),
                        thickness: wide + deep,
                    };
                }
            }
        }
    }
}

/// Least radius of a node [m]: a tip that is closed still has a width.
fn thinnest(form: &FringeForm) -> f32 {
    THINNEST * form.radius[0] as f32
}

#[inline(always)]
fn cross<S: Simd>(a: [f32x8<S>; 3], b: [f32x8<S>; 3]) -> [f32x8<S>; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline(always)]
fn negative<S: Simd>(a: [f32x8<S>; 3]) -> [f32x8<S>; 3] {
    [-a[0], -a[1], -a[2]]
}

#[inline(always)]
fn unit<S: Simd>(simd: S, a: [f32x8<S>; 3]) -> [f32x8<S>; 3] {
    let square = mul_add(a[2], a[2], mul_add(a[1], a[1], a[0] * a[0]));
    let scale = splat(simd, 1.0) / square.max(splat(simd, f32::MIN_POSITIVE)).sqrt();
    [a[0] * scale, a[1] * scale, a[2] * scale]
}
