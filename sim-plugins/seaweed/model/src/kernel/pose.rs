//! Where the segments are (§4.2): from the angles to bases, parents first.

use fearless_simd::{Simd, f32x8, prelude::*};
use reef_flow::{
    math::sin_cos,
    simd::{mul_add, neg_mul_add},
};

use super::{Node, Pass, Row, Stand, loads::Acting};
use crate::{
    lanes::{Vector, add_scaled, cross, load, load3, store3},
    skeleton::{GROUND, Joint},
};

/// A base, and where it is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame<S: Simd> {
    pub(crate) x: Vector<S>,
    pub(crate) y: Vector<S>,
    pub(crate) origin: Vector<S>,
}

/// The base of a segment that stands on another: h up its Y, turned by θ about it and by φ about its own X.
#[inline(always)]
pub(crate) fn turned<S: Simd>(below: Frame<S>, height: f32x8<S>, theta: f32x8<S>, phi: f32x8<S>) -> Frame<S> {
    let z = cross(below.x, below.y);
    let (sin_theta, cos_theta) = sin_cos(theta);
    let (sin_phi, cos_phi) = sin_cos(phi);
    let (mut x, mut y) = (z, z);
    for i in 0..3 {
        x[i] = neg_mul_add(sin_theta, z[i], cos_theta * below.x[i]);
        let ahead = mul_add(sin_theta, below.x[i], cos_theta * z[i]);
        y[i] = mul_add(sin_phi, ahead, cos_phi * below.y[i]);
    }
    Frame { x, y, origin: add_scaled(below.origin, below.y, height) }
}

/// What the roots stand on.
#[inline(always)]
pub(crate) fn base<S: Simd>(simd: S, stand: &Stand) -> Frame<S> {
    let (x, y) = (load3(simd, &stand.x), load3(simd, &stand.y));
    Frame { x, y, origin: load3(simd, &stand.origin) }
}

/// The frame of a segment on top of its parent's.
#[inline(always)]
pub(crate) fn frame_of<S: Simd>(
    simd: S,
    below: Frame<S>,
    joint: &Joint,
    row: &Row,
    size: f32x8<S>,
) -> Frame<S> {
    let height = size * f32x8::splat(simd, joint.height);
    turned(below, height, load(simd, &row.theta), load(simd, &row.phi))
}

/// What a segment stands on.
#[inline(always)]
pub(super) fn below<S: Simd>(simd: S, base: Frame<S>, nodes: &[Node], joint: &Joint) -> Frame<S> {
    if joint.parent == GROUND {
        return base;
    }
    let node = &nodes[joint.parent as usize];
    Frame { x: load3(simd, &node.x), y: load3(simd, &node.y), origin: load3(simd, &node.origin) }
}

/// The frames of all segments.
#[inline(always)]
pub(super) fn pose<S: Simd>(simd: S, pass: &Pass<'_>, stand: &Stand, rows: &[Row], nodes: &mut [Node]) {
    let base = base(simd, stand);
    let size = load(simd, &stand.size);
    let mut last = base;
    for (number, (joint, row)) in pass.joints.iter().zip(rows).enumerate() {
        let below = if joint.only { last } else { below(simd, base, nodes, joint) };
        last = frame_of(simd, below, joint, row, size);
        last.store(&mut nodes[number]);
    }
}

/// The same, and what acts on each in its own water. (Not by a function that takes the rest of the loop: a
/// closure does not always inherit the vector instructions of where it stands.)
#[inline(always)]
pub(super) fn with_loads<S: Simd>(simd: S, pass: &Pass<'_>, stand: &Stand, rows: &[Row], nodes: &mut [Node]) {
    let acting = Acting::new(simd, pass, stand);
    let base = base(simd, stand);
    let size = load(simd, &stand.size);
    let mut last = base;
    for (number, (joint, row)) in pass.joints.iter().zip(rows).enumerate() {
        let below = if joint.only { last } else { below(simd, base, nodes, joint) };
        last = frame_of(simd, below, joint, row, size);
        let node = &mut nodes[number];
        last.store(node);
        let felt = acting.water(simd, joint, last.y, last.origin);
        acting.act(simd, joint, &last, &felt, node);
    }
}

impl<S: Simd> Frame<S> {
    #[inline(always)]
    fn store(&self, node: &mut Node) {
        store3(&mut node.x, self.x);
        store3(&mut node.y, self.y);
        store3(&mut node.origin, self.origin);
    }
}
