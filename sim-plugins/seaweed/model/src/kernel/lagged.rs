//! The procedural method (§4.3.2): the torque of the whole sub-branch at a segment's base, eq. (5), projected
//! on its two axes, over the stiffness, eq. (6), followed with a lag τ.
//!
//! Eq. (6) prints 1/m where by its place a stiffness stands: with k both methods have the same static
//! equilibrium. The forces act at the centres and (contact) ends of the segments, so these are their levers.
//!
//! A step goes the share s = 1 − exp(−dt/τ) of the way to the angles of eq. (6), unless that would go too
//! far: each joint turns all that stand on it, and a long branch that is stretched would swing ever wider.
//! With a bound R of how much the torques of all joints change when this one turns (Gershgorin's, for the
//! energy of springs and loads), s/k becomes min(s/k, 1/(k + R)): then no step adds energy, whatever k, the
//! loads and dt are.

use fearless_simd::{Simd, prelude::*};
use reef_flow::{
    math::exp,
    simd::{mul_add, splat},
};

use super::{Needs, Node, Pass, Row, Stand, pose};
use crate::{
    lanes::{Lane, add, add_scaled, cross, dot, length, load, load3, scale, store, store3},
    skeleton::{Above, GROUND},
};

/// What a sub-branch exerts at the base of its first segment.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Torque {
    force: [Lane; 3],
    torque: [Lane; 3],
    /// Σ |F| [N] and Σ |r||F| [N·m] of all that stands on it, and the sum of the latter over its segments.
    strength: Lane,
    lever: Lane,
    levers: Lane,
}

/// Walks from the tips to the roots.
#[inline(always)]
pub(super) fn gather<S: Simd>(
    simd: S,
    pass: &Pass<'_>,
    needs: Needs,
    stand: &Stand,
    rows: &[Row],
    (nodes, lags): (&mut [Node], &mut [Torque]),
) {
    let one = splat(simd, 1.0);
    let dt = load(simd, &pass.dt);
    let share = one - exp(dt * splat(simd, -1.0 / pass.lag.max(1e-6)));
    let size = load(simd, &stand.size);
    let stiff = size * size * size * load(simd, &stand.stiff);
    let base = pose::base(simd, stand);
    for (number, joint) in pass.joints.iter().enumerate() {
        if joint.above != Above::Nothing {
            lags[number] = Torque::default();
        }
    }
    for (number, (joint, row)) in pass.joints.iter().zip(rows).enumerate().rev() {
        let node = &nodes[number];
        let y = load3(simd, &node.y);
        let long = size * splat(simd, joint.length);
        let half = long * splat(simd, 0.5);
        let (own, touch) = (load3(simd, &node.force), load3(simd, &node.touch));
        let mut force = add(own, touch);
        let mut torque = cross(y, add_scaled(scale(own, half), touch, long));
        let (strong, touch_strength) = (length(own), length(touch));
        let mut strength = strong + touch_strength;
        let mut lever = mul_add(strong, half, touch_strength * long);
        // What touches something, or floats, holds against all joints on the way to it.
        let span = size * splat(simd, joint.span);
        let held = mul_add(load(simd, &node.touching), splat(simd, pass.contact), load(simd, &node.surface));
        let mut levers = held * splat(simd, joint.depth) * span * span;
        if joint.above != Above::Nothing {
            let lag = &lags[number];
            force = add(force, load3(simd, &lag.force));
            torque = add(torque, load3(simd, &lag.torque));
            strength += load(simd, &lag.strength);
            lever += load(simd, &lag.lever);
            levers += load(simd, &lag.levers);
        }
        levers += lever;
        let below = pose::below(simd, base, nodes, joint);
        let node = &mut nodes[number];
        if joint.tier + needs.level <= 2 {
            let k = stiff * splat(simd, joint.stiffness);
            let bound = mul_add(lever, splat(simd, joint.depth), levers);
            let gain = (share / k).min(one / (k + bound + bound));
            let bent = [
                load(simd, &row.theta) - load(simd, &row.theta_rest),
                load(simd, &row.phi) - load(simd, &row.phi_rest),
            ];
            let about = [dot(torque, below.y), dot(torque, load3(simd, &node.x))];
            store(&mut node.turn[0], (about[0] - k * bent[0]) * gain);
            store(&mut node.turn[1], (about[1] - k * bent[1]) * gain);
        }
        if joint.parent != GROUND {
            let height = size * splat(simd, joint.height);
            let parent = &mut lags[joint.parent as usize];
            let moved = add(torque, cross(scale(below.y, height), force));
            let sum = add(load3(simd, &parent.force), force);
            store3(&mut parent.force, sum);
            let sum = add(load3(simd, &parent.torque), moved);
            store3(&mut parent.torque, sum);
            let sum = load(simd, &parent.strength) + strength;
            store(&mut parent.strength, sum);
            let sum = load(simd, &parent.lever) + mul_add(height, strength, lever);
            store(&mut parent.lever, sum);
            let sum = load(simd, &parent.levers) + levers;
            store(&mut parent.levers, sum);
        }
    }
}
