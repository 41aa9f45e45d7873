//! Waves and the orbits below them (Coulais et al. 2005, §3.2 and §3.3.1), held against linear theory.

use core::f64::consts::TAU;

use fearless_simd::{f32x8, prelude::*};
use reef_abi as abi;
use reef_flow::{
    Level,
    sample::Points,
    waves::{self, Carried, Orbit, Train, Trains, WindSea, dispersion},
};

use crate::common::Random;

mod orbits;
mod selection;
mod spectrum;

/// One train along θ, with k from ω or ω from k.
fn single(amplitude: f64, wave_number: f64, depth: f64, heading: f64) -> Train {
    let frequency = dispersion::frequency(wave_number, depth);
    Train { amplitude, wave_number, frequency, heading, phase: 0.7 }
}

fn wind_sea(wind: f64, depth: f64, trains: u32, seed: u64) -> Vec<Train> {
    let mut random = Random(seed);
    let sea = WindSea { wind, heading: 0.4, depth, trains };
    sea.trains(&mut || random.unit()).expect("a sound wind sea")
}

fn at(trains: &[Train], time: f64) -> Vec<abi::Wave> {
    trains.iter().map(|train| train.at(time)).collect()
}

/// Displacement, velocity and acceleration at points relative to `origin`, through the wide kernel.
fn orbits(
    level: Level,
    waves: &[abi::Wave],
    depth: f64,
    origin: [f64; 3],
    points: &[[f32; 3]],
) -> Vec<[[f32; 3]; 3]> {
    let mut trains = Trains::new();
    trains.fill(waves, depth, origin);
    let mut all = Vec::new();
    for group in points.chunks(8) {
        let lanes = |axis: usize| core::array::from_fn(|i| group.get(i).map_or(0.0, |p| p[axis]));
        let (x, y, z): ([f32; 8], [f32; 8], [f32; 8]) = (lanes(0), lanes(1), lanes(2));
        let nine: [[f32; 8]; 9] = reef_flow::dispatch!(level, simd => {
            let p = [f32x8::simd_from(simd, x), f32x8::simd_from(simd, y), f32x8::simd_from(simd, z)];
            let Orbit { displacement: [dx, dy, dz], velocity: [vx, vy, vz], acceleration: [ax, ay, az] } =
                waves::orbit(simd, &trains, usize::MAX, p);
            [dx.into(), dy.into(), dz.into(), vx.into(), vy.into(), vz.into(), ax.into(), ay.into(), az.into()]
        });
        all.extend(
            (0..group.len()).map(|i| [0, 3, 6].map(|first| [0, 1, 2].map(|axis| nine[first + axis][i]))),
        );
    }
    all
}

fn orbit(waves: &[abi::Wave], depth: f64, p: [f64; 3]) -> [[f64; 3]; 3] {
    orbits(Level::best(), waves, depth, [0.0; 3], &[p.map(|c| c as f32)])[0].map(|v| v.map(f64::from))
}

fn length(v: [f64; 3]) -> f64 {
    v.iter().map(|c| c * c).sum::<f64>().sqrt()
}

/// The positions of one period, along the heading and upward.
fn path(train: &Train, depth: f64, p: [f64; 3]) -> Vec<[f64; 2]> {
    let (sine, cosine) = train.heading.sin_cos();
    (0..=64)
        .map(|i| {
            let time = TAU / train.frequency * f64::from(i) / 64.0;
            let [d, _, _] = orbit(&[train.at(time)], depth, p);
            assert!((d[0] * sine - d[2] * cosine).abs() < 1e-6 * length(d), "nothing moves across");
            [d[0] * cosine + d[2] * sine, d[1]]
        })
        .collect()
}

/// Greatest excursion along the heading and upward.
fn axes(path: &[[f64; 2]]) -> [f64; 2] {
    [0, 1].map(|axis| path.iter().map(|p| p[axis].abs()).fold(0.0, f64::max))
}

/// The nine slices' way: positions, then velocities.
fn carried(level: Level, trains: &Trains, count: usize, [x, y, z]: [&[f32]; 3]) -> [Vec<f32>; 6] {
    let mut out: [Vec<f32>; 6] = core::array::from_fn(|_| vec![f32::NAN; x.len()]);
    let [px, py, pz, vx, vy, vz] = &mut out;
    let to = Carried { position: [px, py, pz], velocity: [vx, vy, vz] };
    waves::carry(level, trains, count, Points { x, y, z }, to);
    out
}
