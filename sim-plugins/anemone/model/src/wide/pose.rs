//! Bends and the poses that follow from them, root to tip.

use fearless_simd::{Select, Simd, f32x8, prelude::*};
use reef_flow::simd::{clamp, mul_add, splat};

use super::{
    LANES,
    chunk::{Blend, Chunk, GROUPS, Group, Pose},
    kernel::{Vector, add_scaled, dot, load, load3, store, store3, sub_scaled},
};
use crate::reference::Damper;

/// (sin √y / √y − 1) / y and (cos √y − 1 + y/2) / y² for y up to (π/2)², fitted at Chebyshev's points: 1.2e-8 off.
const SINC: [f32; 5] = [-1.666_666_7e-1, 8.333_333e-3, -1.984_108_7e-4, 2.753_646e-6, -2.408_009_4e-8];
const COSINE: [f32; 4] = [4.166_666_8e-2, -1.388_881_2e-3, 2.478_607_9e-5, -2.654_596_8e-7];
/// (atan √y / √y − 1) / y for y up to 1: 2e-8 off.
const ARCTAN: [f32; 9] = [
    -3.333_333e-1,
    1.999_974e-1,
    -1.427_856_8e-1,
    1.103_376_4e-1,
    -8.656_88e-2,
    6.250_169e-2,
    -3.587_154e-2,
    1.350_777_1e-2,
    -2.386_997_2e-3,
];

/// Load over stiffness F/(k L) that the kernel goes on with: beyond it a joint lies within 1e-7 rad of the force.
const GREATEST_LOAD: f32 = 1e7;

/// A polynomial by Horner's rule.
#[inline(always)]
fn polynomial<S: Simd, const N: usize>(simd: S, coefficients: &[f32; N], y: f32x8<S>) -> f32x8<S> {
    let mut sum = splat(simd, coefficients[N - 1]);
    let mut at = N - 1;
    while at > 0 {
        at -= 1;
        sum = mul_add(sum, y, splat(simd, coefficients[at]));
    }
    sum
}

/// The frames of eight fibres at one segment, and the node at its end.
#[derive(Clone, Copy)]
struct Walker<S: Simd> {
    x: Vector<S>,
    y: Vector<S>,
    z: Vector<S>,
    node: Vector<S>,
}

impl<S: Simd> Walker<S> {
    #[inline(always)]
    fn start(simd: S, root: &Group) -> Self {
        Self {
            x: load3(simd, &root.frame[0]),
            y: load3(simd, &root.frame[1]),
            z: load3(simd, &root.frame[2]),
            node: load3(simd, &root.root),
        }
    }

    /// Turns the frame by the smallest turn that brings z to `local`, a unit vector in the frame's own axes.
    #[inline(always)]
    fn turn(&mut self, simd: S, local: Vector<S>) {
        let d = [
            mul_add(self.z[0], local[2], mul_add(self.y[0], local[1], self.x[0] * local[0])),
            mul_add(self.z[1], local[2], mul_add(self.y[1], local[1], self.x[1] * local[0])),
            mul_add(self.z[2], local[2], mul_add(self.y[2], local[1], self.x[2] * local[0])),
        ];
        // One step of Newton's for 1/√: rounding never adds up along the chain.
        let scale = mul_add(dot(d, d), splat(simd, -0.5), splat(simd, 1.5));
        let d = [d[0] * scale, d[1] * scale, d[2] * scale];
        let half = [self.z[0] + d[0], self.z[1] + d[1], self.z[2] + d[2]];
        let w = splat(simd, 1.0) / (splat(simd, 1.0) + local[2]);
        self.x = sub_scaled(self.x, half, local[0] * w);
        self.y = sub_scaled(self.y, half, local[1] * w);
        self.z = d;
    }

    /// Turns by a bend and goes to the end of the segment.
    #[inline(always)]
    fn advance(&mut self, simd: S, bend: [f32x8<S>; 2], length: f32x8<S>) {
        let angle2 = mul_add(bend[1], bend[1], bend[0] * bend[0]);
        let one = splat(simd, 1.0);
        let sinc = mul_add(polynomial(simd, &SINC, angle2), angle2, one);
        let cosine = polynomial(simd, &COSINE, angle2) * angle2;
        let cosine = mul_add(cosine, angle2, mul_add(angle2, splat(simd, -0.5), one));
        self.turn(simd, [bend[0] * sinc, bend[1] * sinc, cosine]);
        self.node = add_scaled(self.node, self.z, length);
    }

    #[inline(always)]
    fn leave(&self, pose: &mut Pose) {
        store3(&mut pose.node, self.node);
        store3(&mut pose.direction, self.z);
    }
}

/// Bends every joint toward the angle at which its spring holds the force that `loads` left, and places the nodes.
///
/// Segment by segment, each in three short loops over the groups: what one group computes is a long chain of roots and
/// quotients, and only side by side do the groups fill the time that each link takes.
#[inline(always)]
pub(crate) fn bend<S: Simd>(simd: S, chunk: &mut Chunk) {
    let groups = chunk.groups.min(GROUPS);
    let (Some(first), last) = (chunk.roots.first(), chunk.segments - 1) else { return };
    let mut walkers = [Walker::start(simd, first); GROUPS];
    for (walker, root) in walkers.iter_mut().zip(&chunk.roots) {
        *walker = Walker::start(simd, root);
    }
    let mut joints = [Joint::idle(simd); GROUPS];
    for s in 0..chunk.segments {
        let poses = &mut chunk.poses[s * groups..(s + 1) * groups];
        let constants = &chunk.constants[s * groups..(s + 1) * groups];
        for g in 0..groups {
            let (pose, segment, walker) = (&poses[g], &constants[g], &mut walkers[g]);
            if chunk.curved {
                walker.turn(simd, load3(simd, &segment.rest));
            }
            let force = load3(simd, &pose.force);
            let local = [dot(walker.x, force), dot(walker.y, force), dot(walker.z, force)];
            let old = [load(simd, &pose.bend[0]), load(simd, &pose.bend[1])];
            joints[g] = Joint::new(simd, local, load(simd, &segment.softness), old);
        }
        for _ in 0..NEWTON_STEPS {
            for joint in &mut joints[..groups] {
                joint.approach(simd);
            }
        }
        for g in 0..groups {
            let (pose, segment) = (&mut poses[g], &constants[g]);
            let (root, walker) = (&mut chunk.roots[g], &mut walkers[g]);
            let target = joints[g].bend(simd);
            let old = [load(simd, &pose.bend[0]), load(simd, &pose.bend[1])];
            let gain = load(simd, &root.gain) * load(simd, &root.damping);
            let bend = [mul_add(target[0] - old[0], gain, old[0]), mul_add(target[1] - old[1], gain, old[1])];
            store(&mut pose.bend[0], bend[0]);
            store(&mut pose.bend[1], bend[1]);
            walker.advance(simd, bend, load(simd, &segment.length));
            if s == last {
                watch(simd, root, load3(simd, &pose.node), walker.node);
            }
            walker.leave(pose);
        }
    }
}

/// Newton's steps toward the equilibrium of a joint.
const NEWTON_STEPS: usize = 3;

/// The equilibrium of eight joints under forces that are given in the axes of their rest frames: eq. (10) solved for
/// t = tan α, see [`crate::reference::equilibrium_tangent`]. Newton's iteration begins at the present bend, so a pose
/// that has settled solves it to rounding.
#[derive(Clone, Copy)]
struct Joint<S: Simd> {
    /// Load across the rest direction, and its length; load along it: force over k L.
    across: [f32x8<S>; 2],
    p: f32x8<S>,
    q: f32x8<S>,
    /// No root lies above.
    bound: f32x8<S>,
    t: f32x8<S>,
}

impl<S: Simd> Joint<S> {
    #[inline(always)]
    fn idle(simd: S) -> Self {
        let zero = splat(simd, 0.0);
        Self { across: [zero; 2], p: zero, q: zero, bound: zero, t: zero }
    }

    /// Begins at the bend `old`.
    #[inline(always)]
    fn new(simd: S, local: Vector<S>, softness: f32x8<S>, old: [f32x8<S>; 2]) -> Self {
        let (zero, one) = (splat(simd, 0.0), splat(simd, 1.0));
        let greatest = local[0].abs().max(local[1].abs()).max(local[2].abs()).max(splat(simd, 1e-30));
        let softness = softness.min(splat(simd, GREATEST_LOAD) / greatest);
        let across = [local[0] * softness, local[1] * softness];
        let q = local[2] * softness;
        let p = mul_add(across[1], across[1], across[0] * across[0]).sqrt();
        // tan of the present bend, to 0.2 %.
        let angle2 = mul_add(old[1], old[1], old[0] * old[0]);
        let above = mul_add(angle2, splat(simd, -0.0756), one) * angle2.sqrt();
        let below = mul_add(angle2, splat(simd, -0.405_284_73), one).max(splat(simd, 1e-4));
        let bound = (-q).max(zero) + p + one;
        Self { across, p, q, bound, t: (above / below).min(bound) }
    }

    /// One step of Newton's; from where the left side of the equation does not rise, to the bound.
    #[inline(always)]
    fn approach(&mut self, simd: S) {
        let one = splat(simd, 1.0);
        let (t, q) = (self.t, self.q);
        let t2 = t * t;
        let s2 = t2 + one;
        let s = s2.sqrt();
        let value = mul_add(mul_add(q, t, -self.p), s, t * s2);
        let slope = mul_add(q, s, t2 + s2);
        let rising = slope.simd_gt(splat(simd, 0.0));
        let next = clamp(t - value / rising.select(slope, one), splat(simd, 0.0), self.bound);
        self.t = rising.select(next, self.bound);
    }

    /// The bend: α = 2 atan(tan(α/2)) toward the load.
    #[inline(always)]
    fn bend(&self, simd: S) -> [f32x8<S>; 2] {
        let one = splat(simd, 1.0);
        let half = self.t / (one + mul_add(self.t, self.t, one).sqrt());
        let half2 = half * half;
        let angle = mul_add(polynomial(simd, &ARCTAN, half2) * half2, half, half);
        let scale = (angle + angle) / self.p.max(splat(simd, 1e-30));
        [self.across[0] * scale, self.across[1] * scale]
    }
}

/// [`Damper::watch`] for eight fibres.
#[inline(always)]
fn watch<S: Simd>(simd: S, root: &mut Group, before: Vector<S>, after: Vector<S>) {
    let moved = [after[0] - before[0], after[1] - before[1], after[2] - before[2]];
    let zero = splat(simd, 0.0);
    let back = dot(moved, load3(simd, &root.moved)).simd_lt(zero);
    let noise = dot(moved, moved).simd_le(load(simd, &root.noise2));
    let factor = load(simd, &root.damping);
    let shorter = (factor * splat(simd, Damper::SHORTEN as f32)).max(splat(simd, Damper::SLOWEST as f32));
    let longer = (factor * splat(simd, Damper::RECOVER as f32)).min(splat(simd, 1.0));
    let factor = back.select(noise.select(longer, shorter), longer);
    store(&mut root.damping, factor);
    store3(&mut root.moved, moved);
}

/// See [`super::rebuild`].
#[inline(always)]
pub(crate) fn rebuild<S: Simd>(simd: S, chunk: &mut Chunk) {
    let groups = chunk.groups;
    for (g, root) in chunk.roots.iter().enumerate() {
        let mut walker = Walker::start(simd, root);
        for s in 0..chunk.segments {
            let at = s * groups + g;
            let (Some(pose), Some(segment)) = (chunk.poses.get_mut(at), chunk.constants.get(at)) else {
                continue;
            };
            if chunk.curved {
                walker.turn(simd, load3(simd, &segment.rest));
            }
            let bend = [load(simd, &pose.bend[0]), load(simd, &pose.bend[1])];
            walker.advance(simd, bend, load(simd, &segment.length));
            walker.leave(pose);
        }
    }
}

/// Gives each fibre the weighted bends of its guides.
pub(crate) fn blend<'a>(chunk: &mut Chunk, blends: &[Blend], guides: impl Fn(u32) -> Option<&'a Chunk>) {
    let groups = chunk.groups;
    for (fibre, blend) in blends.iter().enumerate().take(chunk.count) {
        let (group, at) = (fibre / LANES, fibre % LANES);
        for s in 0..chunk.segments {
            let mut bend = [0.0_f32; 2];
            for ((guide_chunk, guide), weight) in blend.guides.iter().zip(blend.weights) {
                let Some(from) = guides(*guide_chunk) else { continue };
                let (from_group, from_at) = (*guide as usize / LANES, *guide as usize % LANES);
                if let Some(pose) = from.poses.get(s * from.groups + from_group) {
                    bend[0] += weight * pose.bend[0][from_at];
                    bend[1] += weight * pose.bend[1][from_at];
                }
            }
            if let Some(pose) = chunk.poses.get_mut(s * groups + group) {
                pose.bend[0][at] = bend[0];
                pose.bend[1][at] = bend[1];
            }
        }
    }
}
