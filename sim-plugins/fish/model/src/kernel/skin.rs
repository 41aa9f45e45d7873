//! What the water exerts on the skin: f = −μ S max(0, n·u) n on each outer face.

use fearless_simd::{Select, Simd, prelude::*};
use reef_flow::simd::splat;

use super::{Fish8, Plan, Room, springs::SHORTEST2};
use crate::lanes::{Lane, add, cross, dot, load, load3, scale, store, store3, sub};

/// Impulses of all faces in a sub-step of `dt`, shared by their nodes, and with `MATRIX` their part of the
/// matrix.
#[inline(always)]
pub(super) fn push<S: Simd, const MATRIX: bool>(
    simd: S,
    plan: &Plan,
    dt: fearless_simd::f32x8<S>,
    fish: &Fish8,
    room: &mut Room,
    [positions, velocities]: [&[[Lane; 3]]; 2],
) {
    let (zero, one, half) = (splat(simd, 0.0), splat(simd, 1.0), splat(simd, 0.5));
    let water = load3(simd, &fish.water);
    let strength = dt * splat(simd, plan.water);
    for skin in &plan.skins {
        let nodes = skin.nodes.map(|node| node as usize);
        let [a, b, c, d] = [
            load3(simd, &positions[nodes[0]]),
            load3(simd, &positions[nodes[1]]),
            load3(simd, &positions[nodes[2]]),
            load3(simd, &positions[nodes[3]]),
        ];
        let mut moving = add(load3(simd, &velocities[nodes[0]]), load3(simd, &velocities[nodes[1]]));
        moving = add(moving, load3(simd, &velocities[nodes[2]]));
        let (doubled, share) = if skin.four {
            moving = add(moving, load3(simd, &velocities[nodes[3]]));
            (cross(sub(c, a), sub(d, b)), 0.25)
        } else {
            (cross(sub(b, a), sub(c, a)), 1.0 / 3.0)
        };
        let share = splat(simd, share);
        let area = scale(doubled, half);
        let u = sub(scale(moving, share), water);
        let size = dot(area, area).max(splat(simd, SHORTEST2 * SHORTEST2)).sqrt();
        let meets = dot(area, u);
        // μ dt / S where the face meets water, else 0.
        let drag = meets.simd_gt(zero).select(strength * (one / size), zero) * share;
        let impulse = scale(area, drag * meets);
        let count = if skin.four { 4 } else { 3 };
        for node in &nodes[..count] {
            let into = &mut room.impulse[*node];
            let less = sub(load3(simd, into), impulse);
            store3(into, less);
        }
        if MATRIX {
            let m = scale(area, drag * share);
            let block = [
                m[0] * area[0],
                m[0] * area[1],
                m[0] * area[2],
                m[1] * area[1],
                m[1] * area[2],
                m[2] * area[2],
            ];
            for node in &nodes[..count] {
                add_block(simd, &mut room.own[*node], block);
            }
            for pair in &skin.blocks[..if skin.four { 6 } else { 3 }] {
                add_block(simd, &mut room.off[*pair as usize], block);
            }
        }
    }
}

/// Adds to a block of the matrix.
#[inline(always)]
pub(super) fn add_block<S: Simd>(simd: S, into: &mut [Lane; 6], block: [fearless_simd::f32x8<S>; 6]) {
    for i in 0..6 {
        let sum = load(simd, &into[i]) + block[i];
        store(&mut into[i], sum);
    }
}
