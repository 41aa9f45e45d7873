//! Rocks and ground push nodes out (the penalty that §6 of the paper asks for): a node and its radius form one end of a
//! capsule, and each length of overlap costs a force.

use fearless_simd::{Simd, f32x16, prelude::*};
use reef_flow::simd::{mul_add, neg_mul_add, splat16 as splat};

use super::kernel::splat3;

/// A capsule that nothing should enter, relative to the chunk's anchor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Capsule {
    /// One end of its axis [m].
    pub from: [f32; 3],
    /// From there to the other end [m].
    pub delta: [f32; 3],
    /// [m]
    pub radius: f32,
}

/// The ground near a plant: everything below is forbidden.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Unit, upward.
    pub normal: [f32; 3],
    /// normal · p of its points, relative to the chunk's anchor [m].
    pub height: f32,
}

/// What a chunk's nodes may touch.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Contacts {
    /// Rocks near the plant.
    pub capsules: Vec<Capsule>,
    /// The ground.
    pub ground: Option<Plane>,
}

impl Contacts {
    /// Nothing to touch.
    pub fn is_empty(&self) -> bool {
        self.capsules.is_empty() && self.ground.is_none()
    }
}

/// Sum over all contacts of (overlap) · (outward normal) [m] of sixteen nodes of radius `radius`.
#[inline(always)]
pub(crate) fn overlap<S: Simd>(
    simd: S,
    contacts: &Contacts,
    [x, y, z]: [f32x16<S>; 3],
    radius: f32x16<S>,
) -> [f32x16<S>; 3] {
    let zero = splat(simd, 0.0);
    let mut push = [zero; 3];
    if let Some(plane) = &contacts.ground {
        let n = splat3(simd, plane.normal);
        let height = mul_add(n[2], z, mul_add(n[1], y, n[0] * x)) - splat(simd, plane.height);
        let depth = (radius - height).max(zero);
        push = [n[0] * depth, n[1] * depth, n[2] * depth];
    }
    for capsule in &contacts.capsules {
        let [dx, dy, dz] = capsule.delta;
        let inverse = 1.0 / (dx * dx + dy * dy + dz * dz).max(1e-12);
        let from = capsule.from;
        let p = [x - splat(simd, from[0]), y - splat(simd, from[1]), z - splat(simd, from[2])];
        let d = splat3(simd, capsule.delta);
        let along = mul_add(d[2], p[2], mul_add(d[1], p[1], d[0] * p[0])) * splat(simd, inverse);
        let along = along.max(zero).min(splat(simd, 1.0));
        let off =
            [neg_mul_add(d[0], along, p[0]), neg_mul_add(d[1], along, p[1]), neg_mul_add(d[2], along, p[2])];
        let distance = mul_add(off[2], off[2], mul_add(off[1], off[1], off[0] * off[0])).sqrt();
        let depth = (radius + splat(simd, capsule.radius) - distance).max(zero);
        // On the axis itself there is no way out to prefer: no push.
        let scale = depth / distance.max(splat(simd, 1e-9));
        push = [
            mul_add(off[0], scale, push[0]),
            mul_add(off[1], scale, push[1]),
            mul_add(off[2], scale, push[2]),
        ];
    }
    push
}
