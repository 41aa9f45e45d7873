//! One step of a chunk: loads from tip to root, then bends from root to tip (`pose.rs`); several times where
//! the load changes fast (`pace.rs`).

use core::ops::Range;

use fearless_simd::{Select, Simd, f32x16, prelude::*};
use reef_flow::{
    Packed,
    simd::{Ahead, clamp, mul_add, neg_mul_add, prefetch, splat16 as splat},
    velocity16,
    waves::Surges,
};

use super::{
    LANES, Sixteen, Water,
    chunk::{Chunk, Drag, GROUPS, Group, Segment},
    contact::{Contacts, overlap},
    emit,
    pace::{self, Plan},
    pose,
};
use crate::shape::{CRITICAL_REYNOLDS, DRAG_COEFFICIENTS};

/// Which of the paper's force laws.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Force {
    /// A V, eq. (9).
    #[default]
    Linear,
    /// V² with the drag coefficient of eq. (6) to (8).
    Quadratic,
}

/// What all chunks of a step share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepConstants {
    /// ρ [kg/m³].
    pub density: f32,
    /// μ [Pa s].
    pub viscosity: f32,
    /// Factor on every drag force.
    pub drag: f32,
    /// Factor on the flow's velocity.
    pub current: f32,
    /// Force of a contact, in stiffnesses of the touching node: N a metre of overlap, over k_i.
    pub contact: f32,
    /// The law of fibres whose drag is an area.
    pub force: Force,
    /// Loads only, the pose stays (figure 11 is drawn without deformation).
    pub rigid: bool,
}

impl Default for StepConstants {
    fn default() -> Self {
        Self {
            density: 1000.0,
            viscosity: 1.15e-3,
            drag: 1.0,
            current: 1.0,
            contact: 4.0,
            force: Force::Linear,
            rigid: false,
        }
    }
}

/// Greatest speed [m/s] and force [N] along an axis that the kernel goes on with: far beyond any sea, and
/// their squares summed over a chain stay finite.
pub(crate) const GREATEST_SPEED: f32 = 1e9;
const GREATEST_FORCE: f32 = 1e15;

/// A vector of each of sixteen fibres.
pub(crate) type Vector<S> = [f32x16<S>; 3];

#[inline(always)]
pub(crate) fn load<S: Simd>(simd: S, sixteen: &Sixteen) -> f32x16<S> {
    f32x16::simd_from(simd, *sixteen)
}

#[inline(always)]
pub(crate) fn load3<S: Simd>(simd: S, [x, y, z]: &[Sixteen; 3]) -> Vector<S> {
    [load(simd, x), load(simd, y), load(simd, z)]
}

#[inline(always)]
pub(crate) fn store<S: Simd>(to: &mut Sixteen, from: f32x16<S>) {
    from.store_slice(to);
}

#[inline(always)]
pub(crate) fn store3<S: Simd>(to: &mut [Sixteen; 3], from: Vector<S>) {
    store(&mut to[0], from[0]);
    store(&mut to[1], from[1]);
    store(&mut to[2], from[2]);
}

#[inline(always)]
pub(crate) fn dot<S: Simd>(a: Vector<S>, b: Vector<S>) -> f32x16<S> {
    mul_add(a[2], b[2], mul_add(a[1], b[1], a[0] * b[0]))
}

/// Sixteen equal vectors. Written out, like everything here: a closure, as `map` takes it, does not always
/// inherit the vector instructions of where it stands.
#[inline(always)]
pub(crate) fn splat3<S: Simd>(simd: S, [x, y, z]: [f32; 3]) -> Vector<S> {
    [splat(simd, x), splat(simd, y), splat(simd, z)]
}

/// a + b · s
#[inline(always)]
pub(crate) fn add_scaled<S: Simd>(a: Vector<S>, b: Vector<S>, s: f32x16<S>) -> Vector<S> {
    [mul_add(b[0], s, a[0]), mul_add(b[1], s, a[1]), mul_add(b[2], s, a[2])]
}

/// a − b · s
#[inline(always)]
pub(crate) fn sub_scaled<S: Simd>(a: Vector<S>, b: Vector<S>, s: f32x16<S>) -> Vector<S> {
    [neg_mul_add(b[0], s, a[0]), neg_mul_add(b[1], s, a[1]), neg_mul_add(b[2], s, a[2])]
}

/// See [`super::step_into`]: with nothing in `into`, nothing is written. `ahead`: what will be stepped next.
///
/// One loop for steps at once and steps in parts, so that each of its pieces is compiled once.
#[inline(always)]
pub(crate) fn step<S: Simd>(
    simd: S,
    chunk: &mut Chunk,
    water: Water<'_>,
    contacts: &Contacts,
    constants: &StepConstants,
    into: &mut [[f32; 4]],
    ahead: &mut Ahead,
) {
    ahead.spread(2 * chunk.segments);
    let law = Law::of(chunk, constants);
    let Water { flow: packed, surges } = water;
    let mut around = Around { packed, surges, contacts, law, constants, touching: !contacts.is_empty() };
    let mut gains = [[0.0; LANES]; GROUPS];
    for (gain, root) in gains.iter_mut().zip(&chunk.roots) {
        *gain = root.gain;
    }
    let mut plan = None;
    let mut outlook = pace::Outlook::clear();
    if !constants.rigid {
        outlook = pace::outlook(simd, chunk, &around);
        around.touching = outlook.touching;
    }
    let mut which = 0..chunk.groups.min(GROUPS);
    let mut part = 0;
    loop {
        if outlook.steep {
            let allowed = pace::shares(simd, chunk, which.clone(), &around);
            let plan = plan.get_or_insert_with(|| Plan::new(chunk, &outlook.doubtful, &allowed));
            plan.go(which.clone(), part, &allowed, &mut gains);
        }
        let writes = !constants.rigid && plan.as_ref().is_none_or(Plan::is_at_once);
        loads(simd, chunk, which.clone(), &around, if writes { into } else { &[] }, ahead);
        if !constants.rigid {
            let into = if writes { &mut *into } else { &mut [] };
            pose::bend(simd, chunk, which.clone(), &gains, into, ahead);
        }
        match plan.as_ref().and_then(|plan| plan.next(part, which.end)) {
            Some((next, group)) => (part, which) = (next, group..group + 1),
            None if !writes && !into.is_empty() => return emit::emit(simd, chunk, into),
            None => return,
        }
    }
}

/// What acts on one chunk in a step.
#[derive(Clone, Copy)]
pub(crate) struct Around<'a> {
    pub(crate) packed: &'a Packed,
    /// See [`Water::surges`].
    pub(crate) surges: &'a [Surges],
    pub(crate) contacts: &'a Contacts,
    pub(crate) law: Law,
    pub(crate) constants: &'a StepConstants,
    /// Some fibre may touch something.
    pub(crate) touching: bool,
}

impl<'a> Around<'a> {
    /// What the waves do to a group.
    #[inline(always)]
    pub(crate) fn surge(&self, group: usize) -> Option<&'a Surges> {
        self.surges.get(group).or(self.surges.last())
    }
}

/// The drag of one chunk as the kernel needs it.
#[derive(Clone, Copy)]
pub(crate) enum Law {
    Linear(f32),
    Quadratic { density: f32, reynolds: f32 },
}

impl Law {
    fn of(chunk: &Chunk, constants: &StepConstants) -> Self {
        match (chunk.drag, constants.force) {
            (Drag::Given, _) => Self::Linear(constants.drag),
            (Drag::Area { coefficient }, Force::Linear) => {
                Self::Linear(constants.density * coefficient * constants.drag)
            }
            (Drag::Area { .. }, Force::Quadratic) => Self::Quadratic {
                density: constants.density * constants.drag,
                reynolds: 2.0 * constants.density / constants.viscosity,
            },
        }
    }
}

/// F(N_i), eq. (13), of every node of some groups, tip to root. `next`: what will be written after it.
///
/// Segment by segment, in two loops over the groups: a processor looks ahead as far as one group's whole
/// chain is long, and so that several are under way, chains are cut in two.
#[inline(always)]
fn loads<S: Simd>(
    simd: S,
    chunk: &mut Chunk,
    which: Range<usize>,
    around: &Around<'_>,
    next: &[[f32; 4]],
    ahead: &mut Ahead,
) {
    let Around { packed, surges, contacts, constants, touching, .. } = *around;
    let still = packed.is_still() && surges.is_empty();
    let loaded = chunk.load != [0.0; 3];
    let load_force = splat3(simd, chunk.load);
    let (groups, kinds) = (chunk.groups, chunk.kinds);
    prefetch(&chunk.roots);
    // F_L(N_{i+1}) + F_M(N_i) of each group.
    let mut handed = [[splat(simd, 0.0); 3]; GROUPS];
    // F(N_i), and N_i of each group.
    let (mut forces, mut nodes) = (handed, handed);
    for (node, root) in nodes.iter_mut().zip(&chunk.roots) {
        *node = load3(simd, &root.tip);
    }
    let mut next = next.chunks(next.len().div_ceil(chunk.segments).max(1));
    for s in (0..chunk.segments).rev() {
        ahead.ask();
        // From the tip down the rows follow one another: this one, then the one below.
        let (above, below) = chunk.poses.split_at_mut((chunk.segments - s) * groups);
        let own = &mut above[(chunk.segments - 1 - s) * groups..];
        prefetch(below.get(groups..2 * groups).unwrap_or_default());
        prefetch(next.next().unwrap_or_default());
        let row = &chunk.constants[s * kinds..(s + 1) * kinds];
        for g in which.clone() {
            let (segment, root, node) = (&row[g.min(kinds - 1)], &chunk.roots[g], nodes[g]);
            let mut force = handed[g];
            if !still {
                force = flow_force(simd, node, segment, root, around, g, force);
            }
            if loaded {
                force = [force[0] + load_force[0], force[1] + load_force[1], force[2] + load_force[2]];
            }
            if touching {
                force = contact_force(simd, node, segment, root, contacts, (s, g), constants.contact, force);
            }
            forces[g] = force;
        }
        for g in which.clone() {
            let (pose, segment) = (&mut own[g], &row[g.min(kinds - 1)]);
            let below = match below.get(g) {
                Some(pose) => load3(simd, &pose.direction),
                None => load3(simd, &chunk.roots[g].frame[2]),
            };
            let direction = load3(simd, &pose.direction);
            handed[g] = hand_down(simd, direction, segment, forces[g], below);
            nodes[g] = sub_scaled(nodes[g], direction, load(simd, &segment.length));
            if !constants.rigid {
                store3(&mut pose.direction, forces[g]);
            }
        }
    }
    if chunk.breakable {
        for g in which {
            let (root, handed) = (&mut chunk.roots[g], handed[g]);
            let over = dot(handed, handed).simd_gt(load(simd, &root.break2));
            let broken = over.select(splat(simd, 1.0), load(simd, &root.broken));
            store(&mut root.broken, broken);
        }
    }
}

/// `force` and what the flow exerts on sixteen nodes, eq. (6) or (9).
#[inline(always)]
fn flow_force<S: Simd>(
    simd: S,
    node: Vector<S>,
    segment: &Segment,
    root: &Group,
    around: &Around<'_>,
    group: usize,
    force: Vector<S>,
) -> Vector<S> {
    let v = water_at(simd, node, root, around, group);
    let (least, most) = (splat(simd, -GREATEST_SPEED), splat(simd, GREATEST_SPEED));
    let v = [clamp(v[0], least, most), clamp(v[1], least, most), clamp(v[2], least, most)];
    let drag = load(simd, &segment.drag);
    match around.law {
        Law::Linear(factor) => add_scaled(force, v, drag * splat(simd, factor)),
        Law::Quadratic { density, reynolds } => {
            let speed = dot(v, v).sqrt();
            let factor = quadratic(simd, segment, speed, density, reynolds);
            let (least, most) = (splat(simd, -GREATEST_FORCE), splat(simd, GREATEST_FORCE));
            [
                force[0] + clamp(v[0] * factor, least, most),
                force[1] + clamp(v[1] * factor, least, most),
                force[2] + clamp(v[2] * factor, least, most),
            ]
        }
    }
}

/// V at sixteen nodes: of the flow, and of the waves.
#[inline(always)]
pub(crate) fn water_at<S: Simd>(
    simd: S,
    node: Vector<S>,
    root: &Group,
    around: &Around<'_>,
    group: usize,
) -> Vector<S> {
    let [x, y, z] = root.at_anchor(simd, node);
    let v = velocity16(simd, around.packed, x, y, z);
    let current = splat(simd, around.constants.current);
    let v = [v[0] * current, v[1] * current, v[2] * current];
    let Some(surges) = around.surge(group) else { return v };
    let surge = surges.velocity(simd, node);
    [v[0] + surge[0], v[1] + surge[1], v[2] + surge[2]]
}

/// ρ L r C_D |V|: times V it is the force of eq. (6).
#[inline(always)]
pub(crate) fn quadratic<S: Simd>(
    simd: S,
    segment: &Segment,
    speed: f32x16<S>,
    density: f32,
    reynolds: f32,
) -> f32x16<S> {
    let re = speed * load(simd, &segment.radius) * splat(simd, reynolds);
    let fast = re.simd_ge(splat(simd, CRITICAL_REYNOLDS as f32));
    let [slow_cd, fast_cd] = DRAG_COEFFICIENTS;
    let coefficient = fast.select(splat(simd, fast_cd as f32), splat(simd, slow_cd as f32));
    coefficient * load(simd, &segment.drag) * splat(simd, density) * speed
}

/// `force` and what contacts exert on sixteen nodes.
#[inline(always)]
fn contact_force<S: Simd>(
    simd: S,
    node: Vector<S>,
    segment: &Segment,
    root: &Group,
    contacts: &Contacts,
    at: (usize, usize),
    contact: f32,
    force: Vector<S>,
) -> Vector<S> {
    let (push, stiffness) = touch(simd, node, segment, root, contacts, at, contact);
    add_scaled(force, push, stiffness)
}

/// How far contacts push sixteen nodes [m], and with what force a metre [N/m].
#[inline(always)]
pub(crate) fn touch<S: Simd>(
    simd: S,
    node: Vector<S>,
    segment: &Segment,
    root: &Group,
    contacts: &Contacts,
    at: (usize, usize),
    contact: f32,
) -> (Vector<S>, f32x16<S>) {
    let push = overlap(simd, contacts, at, root.at_anchor(simd, node), load(simd, &segment.radius));
    let stiffness = splat(simd, contact) * load(simd, &segment.spring) / load(simd, &segment.length);
    (push, stiffness)
}

impl Group {
    /// A place relative to the plants' origins, relative to the chunk's anchor: where flow and contacts are.
    #[inline(always)]
    pub(crate) fn at_anchor<S: Simd>(&self, simd: S, [x, y, z]: Vector<S>) -> Vector<S> {
        let offset = load3(simd, &self.offset);
        [x + offset[0], y + offset[1], z + offset[2]]
    }
}

/// F_L(N_i) + F_M(N_{i−1}), eq. (12): what sixteen nodes hand to the ones below. With M = L d × F_T and b the
/// direction of the segment below, −b × M is L (F_T (b·d) − d (b·F_T)): in a straight chain F_T's own
/// direction.
#[inline(always)]
fn hand_down<S: Simd>(
    simd: S,
    d: Vector<S>,
    segment: &Segment,
    force: Vector<S>,
    below: Vector<S>,
) -> Vector<S> {
    let along = dot(force, d);
    let across = sub_scaled(force, d, along);
    let straight = dot(below, d);
    let sideways = dot(below, across);
    let v = [
        neg_mul_add(d[0], sideways, across[0] * straight),
        neg_mul_add(d[1], sideways, across[1] * straight),
        neg_mul_add(d[2], sideways, across[2] * straight),
    ];
    let across2 = dot(across, across);
    // The cross product vanishes together with its direction: below a millionth it fades out.
    let least = mul_add(across2, splat(simd, 1e-12), splat(simd, 1e-36));
    let scale = (across2 / dot(v, v).max(least)).sqrt() * load(simd, &segment.ratio);
    let moment = [v[0] * scale, v[1] * scale, v[2] * scale];
    add_scaled(moment, d, along)
}
