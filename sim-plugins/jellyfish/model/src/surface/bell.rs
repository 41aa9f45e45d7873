//! The bell: from a chain of points to vertices.

use fearless_simd::{Simd, f32x8, prelude::*};
use glam::{DVec2, Vec2, Vec3};
use reef_flow::{
    Level,
    math::cos_sin_f64,
    simd::{mul_add, splat, splat3},
};
use reef_sdk::abi::{DrawVertex, pack_normal};

use super::{
    form::Form,
    noise::{AROUND, Noise, RingNoise, fade},
    normals::Rows,
    spline::Resample,
};
use crate::lanes::WIDTH;

/// Constants of eq. (4), from figure 3: thickness of a contracted bell over that of a relaxed one, less 1;
/// how far ridges rise above that; length of a contracted muscle over its length at rest.
const ETA: f32 = 1.34 - 1.0;
const KAPPA: f32 = 1.51 - 1.34;
const GAMMA: f32 = 1.0 - 0.54;
/// Most of eq. (4)'s coefficient: a bell that shoots past its contraction wrinkles no further.
const MOST_COMPRESSED: f32 = 1.4;
/// Share of the way to the margin from which on structures have their whole height: at the apex all vertices
/// of a ring meet, and no wave has room.
const STRUCTURES_WHOLE: f32 = 0.6;
/// Share of the way to the margin at which the exumbrella's ridges begin to end: at the margin the sides
/// meet.
const RIDGES_END: f32 = 0.85;

/// Where the slice stands in the sea: its x, its y, and across it. Unit vectors, right-handed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Along the slice's x.
    pub x: Vec3,
    /// Along the slice's y: the animal's way when it is upright.
    pub y: Vec3,
    /// Across the slice.
    pub z: Vec3,
}

impl Default for Frame {
    fn default() -> Self {
        Self { x: Vec3::X, y: Vec3::Y, z: Vec3::Z }
    }
}

impl Frame {
    pub(crate) fn of(&self, v: Vec2) -> Vec3 {
        self.x * v.x + self.y * v.y
    }
}

/// What all vertices of a ring have in common.
#[derive(Clone, Copy, Debug, Default)]
struct Ring {
    /// Middle of the disc; from there to its edge at cos = 1, and at sin = 1 [m].
    centre: [f32; 3],
    half: [f32; 3],
    side: [f32; 3],
    /// Outward, as a sum over 1, cos, cos², sin and sin · cos.
    out: [[f32; 3]; 5],
    /// Factors of the tables of eq. (2) and eq. (4) [m]; what eq. (4) adds everywhere; height of the noise.
    structure: f32,
    ridges: f32,
    thicker: f32,
    noise: f32,
    thickness: f32,
}

/// The surface of one bell, with the room to make it.
#[derive(Clone, Debug)]
pub struct Bell {
    form: Form,
    /// Thickness ϑ [m].
    thickness: f32,
    /// Points of the chain from the apex to the margin.
    margin: usize,
    resample: Resample,
    noise: Noise,
    /// cos, sin, and the waves of eqs. (2) and (4), around a ring.
    tables: [Vec<f32>; 4],
    /// The way through a cell of the noise, and its blend.
    cells: [Vec<f32>; 2],
    /// Distance of the pair of each ring at rest [m].
    rest: Vec<f32>,
    /// x and y of the knots, and of the samples.
    knots: [Vec<f32>; 2],
    normals: Vec<Vec2>,
    samples: [Vec<f32>; 2],
    rows: Rows,
}

impl Bell {
    /// For a chain of so many points, and its shape at rest [m].
    ///
    /// # Errors
    /// As [`Form::check`].
    pub fn new(form: Form, thickness: f64, rest: &[DVec2], seed: u64) -> Result<Self, String> {
        form.check()?;
        let (points, margin) = (rest.len(), rest.len() / 2);
        let knots = 2 * points;
        // Right samples from the outer to the inner apex, then the left ones, then both apices.
        let way = points as f64;
        let right = (0..form.rings).map(|ring| way * form.place(ring));
        let left = (0..form.rings).map(|ring| knots as f64 - way * form.place(ring));
        let places: Vec<f64> = right.chain(left).chain([0.0, way]).collect();
        let table = |wave: &dyn Fn(f64, f64) -> f64| -> Vec<f32> {
            let angle = |j: usize| core::f64::consts::TAU * j as f64 / form.around as f64;
            let turned = |j: usize, times: u32| cos_sin_f64(f64::from(times) * angle(j)).1;
            (0..form.around)
                .map(|j| wave(turned(j, form.structures), turned(j, form.compressions)) as f32)
                .collect()
        };
        let angles = |part: fn((f64, f64)) -> f64| -> Vec<f32> {
            (0..form.around)
                .map(|j| part(cos_sin_f64(core::f64::consts::TAU * j as f64 / form.around as f64)) as f32)
                .collect()
        };
        let tables = [
            angles(|(cos, _)| cos),
            angles(|(_, sin)| sin),
            table(&|structure, _| if form.lobes { structure.abs() } else { structure }),
            table(&|_, ridge| 0.5 * (ridge + 1.0)),
        ];
        let cell = form.around / AROUND;
        let through = |j: usize| j as f64 / cell as f64;
        let resample = Resample::new(knots, &places);
        let room = vec![0.0; resample.samples()];
        let mut made = Self {
            thickness: thickness as f32,
            margin,
            noise: Noise::new(seed),
            tables,
            cells: [
                (0..cell).map(|j| through(j) as f32).collect(),
                (0..cell).map(|j| fade(through(j)) as f32).collect(),
            ],
            rest: vec![0.0; form.rings],
            knots: [vec![0.0; knots], vec![0.0; knots]],
            normals: vec![Vec2::ZERO; points],
            samples: [room.clone(), room],
            resample,
            rows: Rows::new(form.rings + 2, form.around),
            form,
        };
        made.profile(Level::best(), rest.iter().copied(), DVec2::ZERO);
        for ring in 0..form.rings {
            let [a, b] = made.pair(ring);
            made.rest[ring] = a.distance(b);
        }
        Ok(made)
    }

    /// What it looks like.
    pub fn form(&self) -> &Form {
        &self.form
    }

    /// Thickness at a share of the way from the apex to the margin [m]: figure 3's profile, thickest at the
    /// apex.
    fn thickness_at(&self, share: f32) -> f32 {
        let margin = self.form.margin_thickness as f32;
        self.thickness * (margin + (1.0 - margin) * (1.0 - share * share))
    }

    /// Both sides of the chain as a loop, and its samples; places relative to `origin`.
    fn profile(&mut self, level: Level, chain: impl Iterator<Item = DVec2>, origin: DVec2) {
        let (margin, points) = (self.margin as isize, 2 * self.margin + 1);
        // The chain runs from the margin of negative x to that of positive x. On the loop the outer apex is
        // 0, the right side follows, the inner apex is `points`.
        let outer = |i: usize| (i as isize - margin).rem_euclid(2 * points as isize) as usize;
        let inner = |i: usize| (points as isize - (i as isize - margin)) as usize;
        let [x, y] = &mut self.knots;
        for (i, point) in chain.enumerate().take(points) {
            [x[inner(i)], y[inner(i)]] = (point - origin).as_vec2().to_array();
        }
        for i in 0..points {
            let at = |i: usize| Vec2::new(self.knots[0][inner(i)], self.knots[1][inner(i)]);
            let along = at((i + 1).min(points - 1)) - at(i.saturating_sub(1));
            let normal = along.perp().normalize_or(Vec2::Y);
            self.normals[i] = normal;
            let share = (i as isize - margin).unsigned_abs() as f32 / margin as f32;
            let outside = at(i) + normal * self.thickness_at(share);
            [self.knots[0][outer(i)], self.knots[1][outer(i)]] = outside.to_array();
        }
        reef_flow::dispatch!(level, simd => {
            for (knots, samples) in self.knots.iter().zip(&mut self.samples) {
                self.resample.apply(simd, knots, samples);
            }
        });
    }

    fn sample(&self, at: usize) -> Vec2 {
        Vec2::new(self.samples[0][at], self.samples[1][at])
    }

    /// The points of a ring's pair: on the side of positive x, and opposite.
    fn pair(&self, ring: usize) -> [Vec2; 2] {
        [self.sample(ring), self.sample(self.form.rings + ring)]
    }

    /// The chain's normal at a share of the way from the apex to the margin, on both sides.
    fn outward(&self, share: f32) -> [Vec2; 2] {
        let place = share * self.margin as f32;
        let cell = (place as usize).min(self.margin - 1);
        let between = place - cell as f32;
        let (right, left) = (self.margin + cell, self.margin - cell);
        [
            self.normals[right].lerp(self.normals[right + 1], between),
            self.normals[left].lerp(self.normals[left - 1], between),
        ]
    }

    fn ring(&self, ring: usize, frame: &Frame) -> Ring {
        let [a, b] = self.pair(ring);
        let place = self.form.place(ring) as f32;
        let outer = place < 0.5;
        let share = if outer { 2.0 * place } else { 2.0 * (1.0 - place) };
        let (centre, half) = (0.5 * (a + b), 0.5 * (a - b));
        let radius = half.length();
        let [right, left] = self.outward(share);
        let e = half / radius.max(f32::MIN_POSITIVE);
        let axis = e.perp();
        // Outward at cos = 1 and at cos = −1: how far from the axis, and along it.
        let (near, far) = ([e.dot(right), axis.dot(right)], [-e.dot(left), axis.dot(left)]);
        let mean = [0.5 * (near[0] + far[0]), 0.5 * (near[1] + far[1])];
        let tilt = [0.5 * (near[0] - far[0]), 0.5 * (near[1] - far[1])];
        let (e3, axis3, z) = (frame.of(e), frame.of(axis), frame.z);
        let out = [axis3 * mean[1], e3 * mean[0] + axis3 * tilt[1], e3 * tilt[0], z * mean[0], z * tilt[0]];
        let theta = self.thickness;
        let thickness = self.thickness_at(share);
        // Eq. (4), read so that a relaxed bell is smooth. What contracts is the sub-umbrella there.
        let own = if outer { self.form.rings - 1 - ring } else { ring };
        let (rest, [a, b]) = (self.rest[own], self.pair(own));
        let length = a.distance(b);
        let compressed =
            ((rest - length) / (rest - GAMMA * rest).max(f32::MIN_POSITIVE)).clamp(0.0, MOST_COMPRESSED);
        // Other waves shrink with the ring that they go around.
        let room = (length / rest.max(f32::MIN_POSITIVE)).min(1.0);
        let whole = smooth(share / STRUCTURES_WHOLE);
        let outside = if outer { 1.0 - smooth((share - RIDGES_END) / (1.0 - RIDGES_END)) } else { 0.0 };
        // As high as the bell is thick there, and smooth where the rings of the apex have no room for waves.
        let height = self.form.compression as f32 * thickness * compressed * outside;
        Ring {
            centre: frame.of(centre).to_array(),
            half: frame.of(half).to_array(),
            side: (z * radius).to_array(),
            out: out.map(|v| v.to_array()),
            structure: self.form.structure as f32 * theta * whole * room,
            ridges: height * KAPPA * whole,
            thicker: height * ETA,
            noise: self.form.noise as f32 * theta * share * room,
            thickness,
        }
    }

    /// Makes all vertices, [`Form::bell_vertices`] of them, relative to `origin` (in the slice's plane, m),
    /// at a time [s] of the sea.
    pub fn write(
        &mut self,
        level: Level,
        chain: impl Iterator<Item = DVec2>,
        origin: DVec2,
        frame: &Frame,
        time: f64,
        into: &mut [DrawVertex],
    ) {
        self.profile(level, chain, origin);
        self.noise.set_time(time);
        reef_flow::dispatch!(level, simd => self.wide(simd, frame, into));
    }

    #[inline(always)]
    fn wide<S: Simd>(&mut self, simd: S, frame: &Frame, into: &mut [DrawVertex]) {
        let (rings, around) = (self.form.rings, self.form.around);
        for ring in 0..rings {
            let shared = self.ring(ring, frame);
            let place = self.form.place(ring) as f32;
            let noise = self.noise.ring(if place < 0.5 { 2.0 * place } else { 2.0 * (1.0 - place) });
            self.turn(simd, ring + 1, &shared, &noise);
            self.rows.close(ring + 1);
        }
        let ends = [2 * rings, 2 * rings + 1].map(|at| frame.of(self.sample(at)));
        self.rows.gather(0, ends[0].to_array());
        self.rows.gather(rings + 1, ends[1].to_array());
        let (body, apices) = into.split_at_mut(rings * around);
        for (ring, into) in body.chunks_exact_mut(around).enumerate() {
            self.rows.emit(simd, ring + 1, into);
        }
        for ((vertex, end), ring) in apices.iter_mut().zip(ends).zip([1, rings]) {
            let at = |j: usize| {
                Vec3::from(core::array::from_fn(|part| self.rows.data[self.rows.at(ring, part) + j]))
            };
            let across = (at(around / 4) - at(3 * around / 4)).cross(at(0) - at(around / 2));
            let normal = if ring == 1 { across } else { -across };
            *vertex = DrawVertex {
                position: end.to_array(),
                normal: pack_normal(normal.to_array()),
                thickness: self.thickness_at(0.0),
            };
        }
    }

    /// The places of a ring.
    #[inline(always)]
    fn turn<S: Simd>(&mut self, simd: S, row: usize, ring: &Ring, noise: &RingNoise) {
        let around = self.form.around;
        let cell = around / AROUND;
        let [cosines, sines, structures, ridges] = &self.tables;
        let one = splat(simd, 1.0);
        let out_parts = [
            splat3(simd, ring.out[0]),
            splat3(simd, ring.out[1]),
            splat3(simd, ring.out[2]),
            splat3(simd, ring.out[3]),
            splat3(simd, ring.out[4]),
        ];
        let (centre, half, side) =
            (splat3(simd, ring.centre), splat3(simd, ring.half), splat3(simd, ring.side));
        let (structure, height) = (splat(simd, ring.structure), splat(simd, ring.noise));
        let (rise, thicker) = (splat(simd, ring.ridges), splat(simd, ring.thicker));
        let thickness = splat(simd, ring.thickness);
        let first = self.rows.at(row, 0);
        let stride = self.rows.stride();
        let data = &mut self.rows.data[first..first + 4 * stride - WIDTH];
        for j in (0..around).step_by(WIDTH) {
            let (cos, sin) = (load(simd, cosines, j), load(simd, sines, j));
            let (line, through) = (j / cell, j % cell);
            let (near, far) = (noise[line], noise[(line + 1) % AROUND]);
            let (y, share) = (load(simd, &self.cells[0], through), load(simd, &self.cells[1], through));
            let a = mul_add(splat(simd, near[1]), y, splat(simd, near[0]));
            let b = mul_add(splat(simd, far[1]), y - one, splat(simd, far[0]));
            let noise = mul_add(share, b - a, a);
            let ridge = mul_add(load(simd, ridges, j), rise, thicker);
            let moved = mul_add(load(simd, structures, j), structure, mul_add(noise, height, ridge));
            let (cos_cos, sin_cos) = (cos * cos, sin * cos);
            for part in 0..3 {
                let mut out = mul_add(out_parts[1][part], cos, out_parts[0][part]);
                out = mul_add(out_parts[2][part], cos_cos, out);
                out = mul_add(out_parts[3][part], sin, out);
                out = mul_add(out_parts[4][part], sin_cos, out);
                let place = mul_add(half[part], cos, mul_add(side[part], sin, centre[part]));
                let at = part * stride + j;
                mul_add(out, moved, place).store_slice(&mut data[at..at + WIDTH]);
            }
            let at = 3 * stride + j;
            (thickness + ridge).store_slice(&mut data[at..at + WIDTH]);
        }
    }
}

#[inline(always)]
fn load<S: Simd>(simd: S, table: &[f32], j: usize) -> f32x8<S> {
    f32x8::from_slice(simd, &table[j..j + WIDTH])
}

/// 0 up to 0, 1 from 1 on, smooth in between.
fn smooth(u: f32) -> f32 {
    let u = u.clamp(0.0, 1.0);
    u * u * (3.0 - 2.0 * u)
}
