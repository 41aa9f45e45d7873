//! Bends and the poses that follow from them, root to tip.

use core::ops::Range;

use fearless_simd::{Simd, f32x16, prelude::*};
use reef_flow::simd::{Ahead, mul_add, splat16 as splat};

use super::{
    LANES, Sixteen,
    chunk::{Blend, Chunk, GROUPS, Group, Pose},
    emit::{self, Tray},
    kernel::{Vector, add_scaled, dot, load, load3, splat3, store, store3, sub_scaled},
};

/// (sin √y / √y − 1) / y and (cos √y − 1 + y/2) / y² for y up to (π/2)², fitted at Chebyshev's points: 1.2e-8
/// off.
const SINC: [f32; 5] = [-1.666_666_7e-1, 8.333_333e-3, -1.984_108_7e-4, 2.753_646e-6, -2.408_009_4e-8];
const COSINE: [f32; 4] = [4.166_666_8e-2, -1.388_881_2e-3, 2.478_607_9e-5, -2.654_596_8e-7];
/// (tan(½√y) / √y − ½) / y for y up to (π/2)²: 6e-8 off in the tangent; the shorter one 2e-4.
const HALF_TANGENT: [f32; 6] =
    [4.166_665_7e-2, 4.166_994e-3, 4.201_080_3e-4, 4.524_385_8e-5, 2.486_292_7e-6, 1.007_653_3e-6];
const HALF_TANGENT_ROUGH: [f32; 3] = [4.169_706_3e-2, 3.948_007e-3, 6.391_193_6e-4];
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

/// The least force across a joint [N] that counts: far below any sea's, and its square is no denormal number.
const LEAST_FORCE: f32 = 1e-18;
/// The greatest bend squared that a step leaves behind: (π/2)².
const GREATEST_BEND2: f32 = 2.467_401;

/// A polynomial by Horner's rule.
#[inline(always)]
fn polynomial<S: Simd, const N: usize>(simd: S, coefficients: &[f32; N], y: f32x16<S>) -> f32x16<S> {
    let mut sum = splat(simd, coefficients[N - 1]);
    let mut at = N - 1;
    while at > 0 {
        at -= 1;
        sum = mul_add(sum, y, splat(simd, coefficients[at]));
    }
    sum
}

impl Group {
    /// Takes note of where the fibres end.
    #[inline(always)]
    fn end_at<S: Simd>(&mut self, simd: S, tip: Vector<S>) {
        let (root, half) = (load3(simd, &self.root), splat(simd, 0.5));
        store3(&mut self.tip, tip);
        let middle = [(root[0] + tip[0]) * half, (root[1] + tip[1]) * half, (root[2] + tip[2]) * half];
        store3(&mut self.middle, middle);
    }
}

/// The frames of sixteen fibres at one segment, and the node at its end.
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
    /// `tangent`: that vector's part across z over 1 + its part along z, which is the tangent of half the
    /// turn.
    #[inline(always)]
    fn turn(&mut self, simd: S, local: Vector<S>, tangent: [f32x16<S>; 2]) {
        let d = [
            mul_add(self.z[0], local[2], mul_add(self.y[0], local[1], self.x[0] * local[0])),
            mul_add(self.z[1], local[2], mul_add(self.y[1], local[1], self.x[1] * local[0])),
            mul_add(self.z[2], local[2], mul_add(self.y[2], local[1], self.x[2] * local[0])),
        ];
        // One step of Newton's for 1/√: rounding never adds up along the chain.
        let scale = mul_add(dot(d, d), splat(simd, -0.5), splat(simd, 1.5));
        let d = [d[0] * scale, d[1] * scale, d[2] * scale];
        let half = [self.z[0] + d[0], self.z[1] + d[1], self.z[2] + d[2]];
        self.x = sub_scaled(self.x, half, tangent[0]);
        self.y = sub_scaled(self.y, half, tangent[1]);
        self.z = d;
    }

    /// Turns to where the rest pose goes on.
    #[inline(always)]
    fn rest(&mut self, simd: S, rest: &[Sixteen; 3]) {
        let local = load3(simd, rest);
        let w = splat(simd, 1.0) / (splat(simd, 1.0) + local[2]);
        self.turn(simd, local, [local[0] * w, local[1] * w]);
    }

    /// Turns and goes to the end of the segment.
    #[inline(always)]
    fn advance(&mut self, simd: S, turn: &Turn<S>, length: f32x16<S>) {
        self.turn(simd, turn.local, turn.tangent);
        self.node = add_scaled(self.node, self.z, length);
    }

    #[inline(always)]
    fn leave(&self, pose: &mut Pose) {
        store3(&mut pose.direction, self.z);
    }
}

/// Where a bend turns z to, see [`Walker::turn`].
#[derive(Clone, Copy)]
struct Turn<S: Simd> {
    local: Vector<S>,
    tangent: [f32x16<S>; 2],
}

impl<S: Simd> Turn<S> {
    #[inline(always)]
    fn idle(simd: S) -> Self {
        let zero = splat(simd, 0.0);
        Self { local: [zero; 3], tangent: [zero; 2] }
    }

    #[inline(always)]
    fn of(simd: S, bend: [f32x16<S>; 2]) -> Self {
        let angle2 = mul_add(bend[1], bend[1], bend[0] * bend[0]);
        let one = splat(simd, 1.0);
        let sinc = mul_add(polynomial(simd, &SINC, angle2), angle2, one);
        let cosine = polynomial(simd, &COSINE, angle2) * angle2;
        let cosine = mul_add(cosine, angle2, mul_add(angle2, splat(simd, -0.5), one));
        let tangent = mul_add(polynomial(simd, &HALF_TANGENT, angle2), angle2, splat(simd, 0.5));
        Self {
            local: [bend[0] * sinc, bend[1] * sinc, cosine],
            tangent: [bend[0] * tangent, bend[1] * tangent],
        }
    }
}

/// Bends every joint of some groups by their `gains` toward the angle at which its spring holds the force
/// that `loads` left, and places the nodes. Writes them to `into`, unless that is empty.
///
/// Segment by segment, each in short loops over the groups: what one group computes is a long chain of roots
/// and quotients, and only side by side do the groups fill the time that each link takes.
#[inline(always)]
pub(crate) fn bend<S: Simd>(
    simd: S,
    chunk: &mut Chunk,
    which: Range<usize>,
    gains: &[Sixteen; GROUPS],
    into: &mut [[f32; 4]],
    ahead: &mut Ahead,
) {
    let (groups, kinds) = (chunk.groups, chunk.kinds);
    let (Some(first), last) = (chunk.roots.first(), chunk.segments - 1) else { return };
    let mut walkers = [Walker::start(simd, first); GROUPS];
    for (walker, root) in walkers.iter_mut().zip(&chunk.roots) {
        *walker = Walker::start(simd, root);
    }
    let (mut joints, mut turns) = ([Joint::idle(simd); GROUPS], [Turn::idle(simd); GROUPS]);
    let (nodes, writes) = (chunk.segments + 1, !into.is_empty());
    let mut trays = [Tray::new(); GROUPS];
    if writes {
        for ((tray, walker), root) in trays.iter_mut().zip(&walkers).zip(&chunk.roots) {
            tray.put(walker.node, load(simd, &root.root_radius));
        }
    }
    for s in 0..chunk.segments {
        ahead.ask();
        let poses = &mut chunk.poses[(last - s) * groups..(last - s + 1) * groups];
        let constants = &chunk.constants[s * kinds..(s + 1) * kinds];
        let rests = chunk.rests.get(s * kinds..(s + 1) * kinds);
        let lags = chunk.lags.get(s * kinds..(s + 1) * kinds);
        for g in which.clone() {
            let kind = g.min(kinds - 1);
            let (pose, segment, walker) = (&poses[g], &constants[kind], &mut walkers[g]);
            if let Some(rest) = rests.and_then(|rests| rests.get(kind)) {
                walker.rest(simd, rest);
            }
            // F(N_i): the loads left it in the direction's place.
            let force = load3(simd, &pose.direction);
            let local = [dot(walker.x, force), dot(walker.y, force), dot(walker.z, force)];
            let old = [load(simd, &pose.bend[0]), load(simd, &pose.bend[1])];
            joints[g] = Joint::new(simd, local, load(simd, &segment.spring), old);
        }
        for at in 0..NEWTON_STEPS {
            for joint in &mut joints[which.clone()] {
                joint.approach(simd);
            }
            // While the joints wait for quotients, nodes of the segment below go out.
            for g in (at * GAP..(at + 1) * GAP).take_while(|g| writes && *g < which.end) {
                trays[g].empty(g, s, into, nodes);
            }
        }
        for g in which.clone() {
            let pose = &mut poses[g];
            let target = joints[g].bend(simd);
            let old = [load(simd, &pose.bend[0]), load(simd, &pose.bend[1])];
            let mut gain = load(simd, &gains[g]);
            if let Some(lags) = lags {
                let lag = load(simd, &lags[g.min(kinds - 1)]);
                gain = gain / mul_add(splat(simd, 1.0) - gain, lag, gain);
            }
            let bend = [mul_add(target[0] - old[0], gain, old[0]), mul_add(target[1] - old[1], gain, old[1])];
            store(&mut pose.bend[0], bend[0]);
            store(&mut pose.bend[1], bend[1]);
            turns[g] = Turn::of(simd, bend);
        }
        for g in which.clone() {
            let (pose, segment) = (&mut poses[g], &constants[g.min(kinds - 1)]);
            let (root, walker) = (&mut chunk.roots[g], &mut walkers[g]);
            walker.advance(simd, &turns[g], load(simd, &segment.length));
            if writes {
                trays[g].put(walker.node, load(simd, &segment.radius));
                if s == 0 {
                    emit::face(simd, root, walker.z);
                }
            }
            if s == last {
                root.end_at(simd, walker.node);
            }
            walker.leave(pose);
        }
    }
    if writes {
        for (g, tray) in trays.iter().enumerate().take(which.end) {
            tray.empty(g, chunk.segments, into, nodes);
        }
    }
}

/// Newton's steps toward the equilibrium of a joint.
const NEWTON_STEPS: usize = 3;
/// Groups whose nodes go out between two of them.
const GAP: usize = GROUPS.div_ceil(NEWTON_STEPS - 1);

/// The equilibrium of sixteen joints under forces that are given in the axes of their rest frames: eq. (10)
/// solved for u = tan(α/2). With P the force across the rest direction, Q that along it and κ = k L,
/// [`crate::reference`]'s equation κ t √(1 + t²) + Q t = P becomes, for t = 2u / (1 − u²),
///
/// G(u) = 2u (κ (1 + u²) + Q (1 − u²)) − P (1 − u²)² = 0:
///
/// a polynomial, without a root to take, and defined for any load and any stiffness. Newton's iteration
/// begins at the present bend, so a pose that has settled solves it to rounding.
#[derive(Clone, Copy)]
struct Joint<S: Simd> {
    /// Force across the rest direction [N], and its length P.
    across: [f32x16<S>; 2],
    p: f32x16<S>,
    /// κ + Q and κ − Q.
    sum: f32x16<S>,
    difference: f32x16<S>,
    u: f32x16<S>,
}

impl<S: Simd> Joint<S> {
    #[inline(always)]
    fn idle(simd: S) -> Self {
        let zero = splat(simd, 0.0);
        Self { across: [zero; 2], p: zero, sum: zero, difference: zero, u: zero }
    }

    /// Begins at the bend `old`.
    #[inline(always)]
    fn new(simd: S, local: Vector<S>, spring: f32x16<S>, old: [f32x16<S>; 2]) -> Self {
        let across = [local[0], local[1]];
        let p = mul_add(across[1], across[1], across[0] * across[0]).sqrt();
        let angle2 = mul_add(old[1], old[1], old[0] * old[0]).min(splat(simd, GREATEST_BEND2));
        let tangent = mul_add(polynomial(simd, &HALF_TANGENT_ROUGH, angle2), angle2, splat(simd, 0.5));
        Self { across, p, sum: spring + local[2], difference: spring - local[2], u: angle2.sqrt() * tangent }
    }

    /// One step of Newton's, always uphill where the left side is too small and downhill where it is too
    /// great. It never passes half of the way to u = 1: from there alone, where a great Q makes the left side
    /// fall, it could go round in circles.
    #[inline(always)]
    fn approach(&mut self, simd: S) {
        let u = self.u;
        let half = splat(simd, 0.5);
        let u2 = u * u;
        let w = splat(simd, 1.0) - u2;
        let pw = self.p * w;
        let bent = self.difference * u2;
        let held = self.sum + bent;
        // G/2, and G′/2.
        let value = mul_add(u, held, pw * w * -half);
        let slope = mul_add(mul_add(u, pw, bent), splat(simd, 2.0), held);
        let next = u - value / slope.abs().max(splat(simd, 1e-30));
        self.u = next.max(splat(simd, 0.0)).min(mul_add(u, half, half));
    }

    /// The bend: α = 2 atan u toward the load.
    #[inline(always)]
    fn bend(&self, simd: S) -> [f32x16<S>; 2] {
        let u2 = self.u * self.u;
        let angle = mul_add(polynomial(simd, &ARCTAN, u2) * u2, self.u, self.u);
        let scale = (angle + angle) / self.p.max(splat(simd, LEAST_FORCE));
        [self.across[0] * scale, self.across[1] * scale]
    }
}

/// See [`super::carry`]. Sums in this order on every machine: x, y, z, then the origin, without fused
/// operations.
#[inline(always)]
pub(crate) fn carry<S: Simd>(simd: S, chunk: &mut Chunk, origin: [f32; 3], carrier: [[f32; 3]; 3]) {
    let [x, y, z] = carrier.map(|axis| splat3(simd, axis));
    let origin = splat3(simd, origin);
    for (root, seat) in chunk.roots.iter_mut().zip(&chunk.seats) {
        let place = turned(simd, &seat.root, x, y, z);
        store3(&mut root.root, [place[0] + origin[0], place[1] + origin[1], place[2] + origin[2]]);
        for (to, from) in root.frame.iter_mut().zip(&seat.frame) {
            store3(to, turned(simd, from, x, y, z));
        }
    }
}

/// A vector in the carrier's axes, in the world's.
#[inline(always)]
fn turned<S: Simd>(simd: S, local: &[Sixteen; 3], x: Vector<S>, y: Vector<S>, z: Vector<S>) -> Vector<S> {
    let [a, b, c] = load3(simd, local);
    [x[0] * a + y[0] * b + z[0] * c, x[1] * a + y[1] * b + z[1] * c, x[2] * a + y[2] * b + z[2] * c]
}

/// See [`super::rebuild`].
#[inline(always)]
pub(crate) fn rebuild<S: Simd>(simd: S, chunk: &mut Chunk) {
    for g in 0..chunk.groups {
        let mut walker = Walker::start(simd, &chunk.roots[g]);
        for s in 0..chunk.segments {
            let kind = chunk.constants_of(s, g);
            let at = chunk.pose_of(s, g);
            let (Some(pose), Some(segment)) = (chunk.poses.get_mut(at), chunk.constants.get(kind)) else {
                continue;
            };
            if let Some(rest) = chunk.rests.get(kind) {
                walker.rest(simd, rest);
            }
            let bend = [load(simd, &pose.bend[0]), load(simd, &pose.bend[1])];
            walker.advance(simd, &Turn::of(simd, bend), load(simd, &segment.length));
            walker.leave(pose);
        }
        chunk.roots[g].end_at(simd, walker.node);
    }
}

/// Gives each fibre the weighted bends of its guides.
pub(crate) fn blend<'a>(chunk: &mut Chunk, blends: &[Blend], guides: impl Fn(u32) -> Option<&'a Chunk>) {
    for (fibre, blend) in blends.iter().enumerate().take(chunk.count) {
        let (group, at) = (fibre / LANES, fibre % LANES);
        for s in 0..chunk.segments {
            let mut bend = [0.0_f32; 2];
            for ((guide_chunk, guide), weight) in blend.guides.iter().zip(blend.weights) {
                let Some(from) = guides(*guide_chunk) else { continue };
                let (from_group, from_at) = (*guide as usize / LANES, *guide as usize % LANES);
                if let Some(pose) = from.poses.get(from.pose_of(s, from_group)) {
                    bend[0] += weight * pose.bend[0][from_at];
                    bend[1] += weight * pose.bend[1][from_at];
                }
            }
            let own = chunk.pose_of(s, group);
            if let Some(pose) = chunk.poses.get_mut(own) {
                pose.bend[0][at] = bend[0];
                pose.bend[1][at] = bend[1];
            }
        }
    }
}
