//! The least that orbits can cost: eq. (2) for deep water over hot data, and nothing else — no bed, no
//! bounds, no selection. `reef bench waves` takes [`Bare`] as the ceiling that everything else is measured
//! against; [`Scalar`] is the same one centre and one train at a time in plain f32 with the system's
//! functions.

use core::f64::consts::{LOG2_E, PI};

use fearless_simd::{Simd, f32x8, f32x16};
use reef_abi as abi;

use super::trig::{exp2_down, sin_cos_half_turns};
use crate::{
    Level, dispatch,
    simd::{Lanes, mul_add},
};

/// Centres: with what comes out they fit into the first cache.
const POINTS: usize = 512;

/// One train, multiplied out.
#[derive(Clone, Copy, Debug)]
struct Train {
    half_turns: [f32; 2],
    phase: f32,
    decay: f32,
    across: [f32; 2],
    up: f32,
    across_speed: [f32; 2],
    down_speed: f32,
}

/// Centres, and where they are and how fast: x, y, z, then positions, then velocities.
#[derive(Clone, Debug)]
struct Data {
    arrays: [Vec<f32>; 9],
}

impl Data {
    /// Centres spread over 10 × 1 × 10 m below the surface, by the plastic number's sequence.
    fn new() -> Self {
        let spread = |factor: f64, from: f32, size: f32| {
            (0..POINTS).map(|i| from + size * (i as f64 * factor).fract() as f32).collect()
        };
        let centers: [Vec<f32>; 3] = [
            spread(0.754_877_666_246_692_8, -5.0, 10.0),
            spread(0.618_033_988_749_894_9, -1.5, 1.0),
            spread(0.569_840_290_998_053_3, -5.0, 10.0),
        ];
        let [x, y, z] = centers;
        let none = || vec![0.0; POINTS];
        Self { arrays: [x, y, z, none(), none(), none(), none(), none(), none()] }
    }
}

/// Eight or sixteen lanes of it.
#[derive(Clone, Debug)]
pub struct Bare {
    trains: Vec<Train>,
    data: Data,
}

impl Bare {
    /// Under these trains.
    pub fn new(waves: &[abi::Wave]) -> Self {
        Self { trains: waves.iter().map(train).collect(), data: Data::new() }
    }

    /// Pairs of a centre and a train that one [`Bare::step`] evaluates.
    pub fn evaluations(&self) -> usize {
        POINTS * self.trains.len()
    }

    /// Position and velocity of every centre.
    pub fn step(&mut self, level: Level) {
        dispatch!(level, simd => {
            if matches!(simd.level(), fearless_simd::Level::Avx512(_)) {
                step::<_, f32x16<_>, 16>(simd, &self.trains, &mut self.data);
            } else {
                step::<_, f32x8<_>, 8>(simd, &self.trains, &mut self.data);
            }
        });
    }

    /// Position [m] and velocity [m/s] of a centre after the last step.
    pub fn state(&self, point: usize) -> [f32; 6] {
        core::array::from_fn(|i| self.data.arrays[3 + i][point])
    }
}

fn train(wave: &abi::Wave) -> Train {
    let [r, k, omega] = [wave.amplitude, wave.wave_number, wave.frequency].map(f64::from);
    let [x, z] = wave.direction.map(f64::from);
    Train {
        half_turns: [(k * x / PI) as f32, (k * z / PI) as f32],
        phase: (f64::from(wave.phase) / PI) as f32,
        decay: (k * LOG2_E) as f32,
        across: [(r * x) as f32, (r * z) as f32],
        up: r as f32,
        across_speed: [(omega * r * x) as f32, (omega * r * z) as f32],
        down_speed: (-omega * r) as f32,
    }
}

#[inline(always)]
fn step<S: Simd, V: Lanes<S>, const WIDTH: usize>(simd: S, trains: &[Train], data: &mut Data) {
    let [x, y, z, px, py, pz, vx, vy, vz] = &mut data.arrays;
    for first in (0..POINTS).step_by(WIDTH) {
        let here = first..first + WIDTH;
        let x = V::from_slice(simd, &x[here.clone()]);
        let y = V::from_slice(simd, &y[here.clone()]);
        let z = V::from_slice(simd, &z[here.clone()]);
        let (mut p, mut v) = ([x, y, z], [V::splat(simd, 0.0); 3]);
        for train in trains {
            let half_turns = mul_add(V::splat(simd, train.half_turns[1]), z, V::splat(simd, train.phase));
            let (s, c) = sin_cos_half_turns(mul_add(V::splat(simd, train.half_turns[0]), x, half_turns));
            let e = exp2_down(V::splat(simd, train.decay) * y);
            let (s, c) = (s * e, c * e);
            p[0] = mul_add(V::splat(simd, train.across[0]), c, p[0]);
            p[1] = mul_add(V::splat(simd, train.up), s, p[1]);
            p[2] = mul_add(V::splat(simd, train.across[1]), c, p[2]);
            v[0] = mul_add(V::splat(simd, train.across_speed[0]), s, v[0]);
            v[1] = mul_add(V::splat(simd, train.down_speed), c, v[1]);
            v[2] = mul_add(V::splat(simd, train.across_speed[1]), s, v[2]);
        }
        p[0].store_slice(&mut px[here.clone()]);
        p[1].store_slice(&mut py[here.clone()]);
        p[2].store_slice(&mut pz[here.clone()]);
        v[0].store_slice(&mut vx[here.clone()]);
        v[1].store_slice(&mut vy[here.clone()]);
        v[2].store_slice(&mut vz[here.clone()]);
    }
}

/// One centre and one train at a time.
#[derive(Clone, Debug)]
pub struct Scalar {
    waves: Vec<abi::Wave>,
    data: Data,
}

impl Scalar {
    /// Under these trains.
    pub fn new(waves: &[abi::Wave]) -> Self {
        Self { waves: waves.to_vec(), data: Data::new() }
    }

    /// Pairs of a centre and a train that one [`Scalar::step`] evaluates.
    pub fn evaluations(&self) -> usize {
        POINTS * self.waves.len()
    }

    /// Position and velocity of every centre.
    pub fn step(&mut self) {
        let [xs, ys, zs, px, py, pz, vx, vy, vz] = &mut self.data.arrays;
        for i in 0..POINTS {
            let (x, y, z) = (xs[i], ys[i], zs[i]);
            let (mut p, mut v) = ([x, y, z], [0.0; 3]);
            for wave in &self.waves {
                let [way_x, way_z] = wave.direction;
                let angle = wave.wave_number * (x * way_x + z * way_z) + wave.phase;
                let (s, c) = angle.sin_cos();
                let r = wave.amplitude * (wave.wave_number * y).exp();
                p[0] += way_x * r * c;
                p[1] += r * s;
                p[2] += way_z * r * c;
                let speed = r * wave.frequency;
                v[0] += way_x * speed * s;
                v[1] -= speed * c;
                v[2] += way_z * speed * s;
            }
            (px[i], py[i], pz[i]) = (p[0], p[1], p[2]);
            (vx[i], vy[i], vz[i]) = (v[0], v[1], v[2]);
        }
    }

    /// Position [m] and velocity [m/s] of a centre after the last step.
    pub fn state(&self, point: usize) -> [f32; 6] {
        core::array::from_fn(|i| self.data.arrays[3 + i][point])
    }
}
