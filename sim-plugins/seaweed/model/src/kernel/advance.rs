//! The new angles, from the roots to the tips, and what the whole plant does.

use fearless_simd::{Select, Simd, f32x8, prelude::*};
use reef_flow::simd::{clamp, splat};

use super::{Needs, Node, Pass, Row, Stand, pose, solve};
use crate::{
    lanes::{Lane, add, add_scaled, cross, load, load3, mix, scale, store, store3, sub},
    skeleton::GROUND,
};

/// No joint turns farther than this from its equilibrium [rad]: no segment folds through its parent.
pub(crate) const MOST_BEND: f32 = 2.6;
/// Nor farther than this in one step [rad].
const MOST_TURN: f32 = 1.0;

/// Turns all joints that the levels compute, and carries the others along.
#[inline(always)]
pub(super) fn advance<S: Simd>(
    simd: S,
    pass: &Pass<'_>,
    needs: Needs,
    stand: &mut Stand,
    rows: &mut [Row],
    nodes: &mut [Node],
) {
    let zero = splat(simd, 0.0);
    let dt = load(simd, &pass.dt);
    let rate = splat(simd, 1.0) / dt;
    let base = pose::base(simd, stand);
    let size = load(simd, &stand.size);
    let size3 = size * size * size;
    let share = load(simd, &stand.lagged);
    let weights = solve::weights(simd, stand);
    let (mut momentum, mut moment, mut mass) = ([zero; 3], [zero; 3], zero);
    let (mut low, mut high) = (base.origin, base.origin);
    for (number, (joint, row)) in pass.joints.iter().zip(rows).enumerate() {
        let below = pose::below(simd, base, nodes, joint);
        let (mut omega, mut speed) = ([zero; 3], [zero; 3]);
        if joint.parent != GROUND {
            let parent = &nodes[joint.parent as usize];
            omega = load3(simd, &parent.velocity);
            let height = size * splat(simd, joint.height);
            speed = add(load3(simd, &parent.acceleration), cross(omega, scale(below.y, height)));
        }
        let node = &mut nodes[number];
        let (x, y) = (load3(simd, &node.x), load3(simd, &node.y));
        if joint.tier + needs.level <= 2 {
            let weight = weights[usize::from(joint.tier)];
            for (at, axis) in [below.y, x].into_iter().enumerate() {
                let mut turn = zero;
                if needs.physical {
                    turn = dt * node.answers[at].rate(simd, omega, speed);
                }
                if needs.lagged {
                    let lagged = load(simd, &node.turn[at]);
                    turn = mix(simd, turn, lagged, share);
                }
                let (angle, rest) = match at {
                    0 => (&mut row.theta, load(simd, &row.theta_rest)),
                    _ => (&mut row.phi, load(simd, &row.phi_rest)),
                };
                let old = load(simd, angle);
                let most = splat(simd, MOST_TURN);
                turn = clamp(turn * weight, -most, most);
                let bend = splat(simd, MOST_BEND);
                turn = clamp(turn, rest - bend - old, rest + bend - old);
                keep(simd, (needs.full, dt), angle, old + turn);
                omega = add_scaled(omega, axis, turn * rate);
            }
        }
        store3(&mut node.velocity, omega);
        store3(&mut node.acceleration, speed);
        let long = size * splat(simd, joint.length);
        let arm = scale(y, long * splat(simd, 0.5));
        let center_speed = add(speed, cross(omega, arm));
        for i in 0..3 {
            keep(simd, (needs.full, dt), &mut row.omega[i], omega[i]);
            keep(simd, (needs.full, dt), &mut row.speed[i], center_speed[i]);
        }
        let here = load3(simd, &node.origin);
        let own = size3 * splat(simd, joint.mass);
        momentum = add_scaled(momentum, center_speed, own);
        moment = add_scaled(moment, add(here, arm), own);
        mass += own;
        let end = add_scaled(here, y, long);
        for i in 0..3 {
            low[i] = low[i].min(end[i]);
            high[i] = high[i].max(end[i]);
        }
    }
    let one = splat(simd, 1.0) / mass;
    let drift = scale(momentum, one);
    let change = scale(sub(drift, load3(simd, &stand.drift)), rate);
    let center = add_scaled(scale(moment, one), drift, dt);
    for i in 0..3 {
        keep(simd, (needs.full, dt), &mut stand.push[i], change[i]);
        keep(simd, (needs.full, dt), &mut stand.drift[i], drift[i]);
        keep(simd, (needs.full, dt), &mut stand.gravity[i], center[i]);
        keep(simd, (needs.full, dt), &mut stand.low[i], low[i]);
        keep(simd, (needs.full, dt), &mut stand.high[i], high[i]);
    }
}

/// Lanes that are not stepped keep what they had, whatever came out for them.
#[inline(always)]
fn keep<S: Simd>(simd: S, (full, dt): (bool, f32x8<S>), lane: &mut Lane, value: f32x8<S>) {
    if full {
        return store(lane, value);
    }
    let acts = dt.simd_gt(splat(simd, 0.0));
    store(lane, acts.select(value, load(simd, lane)));
}
