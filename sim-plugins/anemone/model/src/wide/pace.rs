//! How far a step may go. A joint goes the share 1 − exp(−dt/τ) of its way; where the load changes fast as
//! the fibre moves, that is too far, and the fibre would swing or circle about its steady pose for ever. Such
//! fibres take the step in parts.
//!
//! What decides is Γ, the spectral radius of B_il = (1/(k_i L_i)) Σ_{j ≥ max(i,l)} A_j |∇V(N_j)| |N_j −
//! N_{l−1}|: how much the target of joint i moves when joint l turns. A fibre settles for shares up to 2/(1 +
//! Γ)². Γ is bounded by the greatest sum of a row of B, with distances along the fibre: Σ_l |N_j − N_{l−1}| ≤
//! D_j, and the sums follow from tip to root. A contact pushes back along one direction, which only needs
//! 2/(1 + S) with S the trace of its own matrix.
//!
//! Each number belongs to one fibre alone, so what a fibre does does not depend on its neighbours in the
//! chunk.

use core::ops::Range;

use fearless_simd::{Select, Simd, f32x16, prelude::*};
use reef_flow::{
    simd::{mul_add, splat16 as splat},
    steepness,
};

use super::{
    LANES, Sixteen,
    chunk::{Chunk, GROUPS, Group, Segment},
    contact::may_touch,
    kernel::{
        Around, GREATEST_SPEED, Law, Vector, dot, load, load3, quadratic, store, sub_scaled, touch, water_at,
    },
};

/// Parts of a step at most. What would need more goes a smaller share of its way, and takes longer to follow.
const MOST_PARTS: f64 = 16.0;
/// The least share of the way that a part goes: a fibre in the middle of a jump of the flow still moves.
const LEAST_SHARE: f32 = 1e-3;
/// What rounding may lack of a bound.
const MARGIN: f32 = 1.01;

/// What a look at the balls that hold a chunk's fibres tells.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Outlook {
    /// Some fibre may touch something.
    pub(crate) touching: bool,
    /// The step may be too long for some fibre: [`shares`] says.
    pub(crate) steep: bool,
    /// 1 for each fibre for which it may, else 0.
    pub(crate) doubtful: [Sixteen; GROUPS],
}

impl Outlook {
    /// Nothing is in the way.
    pub(crate) fn clear() -> Self {
        Self { touching: false, steep: false, doubtful: [[0.0; LANES]; GROUPS] }
    }
}

/// Looks whether a step may be taken at once. Each fibre lies in the ball around the middle between root and
/// tip whose radius is half the fibre's length.
#[inline(always)]
pub(crate) fn outlook<S: Simd>(simd: S, chunk: &Chunk, around: &Around<'_>) -> Outlook {
    let Around { packed, surges, contacts, law, constants, .. } = *around;
    let varied = !packed.is_uniform() || !surges.is_empty();
    let mut outlook = Outlook::clear();
    if !varied && contacts.is_empty() {
        return outlook;
    }
    let (zero, one) = (splat(simd, 0.0), splat(simd, 1.0));
    for (g, root) in chunk.roots.iter().enumerate().take(GROUPS) {
        let middle = root.at_anchor(simd, load3(simd, &root.middle));
        let reach = load(simd, &root.half_length) * splat(simd, MARGIN);
        let mut doubtful = zero;
        if varied {
            doubtful = match law {
                Law::Linear(factor) => {
                    let mut slope = steepness(simd, packed, middle, reach)
                        * splat(simd, MARGIN * factor * constants.current);
                    if let Some(surge) = around.surge(g) {
                        slope = mul_add(surge.steepness(simd), splat(simd, MARGIN * factor), slope);
                    }
                    let once = mul_add(slope, load(simd, &root.lever), one);
                    let far = (load(simd, &root.gain) * once) * once;
                    far.simd_gt(splat(simd, 2.0)).select(one, zero)
                }
                Law::Quadratic { .. } => one,
            };
        }
        if !contacts.is_empty() {
            let near = may_touch(simd, contacts, g, middle, reach + load(simd, &root.thickest));
            outlook.touching |= near.simd_gt(zero).any_true();
            doubtful = doubtful.max(near);
        }
        outlook.steep |= doubtful.simd_gt(zero).any_true();
        store(&mut outlook.doubtful[g], doubtful);
    }
    outlook
}

/// The greatest share of its way that each fibre of some groups may go from its present pose: 2 / ((1 + Γ)² +
/// 2 S). With twice S a contact is met in one go.
#[inline(always)]
pub(crate) fn shares<S: Simd>(
    simd: S,
    chunk: &Chunk,
    groups: Range<usize>,
    around: &Around<'_>,
) -> [Sixteen; GROUPS] {
    let Around { contacts, constants, touching, .. } = *around;
    let mut shares = [[0.0; LANES]; GROUPS];
    for g in groups {
        let root = &chunk.roots[g];
        let (zero, one) = (splat(simd, 0.0), splat(simd, 1.0));
        // D_j, and the fibre's length up to node j.
        let (mut levers, mut arc) = (zero, zero);
        for s in 0..chunk.segments {
            let length = load(simd, &chunk.constants[chunk.constants_of(s, g)].length);
            levers = mul_add(length, splat(simd, (s + 1) as f32), levers);
            arc += length;
        }
        // Sums over the nodes above: of A |∇V| D; of the contacts' stiffnesses, and of these times the length
        // up to them.
        let (mut row, mut stiff, mut stiff_arc) = (zero, zero, zero);
        let (mut gamma, mut trace) = (zero, zero);
        let mut node = load3(simd, &root.tip);
        for s in (0..chunk.segments).rev() {
            let segment = &chunk.constants[chunk.constants_of(s, g)];
            let (length, spring) = (load(simd, &segment.length), load(simd, &segment.spring));
            let slope = force_slope(simd, node, segment, root, around, g);
            row = mul_add(slope, levers, row);
            gamma = gamma.max(row / spring);
            if touching {
                let (push, stiffness) = touch(simd, node, segment, root, contacts, (s, g), constants.contact);
                let stiffness = dot(push, push).simd_gt(zero).select(stiffness, zero);
                stiff += stiffness;
                stiff_arc = mul_add(stiffness, arc, stiff_arc);
                arc -= length;
                trace += (stiff_arc - stiff * arc).max(zero) / spring;
            }
            levers -= length * splat(simd, (s + 1) as f32);
            let direction = load3(simd, &chunk.poses[chunk.pose_of(s, g)].direction);
            node = sub_scaled(node, direction, length);
        }
        let once = one + gamma;
        let share = splat(simd, 2.0) / mul_add(once, once, trace + trace);
        store(&mut shares[g], share.max(splat(simd, LEAST_SHARE)));
    }
    shares
}

/// |∂F/∂p| of the flow's force on sixteen nodes at most [N/m].
#[inline(always)]
fn force_slope<S: Simd>(
    simd: S,
    node: Vector<S>,
    segment: &Segment,
    root: &Group,
    around: &Around<'_>,
    group: usize,
) -> f32x16<S> {
    let packed = around.packed;
    let surge = around.surge(group);
    if packed.is_uniform() && surge.is_none() {
        return splat(simd, 0.0);
    }
    let at = root.at_anchor(simd, node);
    let current = splat(simd, around.constants.current);
    let mut slope = steepness(simd, packed, at, splat(simd, 0.0)) * current;
    if let Some(surge) = surge {
        slope += surge.steepness(simd);
    }
    match around.law {
        Law::Linear(factor) => slope * (load(simd, &segment.drag) * splat(simd, factor)),
        Law::Quadratic { density, reynolds } => {
            let v = water_at(simd, node, root, around, group);
            let speed = dot(v, v).sqrt().min(splat(simd, GREATEST_SPEED));
            // The derivative of |V|² is twice |V|.
            slope * quadratic(simd, segment, speed, density, reynolds) * splat(simd, 2.0)
        }
    }
}

/// In how many parts each fibre of a chunk takes a step, and the share of its way that it goes in each.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plan {
    count: [[u32; LANES]; GROUPS],
    share: [Sixteen; GROUPS],
    /// The greatest count of each group.
    most: [u32; GROUPS],
}

impl Plan {
    /// Divides the step as `allowed` asks for, where it is doubtful that it may be taken at once.
    pub(crate) fn new(chunk: &Chunk, doubtful: &[Sixteen; GROUPS], allowed: &[Sixteen; GROUPS]) -> Self {
        let mut plan = Self { count: [[1; LANES]; GROUPS], share: [[0.0; LANES]; GROUPS], most: [1; GROUPS] };
        for (g, root) in chunk.roots.iter().enumerate().take(GROUPS) {
            plan.share[g] = root.gain;
            for at in 0..LANES {
                if doubtful[g][at] == 0.0 || root.gain[at] <= allowed[g][at] {
                    continue;
                }
                let rate = chunk.rate(g, at);
                let count = (rate / f64::from(allowed[g][at])).ceil().clamp(1.0, MOST_PARTS);
                // 1 − exp(−(dt/n)/τ); all of it where τ is zero.
                plan.share[g][at] = crate::math::relaxation(rate / count, 1.0) as f32;
                plan.count[g][at] = count as u32;
                plan.most[g] = plan.most[g].max(plan.count[g][at]);
            }
        }
        plan
    }

    /// Whether all fibres take it in one part.
    pub(crate) fn is_at_once(&self) -> bool {
        self.most == [1; GROUPS]
    }

    /// Sets the shares of some groups for part `part`, 0 the first: nothing for fibres whose step is over.
    pub(crate) fn go(
        &self,
        groups: Range<usize>,
        part: u32,
        allowed: &[Sixteen; GROUPS],
        gains: &mut [Sixteen; GROUPS],
    ) {
        for g in groups {
            gains[g] = core::array::from_fn(|at| match self.count[g][at] {
                1 if part == 0 => self.share[g][at],
                count if part < count => self.share[g][at].min(allowed[g][at]),
                _ => 0.0,
            });
        }
    }

    /// What comes after part `part` of the group before `end`: a part and its group, each group's parts one
    /// after the other.
    pub(crate) fn next(&self, part: u32, end: usize) -> Option<(u32, usize)> {
        // The first part is everybody's.
        if part > 0 && part + 1 < self.most[end - 1] {
            return Some((part + 1, end - 1));
        }
        let from = if part == 0 { 0 } else { end };
        (from..GROUPS).find(|g| self.most[*g] > 1).map(|g| (1, g))
    }
}
