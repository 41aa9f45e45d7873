//! Poses as the streams have them.

use fearless_simd::{Simd, f32x16, prelude::*};
use reef_flow::simd::splat16 as splat;

use super::{
    LANES,
    chunk::{Chunk, Group},
    kernel::{Vector, add_scaled, load, load3, store3},
};

/// See [`super::emit`].
#[inline(always)]
pub(crate) fn emit<S: Simd>(simd: S, chunk: &mut Chunk, into: &mut [[f32; 4]]) {
    let nodes = chunk.segments + 1;
    let mut tray = Tray::new();
    for group in 0..chunk.groups {
        let root = &chunk.roots[group];
        let mut node = load3(simd, &root.root);
        tray.put(node, load(simd, &root.root_radius));
        tray.empty(group, 0, into, nodes);
        for s in 0..chunk.segments {
            let segment = &chunk.constants[chunk.constants_of(s, group)];
            let direction = load3(simd, &chunk.poses[chunk.pose_of(s, group)].direction);
            if s == 0 {
                face(simd, &mut chunk.roots[group], direction);
            }
            node = add_scaled(node, direction, load(simd, &segment.length));
            tray.put(node, load(simd, &segment.radius));
            tray.empty(group, s + 1, into, nodes);
        }
    }
}

/// One node of each of sixteen fibres, x, y, z and radius, on its way from lanes to where each fibre's nodes
/// follow one another. It goes through memory because stores of single nodes straight out of wide registers
/// would keep the one unit busy that can take these apart.
#[derive(Clone, Copy)]
#[repr(align(64))]
pub(crate) struct Tray([[f32; 4]; LANES]);

impl Tray {
    pub(crate) fn new() -> Self {
        Self([[0.0; 4]; LANES])
    }

    /// Takes a node of each fibre.
    #[inline(always)]
    pub(crate) fn put<S: Simd>(&mut self, [x, y, z]: Vector<S>, radius: f32x16<S>) {
        let (xz, yr) = (x.zip_low(z), y.zip_low(radius));
        let (xz_high, yr_high) = (x.zip_high(z), y.zip_high(radius));
        let (row, _) = self.0.as_flattened_mut().as_chunks_mut::<LANES>();
        xz.zip_low(yr).store_slice(&mut row[0]);
        xz.zip_high(yr).store_slice(&mut row[1]);
        xz_high.zip_low(yr_high).store_slice(&mut row[2]);
        xz_high.zip_high(yr_high).store_slice(&mut row[3]);
    }

    /// Writes them as nodes `at` of the fibres of group `group` in `into`, of `nodes` nodes each. The last
    /// group may have fewer than sixteen.
    #[inline(always)]
    pub(crate) fn empty(&self, group: usize, at: usize, into: &mut [[f32; 4]], nodes: usize) {
        let own = into.get_mut(group * LANES * nodes..).unwrap_or_default();
        for (fibre, node) in own.chunks_exact_mut(nodes).zip(&self.0) {
            if let Some(out) = fibre.get_mut(at) {
                *out = *node;
            }
        }
    }
}

/// Works out the normals of sixteen fibres whose first segments run along `d`.
#[inline(always)]
pub(crate) fn face<S: Simd>(simd: S, root: &mut Group, d: Vector<S>) {
    let normal = normal(simd, root, d);
    store3(&mut root.normal, normal);
}

/// The root frame's x, carried to the first segment's direction by the smallest turn. Sums without fused
/// operations.
#[inline(always)]
fn normal<S: Simd>(simd: S, root: &Group, d: Vector<S>) -> Vector<S> {
    let (x, z) = (load3(simd, &root.frame[0]), load3(simd, &root.frame[2]));
    let one = splat(simd, 1.0);
    let share = plain_dot(x, d) / (one + plain_dot(z, d)).max(splat(simd, 1e-3));
    let across = [x[0] - (z[0] + d[0]) * share, x[1] - (z[1] + d[1]) * share, x[2] - (z[2] + d[2]) * share];
    let along = plain_dot(across, d);
    let across = [across[0] - d[0] * along, across[1] - d[1] * along, across[2] - d[2] * along];
    let scale = one / plain_dot(across, across).sqrt().max(splat(simd, 1e-6));
    [across[0] * scale, across[1] * scale, across[2] * scale]
}

/// Written out: a closure would not be compiled with the level's instructions.
#[inline(always)]
fn plain_dot<S: Simd>(a: Vector<S>, b: Vector<S>) -> f32x16<S> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
