//! What is not seen otherwise, as lines: the boxes, and the orbits on which the waves carry particles.

use core::f64::consts::TAU;

use reef_flow::{
    Level,
    math::reduce_phase,
    sample::Points,
    waves::{Carried, Trains, carry},
};
use reef_sdk::abi::{DebugLine, Wave};

use crate::cloud::Cloud;

/// Channel and colour of the boxes' edges.
const BOXES: (u32, u32) = (0, 0xffc8_a84a);
/// Channel and colour of the orbits.
const ORBITS: (u32, u32) = (1, 0xff5a_e0ff);
/// Orbits of a box at most, and lines of one.
const MOST_ORBITS: usize = 256;
const SIDES: usize = 48;

/// Edges of all boxes, and the way of the first particles of each over one period of the greatest train.
pub(crate) fn lines(cloud: &Cloud, waves: &[Wave], depth: f64, level: Level) -> Vec<DebugLine> {
    let mut lines = Vec::new();
    for number in 0..cloud.box_count() {
        let Some(plan) = cloud.plan(number) else { continue };
        edges(plan.center, plan.extent, &mut lines);
        let count = cloud.particles(number).min(MOST_ORBITS);
        let centers: Vec<_> = (0..count).filter_map(|i| cloud.center(number, i)).collect();
        let Some(frequency) = waves.first().map(|wave| f64::from(wave.frequency)).filter(|f| *f > 0.0) else {
            continue;
        };
        let axis = |i: usize| -> Vec<f32> { centers.iter().map(|c| c[i] as f32).collect() };
        let (x, y, z) = (axis(0), axis(1), axis(2));
        let mut way = vec![vec![[0.0_f32; 3]; centers.len()]; SIDES + 1];
        let mut trains = Trains::new();
        for (side, points) in way.iter_mut().enumerate() {
            let later = side as f64 / SIDES as f64 * TAU / frequency;
            let then: Vec<Wave> = waves
                .iter()
                .map(|wave| {
                    let phase = f64::from(wave.phase) - f64::from(wave.frequency) * later;
                    Wave { phase: reduce_phase(phase) as f32, ..*wave }
                })
                .collect();
            trains.fill(&then, depth, plan.center);
            let mut at: [Vec<f32>; 3] = core::array::from_fn(|_| vec![0.0; centers.len()]);
            let mut speed = at.clone();
            let ([px, py, pz], [vx, vy, vz]) = (&mut at, &mut speed);
            let out = Carried { position: [px, py, pz], velocity: [vx, vy, vz] };
            carry(level, &trains, usize::MAX, Points { x: &x, y: &y, z: &z }, out);
            for (i, point) in points.iter_mut().enumerate() {
                *point = [at[0][i], at[1][i], at[2][i]];
            }
        }
        for pair in way.windows(2) {
            for (from, to) in pair[0].iter().zip(&pair[1]) {
                lines.push(DebugLine {
                    from: core::array::from_fn(|i| plan.center[i] + f64::from(from[i])),
                    delta: core::array::from_fn(|i| to[i] - from[i]),
                    color: ORBITS.1,
                    channel: ORBITS.0,
                    ..DebugLine::default()
                });
            }
        }
    }
    lines
}

/// The twelve edges of a box.
fn edges(center: [f64; 3], extent: [f64; 3], lines: &mut Vec<DebugLine>) {
    for axis in 0..3 {
        for corner in 0..4 {
            let mut from: [f64; 3] = core::array::from_fn(|i| center[i] - 0.5 * extent[i]);
            let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
            from[a] += f64::from(corner & 1) * extent[a];
            from[b] += f64::from(corner >> 1) * extent[b];
            let mut delta = [0.0; 3];
            delta[axis] = extent[axis] as f32;
            lines.push(DebugLine { from, delta, color: BOXES.1, channel: BOXES.0, ..DebugLine::default() });
        }
    }
}
