//! Poses as the streams have them.

use fearless_simd::{Simd, f32x4, f32x16, prelude::*};
use reef_flow::simd::{mul_add, splat16 as splat};

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
        let mut node = four_of(simd, &root.root, at);
        write(simd, into, nodes, 0, node, &root.root_radius[at..at + 4]);
        for s in 0..chunk.segments {
            let segment = &chunk.constants[chunk.constants_of(s, group)];
            let d = four_of(simd, &chunk.poses[chunk.pose_of(s, group)].direction, at);
            let length = f32x4::from_slice(simd, &segment.length[at..at + 4]);
            node = [
                mul_add(d[0], length, node[0]),
                mul_add(d[1], length, node[1]),
                mul_add(d[2], length, node[2]),
            ];
            write(simd, into, nodes, s + 1, node, &segment.radius[at..at + 4]);
        }
    }
}

/// The vectors of four of sixteen fibres, from lane `at` on.
#[inline(always)]
fn four_of<S: Simd>(simd: S, [x, y, z]: &[Sixteen; 3], at: usize) -> [f32x4<S>; 3] {
    [
        f32x4::from_slice(simd, &x[at..at + 4]),
        f32x4::from_slice(simd, &y[at..at + 4]),
        f32x4::from_slice(simd, &z[at..at + 4]),
    ]
}

/// Writes node `at` of up to four fibres of `nodes` nodes each.
#[inline(always)]
fn write<S: Simd>(
    simd: S,
    into: &mut [[f32; 4]],
    nodes: usize,
    at: usize,
    [x, y, z]: [f32x4<S>; 3],
    radius: &[f32],
) {
    let radius = f32x4::from_slice(simd, radius);
    let (xz, yr) = (x.zip_low(z), y.zip_low(radius));
    let (xz_high, yr_high) = (x.zip_high(z), y.zip_high(radius));
    let four = [xz.zip_low(yr), xz.zip_high(yr), xz_high.zip_low(yr_high), xz_high.zip_high(yr_high)];
    let mut fibre = 0;
    while fibre < 4 {
        if let Some(out) = into.get_mut(fibre * nodes + at) {
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
