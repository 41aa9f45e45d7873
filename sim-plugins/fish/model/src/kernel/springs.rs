//! Springs, their damping, and muscles (§5.1, §5.5).

use fearless_simd::{Select, Simd, f32x8, prelude::*};
use reef_flow::{
    math::sin,
    simd::{clamp, mul_add, neg_mul_add, splat},
};

use super::{Fish8, Plan, Room, Times, skin::add_block, unit};
use crate::lanes::{add_scaled, dot, load, load3, scale, store, store3, sub, sub_scaled};

/// No spring is taken for shorter than this [m], squared.
pub(super) const SHORTEST2: f32 = 1e-18;

/// Which share of `force` the first group's turn has in each gap with muscles.
#[inline(always)]
pub(super) fn turns<S: Simd>(simd: S, plan: &Plan, fish: &Fish8, room: &mut Room) {
    let one = splat(simd, 1.0);
    let phase = load(simd, &fish.phase);
    let last = plan.gaps.saturating_sub(1).max(1) as f32;
    let edge = plan.beat.edge as f32;
    for (gap, into) in room.turns.iter_mut().enumerate().take(plan.gaps as usize) {
        let late = splat(simd, plan.beat.lag as f32 * gap as f32 / last);
        let at = phase - late;
        let sine = sin((at - at.floor()) * splat(simd, core::f32::consts::TAU));
        let share = if edge <= 0.0 {
            sine.simd_ge(splat(simd, 0.0)).select(one, splat(simd, 0.0))
        } else {
            let q = clamp(sine * splat(simd, 1.0 / edge), -one, one);
            let rounded = splat(simd, 0.25) * q * neg_mul_add(q, q, splat(simd, 3.0));
            rounded + splat(simd, 0.5)
        };
        store(into, share);
    }
}

/// What a muscle leaves of its rest length.
#[inline(always)]
fn shortened<S: Simd>(simd: S, muscle: &super::plan::Muscle, fish: &Fish8, room: &Room) -> f32x8<S> {
    let one = splat(simd, 1.0);
    let first = load(simd, &room.turns[muscle.gap as usize]);
    let share = if muscle.first { first } else { one - first };
    let bias = mul_add(
        load(simd, &fish.yaw),
        splat(simd, muscle.left),
        load(simd, &fish.pitch) * splat(simd, muscle.top),
    );
    let left = neg_mul_add(load(simd, &fish.force), share, one) - bias;
    left.max(splat(simd, 0.0))
}

/// Impulses of all springs in a sub-step, and with `MATRIX` their part of the matrix
/// M + dt C + dt² K: along a spring with its stiffness and damping, across it as far as it is stretched.
#[inline(always)]
pub(super) fn pull<S: Simd, const MATRIX: bool>(
    simd: S,
    plan: &Plan,
    times: Times<S>,
    fish: &Fish8,
    room: &mut Room,
    [positions, velocities]: [&[[crate::lanes::Lane; 3]]; 2],
) {
    let zero = splat(simd, 0.0);
    let damping = splat(simd, plan.damping);
    let Times { dt, dt2 } = times;
    let dt_damping = dt * damping;
    for spring in &plan.springs {
        let [a, b] = spring.ends.map(|end| end as usize);
        let across = sub(load3(simd, &positions[b]), load3(simd, &positions[a]));
        let apart = sub(load3(simd, &velocities[b]), load3(simd, &velocities[a]));
        let length = dot(across, across).max(splat(simd, SHORTEST2)).sqrt();
        let inverse = splat(simd, 1.0) / length;
        let n = scale(across, inverse);
        let mut rest = splat(simd, spring.rest);
        if let Some(muscle) = &spring.muscle {
            rest *= shortened(simd, muscle, fish, room);
        }
        let k = splat(simd, spring.stiffness);
        let longer = length - rest;
        let parting = dot(apart, n);
        let pull = mul_add(damping, parting, k * longer);
        let mut along = dt * pull;
        let mut push;
        if MATRIX {
            let stretched = (longer * inverse).max(zero);
            let beta = dt2 * k * stretched;
            let stiff = mul_add(dt2, k, -beta);
            along = mul_add(stiff, parting, along);
            push = add_scaled(scale(n, along), apart, beta);
            let m = scale(n, stiff + dt_damping);
            let block = [
                mul_add(m[0], n[0], beta),
                m[0] * n[1],
                m[0] * n[2],
                mul_add(m[1], n[1], beta),
                m[1] * n[2],
                mul_add(m[2], n[2], beta),
            ];
            let off = &mut room.off[spring.block as usize];
            for i in 0..6 {
                store(&mut off[i], -block[i]);
            }
            for end in [a, b] {
                add_block(simd, &mut room.own[end], block);
            }
        } else {
            push = scale(n, along);
        }
        let sum = load3(simd, &room.impulse[a]);
        store3(&mut room.impulse[a], crate::lanes::add(sum, push));
        push = sub(load3(simd, &room.impulse[b]), push);
        store3(&mut room.impulse[b], push);
    }
}

/// Begins a sub-step's impulses with what turns the fish upright: what floats is pushed up and what sinks
/// down, across the line between the two.
#[inline(always)]
pub(super) fn begin<S: Simd>(
    simd: S,
    plan: &Plan,
    dt: f32x8<S>,
    room: &mut Room,
    positions: &[[crate::lanes::Lane; 3]],
) {
    let zero = splat(simd, 0.0);
    let mut between = [zero; 3];
    for (at, lift) in positions.iter().zip(&plan.lift) {
        if *lift != 0.0 {
            between = add_scaled(between, load3(simd, at), splat(simd, *lift));
        }
    }
    let up = unit(simd, between);
    let strength = dt * splat(simd, plan.mass * plan.righting);
    let world = [zero, splat(simd, 1.0), zero];
    let tilt = scale(sub_scaled(world, up, up[1]), strength);
    for (impulse, lift) in room.impulse.iter_mut().zip(&plan.lift) {
        store3(impulse, scale(tilt, splat(simd, *lift)));
    }
}
