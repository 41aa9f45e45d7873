//! Poses as the streams have them.

use fearless_simd::{Simd, f32x4, f32x16, prelude::*};
use reef_flow::simd::splat16 as splat;

use super::{
    LANES, Sixteen,
    chunk::{Chunk, Group},
    kernel::{Vector, load3, store3},
};

/// See [`super::emit`].
///
/// Four fibres at a time, root to tip: each line of the stream is written whole before the next one is begun.
#[inline(always)]
pub(crate) fn emit<S: Simd>(simd: S, chunk: &mut Chunk, into: &mut [[f32; 4]]) {
    let lowest = chunk.poses.len() - chunk.groups;
    for (root, lowest) in chunk.roots.iter_mut().zip(&chunk.poses[lowest..]) {
        let normal = normal(simd, root, load3(simd, &lowest.direction));
        store3(&mut root.normal, normal);
    }
    let nodes = chunk.segments + 1;
    for (four, into) in into.chunks_mut(4 * nodes).enumerate().take(chunk.count.div_ceil(4)) {
        let (group, at) = (four * 4 / LANES, four * 4 % LANES);
        let root = &chunk.roots[group];
        write(simd, into, nodes, 0, at, &root.root, &root.root_radius);
        for s in 0..chunk.segments {
            let radius = &chunk.constants[chunk.constants_of(s, group)].radius;
            write(simd, into, nodes, s + 1, at, &chunk.poses[chunk.pose_of(s, group)].node, radius);
        }
    }
}

/// Writes node `node` of up to four fibres of `nodes` nodes each: the lanes from `at` on.
#[inline(always)]
fn write<S: Simd>(
    simd: S,
    into: &mut [[f32; 4]],
    nodes: usize,
    node: usize,
    at: usize,
    [x, y, z]: &[Sixteen; 3],
    radius: &Sixteen,
) {
    let x = f32x4::from_slice(simd, &x[at..at + 4]);
    let y = f32x4::from_slice(simd, &y[at..at + 4]);
    let z = f32x4::from_slice(simd, &z[at..at + 4]);
    let radius = f32x4::from_slice(simd, &radius[at..at + 4]);
    let (xz, yr) = (x.zip_low(z), y.zip_low(radius));
    let (xz_high, yr_high) = (x.zip_high(z), y.zip_high(radius));
    let four = [xz.zip_low(yr), xz.zip_high(yr), xz_high.zip_low(yr_high), xz_high.zip_high(yr_high)];
    let mut fibre = 0;
    while fibre < 4 {
        if let Some(out) = into.get_mut(fibre * nodes + node) {
            four[fibre].store_slice(out);
        }
        fibre += 1;
    }
}

/// The root frame's x, carried to the first segment's direction by the smallest turn. Sums without fused operations.
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
