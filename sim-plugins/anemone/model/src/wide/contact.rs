//! Rocks and ground push nodes out (the penalty that §6 of the paper asks for): a node and its radius form
//! one end of a capsule, and each length of overlap costs a force.

use fearless_simd::{Select, Simd, f32x16, prelude::*};
use reef_flow::simd::splat16 as splat;

use super::{
    Sixteen,
    kernel::{Vector, add_scaled, dot, load, load3, splat3, sub_scaled},
};

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

/// The ground near each of sixteen fibres, as the plane under its own plant: everything below is forbidden.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(align(64))]
pub struct Ground {
    /// Unit, upward.
    pub normal: [Sixteen; 3],
    /// normal · p of its points, relative to the chunk's anchor [m].
    pub height: Sixteen,
}

/// What a chunk's nodes may touch.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Contacts {
    /// Rocks near the plant.
    pub capsules: Vec<Capsule>,
    /// The ground, one entry a group of sixteen fibres; empty: none.
    pub ground: Vec<Ground>,
    /// [`Contacts::ROOTED`] for each node that stands in the ground at rest, so that the ground does not push
    /// it, else 0: segment by segment, all groups of a segment side by side. Empty: none does.
    pub rooted: Vec<Sixteen>,
}

impl Contacts {
    /// Deeper [m] than any node lies.
    pub const ROOTED: f32 = 1e30;

    /// Nothing to touch.
    pub fn is_empty(&self) -> bool {
        self.capsules.is_empty() && self.ground.is_empty()
    }
}

/// 1 for each of sixteen balls (relative to the chunk's anchor) of group `group` that reaches something, else
/// 0.
#[inline(always)]
pub(crate) fn may_touch<S: Simd>(
    simd: S,
    contacts: &Contacts,
    group: usize,
    center: Vector<S>,
    reach: f32x16<S>,
) -> f32x16<S> {
    let (zero, one) = (splat(simd, 0.0), splat(simd, 1.0));
    let mut near = zero;
    if let Some(ground) = contacts.ground.get(group) {
        near = height_over(simd, ground, center).simd_lt(reach).select(one, zero);
    }
    for capsule in &contacts.capsules {
        let (_, distance) = from_axis(simd, capsule, center);
        near = distance.simd_lt(reach + splat(simd, capsule.radius)).select(one, near);
    }
    near
}

/// Sum over all contacts of (overlap) · (outward normal) [m] of sixteen nodes of radius `radius`, at the ends
/// of the segments at `segment`, `group`.
#[inline(always)]
pub(crate) fn overlap<S: Simd>(
    simd: S,
    contacts: &Contacts,
    (segment, group): (usize, usize),
    place: Vector<S>,
    radius: f32x16<S>,
) -> Vector<S> {
    let zero = splat(simd, 0.0);
    let mut push = [zero; 3];
    if let Some(ground) = contacts.ground.get(group) {
        let n = load3(simd, &ground.normal);
        let mut depth = radius - height_over(simd, ground, place);
        if let Some(rooted) = contacts.rooted.get(segment * contacts.ground.len() + group) {
            depth -= load(simd, rooted);
        }
        let depth = depth.max(zero);
        push = [n[0] * depth, n[1] * depth, n[2] * depth];
    }
    for capsule in &contacts.capsules {
        let (off, distance) = from_axis(simd, capsule, place);
        let depth = (radius + splat(simd, capsule.radius) - distance).max(zero);
        // On the axis itself there is no way out to prefer: no push.
        push = add_scaled(push, off, depth / distance.max(splat(simd, 1e-9)));
    }
    push
}

#[inline(always)]
fn height_over<S: Simd>(simd: S, ground: &Ground, place: Vector<S>) -> f32x16<S> {
    dot(load3(simd, &ground.normal), place) - load(simd, &ground.height)
}

/// From the nearest point of a capsule's axis, and how far that is.
#[inline(always)]
fn from_axis<S: Simd>(simd: S, capsule: &Capsule, place: Vector<S>) -> (Vector<S>, f32x16<S>) {
    let [dx, dy, dz] = capsule.delta;
    let inverse = 1.0 / (dx * dx + dy * dy + dz * dz).max(1e-12);
    let from = splat3(simd, capsule.from);
    let p = [place[0] - from[0], place[1] - from[1], place[2] - from[2]];
    let d = splat3(simd, capsule.delta);
    let along = dot(d, p) * splat(simd, inverse);
    let along = along.max(splat(simd, 0.0)).min(splat(simd, 1.0));
    let off = sub_scaled(p, d, along);
    (off, dot(off, off).sqrt())
}
