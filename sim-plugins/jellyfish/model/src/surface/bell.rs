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
    disc::{Disc, Frame},
    form::Form,
    noise::{AROUND, Noise, RingNoise, fade},
    normals::Rows,
    profile::Profile,
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

/// What all vertices of a ring have in common.
#[derive(Clone, Copy, Debug, Default)]
struct Ring {
    disc: Disc,
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
    noise: Noise,
    /// cos, sin, and the waves of eqs. (2) and (4), around a ring.
    tables: [Vec<f32>; 4],
    /// The way through a cell of the noise, and its blend.
    cells: [Vec<f32>; 2],
    /// Distance of the pair of each ring at rest [m].
    rest: Vec<f32>,
    /// Of each slice: one, or two at right angles.
    profiles: Vec<Profile>,
    rows: Rows,
}

impl Bell {
    /// For a chain of so many points, and its shape at rest [m]; of one slice, or of two at right angles.
    ///
    /// # Errors
    /// As [`Form::check`].
    pub fn new(
        form: Form,
        thickness: f64,
        (rest, slices): (&[DVec2], usize),
        seed: u64,
    ) -> Result<Self, String> {
        form.check()?;
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
        let mut profile = Profile::new(&form, thickness, rest.len());
        profile.take(Level::best(), rest.iter().copied(), DVec2::ZERO);
        Ok(Self {
            thickness: thickness as f32,
            noise: Noise::new(seed),
            tables,
            cells: [
                (0..cell).map(|j| through(j) as f32).collect(),
                (0..cell).map(|j| fade(through(j)) as f32).collect(),
            ],
            rest: (0..form.rings).map(|ring| width(&profile, ring)).collect(),
            profiles: vec![profile; slices],
            rows: Rows::new(form.rings + 2, form.around),
            form,
        })
    }

    /// What it looks like.
    pub fn form(&self) -> &Form {
        &self.form
    }

    /// What the vertices of a ring share; a frame for each slice.
    fn ring(&self, ring: usize, frames: &[Frame]) -> Ring {
        let place = self.form.place(ring) as f32;
        let outer = place < 0.5;
        let share = if outer { 2.0 * place } else { 2.0 * (1.0 - place) };
        let (disc, out) = match (&self.profiles[..], frames) {
            ([own, other], [x, z]) => crossed([own, other], ring, share, [x, z]),
            _ => turned(&self.profiles[0], ring, share, &frames[0]),
        };
        let theta = self.thickness;
        let thickness = self.profiles[0].thickness_at(share);
        // Eq. (4), read so that a relaxed bell is smooth. What contracts is the sub-umbrella there.
        let own = if outer { self.form.rings - 1 - ring } else { ring };
        let rest = self.rest[own];
        let lengths = self.profiles.iter().map(|profile| width(profile, own));
        let length = lengths.sum::<f32>() / self.profiles.len() as f32;
        let compressed =
            ((rest - length) / (rest - GAMMA * rest).max(f32::MIN_POSITIVE)).clamp(0.0, MOST_COMPRESSED);
        // Other waves shrink with the ring that they go around.
        let room = (length / rest.max(f32::MIN_POSITIVE)).min(1.0);
        let whole = smooth(share / STRUCTURES_WHOLE);
        let outside = if outer { 1.0 - smooth((share - RIDGES_END) / (1.0 - RIDGES_END)) } else { 0.0 };
        // As high as the bell is thick there, and smooth where the rings of the apex have no room for waves.
        let height = self.form.compression as f32 * thickness * compressed * outside;
        Ring {
            disc,
            out: out.map(|v| v.to_array()),
            structure: self.form.structure as f32 * theta * whole * room,
            ridges: height * KAPPA * whole,
            thicker: height * ETA,
            noise: self.form.noise as f32 * theta * share * room,
            thickness,
        }
    }

    /// Makes all vertices, [`Form::bell_vertices`] of them, at a time [s] of the sea. `slices`: the chain of
    /// each, the place that vertices are relative to (in its plane, m), and how it stands in the sea.
    pub fn write<C: Iterator<Item = DVec2>>(
        &mut self,
        level: Level,
        slices: impl IntoIterator<Item = (C, DVec2, Frame)>,
        time: f64,
        into: &mut [DrawVertex],
    ) {
        let mut frames = [Frame::default(); 2];
        let count = self.profiles.len();
        for ((profile, frame), (chain, origin, own)) in self.profiles.iter_mut().zip(&mut frames).zip(slices)
        {
            profile.take(level, chain, origin);
            *frame = own;
        }
        self.noise.set_time(time);
        reef_flow::dispatch!(level, simd => self.wide(simd, &frames[..count], into));
    }

    #[inline(always)]
    fn wide<S: Simd>(&mut self, simd: S, frames: &[Frame], into: &mut [DrawVertex]) {
        let (rings, around) = (self.form.rings, self.form.around);
        for ring in 0..rings {
            let shared = self.ring(ring, frames);
            let place = self.form.place(ring) as f32;
            let noise = self.noise.ring(if place < 0.5 { 2.0 * place } else { 2.0 * (1.0 - place) });
            if self.profiles.len() > 1 {
                self.turn::<S, true>(simd, ring + 1, &shared, &noise);
            } else {
                self.turn::<S, false>(simd, ring + 1, &shared, &noise);
            }
            self.rows.close(ring + 1);
        }
        let ends = [0, 1].map(|end| {
            let apices = self.profiles.iter().zip(frames).map(|(own, frame)| frame.of(own.apices()[end]));
            apices.reduce(|own, other| 0.5 * (own + other)).unwrap_or_default()
        });
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
                thickness: self.thickness,
            };
        }
    }

    /// The places of a ring, of two slices or of one.
    #[inline(always)]
    fn turn<S: Simd, const CROSSED: bool>(&mut self, simd: S, row: usize, ring: &Ring, noise: &RingNoise) {
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
        let Disc { centre, half, side, twist, .. } = ring.disc;
        // cos 2φ = 2 cos² φ − 1.
        let [centre, half, side, twist] =
            [centre - twist, half, side, 2.0 * twist].map(|part| splat3(simd, part.to_array()));
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
                let centre = if CROSSED { mul_add(twist[part], cos_cos, centre[part]) } else { centre[part] };
                let place = mul_add(half[part], cos, mul_add(side[part], sin, centre));
                let at = part * stride + j;
                mul_add(out, moved, place).store_slice(&mut data[at..at + WIDTH]);
            }
            let at = 3 * stride + j;
            (thickness + ridge).store_slice(&mut data[at..at + WIDTH]);
        }
    }
}

/// Distance of the points of a ring's pair [m].
fn width(profile: &Profile, ring: usize) -> f32 {
    let [a, b] = profile.pair(ring);
    a.distance(b)
}

/// Direction from the second point of a pair to the first.
fn along([a, b]: [Vec2; 2]) -> Vec2 {
    let half = 0.5 * (a - b);
    half / half.length().max(f32::MIN_POSITIVE)
}

/// Outward at the points of a pair that lie along `e`, across their disc and along its axis: the mean of both,
/// and by how much that on the side of positive x is more.
fn leans(profile: &Profile, e: Vec2, share: f32) -> [[f32; 2]; 2] {
    let axis = e.perp();
    let [right, left] = profile.outward(share);
    let (near, far) = ([e.dot(right), axis.dot(right)], [-e.dot(left), axis.dot(left)]);
    [
        [0.5 * (near[0] + far[0]), 0.5 * (near[1] + far[1])],
        [0.5 * (near[0] - far[0]), 0.5 * (near[1] - far[1])],
    ]
}

/// The disc of a ring, and outward around it as a sum over 1, cos, cos², sin and sin · cos.
fn turned(profile: &Profile, ring: usize, share: f32, frame: &Frame) -> (Disc, [Vec3; 5]) {
    let pair = profile.pair(ring);
    let e = along(pair);
    let [mean, tilt] = leans(profile, e, share);
    let (e, axis, z) = (frame.of(e), frame.of(e.perp()), frame.z);
    let out = [axis * mean[1], e * mean[0] + axis * tilt[1], e * tilt[0], z * mean[0], z * tilt[0]];
    (Disc::turned(pair, frame), out)
}

/// The same of two slices: outward as both do in the mean, and on each side of each as much more as there.
fn crossed([own, other]: [&Profile; 2], ring: usize, share: f32, frames: [&Frame; 2]) -> (Disc, [Vec3; 5]) {
    let pairs = [own.pair(ring), other.pair(ring)];
    let disc = Disc::crossed(pairs, frames);
    let [own, other] = [(own, pairs[0]), (other, pairs[1])];
    let [[mean, tilt], [crossing, across]] =
        [own, other].map(|(profile, pair)| leans(profile, along(pair), share));
    let e = disc.half.normalize_or(frames[0].x);
    let f = disc.aside;
    // x is half, z is side: y = z × x.
    let axis = f.cross(e).normalize_or(frames[0].y);
    let mean = [0.5 * (mean[0] + crossing[0]), 0.5 * (mean[1] + crossing[1])];
    // (e cos + f sin)(mean + tilt cos + across sin) + axis (…), with sin² = 1 − cos².
    let out = [
        axis * mean[1] + f * across[0],
        e * mean[0] + axis * tilt[1],
        e * tilt[0] - f * across[0],
        f * mean[0] + axis * across[1],
        f * tilt[0] + e * across[0],
    ];
    (disc, out)
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
