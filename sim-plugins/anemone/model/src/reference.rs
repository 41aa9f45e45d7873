//! The equations of §4 for one fibre, in f64, one after another: what the wide solver is held against.
//!
//! One step runs tip to root over the pose as it stands and collects the net force of each node, then root to
//! tip: each segment bends toward the angle at which its spring holds that force, measured from its rest
//! direction in the frame of the segment below *as it has just become*. The equations and their fixed point
//! are the paper's; the order is ours. With the frames of the step before, a long soft fibre answers a push
//! twice — the joint below has already turned it — and the jump of the paper oscillates from a load of Σ F/(k
//! L) ≈ 5 rad on. In this order a flow that does not change along the fibre settles in a few jumps at any
//! load.
//!
//! What is left is a flow that changes over a fraction of a segment: there a step goes in parts, as many as
//! `Fibre::reach` asks for, or a tip that a hole or a whirlwind has caught would swing or circle for ever.

use glam::{DVec2, DVec3};

use crate::{
    frame::{Frame, bend_to},
    math,
    shape::{DragLaw, FibreShape},
};

/// What acts on one node.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NodeLoad {
    /// A V(N_i): what the flow alone exerts, with contacts [N].
    pub flow: DVec3,
    /// F(N_i), eq. (13) [N].
    pub net: DVec3,
    /// M(N_i), the moment that bends the joint below, about d × F_T [N m]; zero at the root.
    pub moment: DVec3,
}

/// One fibre and its pose.
#[derive(Clone, Debug, PartialEq)]
pub struct Fibre {
    /// What it is at rest.
    pub shape: FibreShape,
    /// N_0 [m].
    pub root: DVec3,
    /// What the first segment's rest direction is carried by.
    pub root_frame: Frame,
    /// Bend of each segment away from its rest direction [rad]; with the shape and the root, the whole state.
    pub bends: Vec<DVec2>,
    /// N_0 … N_top [m], from the bends.
    pub nodes: Vec<DVec3>,
    /// d_i of each segment, from the bends.
    pub directions: Vec<DVec3>,
}

/// The share of its way that a joint goes whose time constant is `lag` times the one that goes the share
/// `gain`: all of it for all, 1/`lag` of a small one, and in between at most a few hundredths of it more than
/// 1 − (1 − `gain`)^(1/`lag`), which takes a power.
fn lagging(gain: f64, lag: f64) -> f64 {
    gain / (gain + (1.0 - gain) * lag)
}

impl Fibre {
    /// A fibre in its rest pose.
    pub fn new(shape: FibreShape, root: DVec3, root_frame: Frame) -> Self {
        let segments = shape.segments();
        let mut fibre = Self {
            shape,
            root,
            root_frame,
            bends: vec![DVec2::ZERO; segments],
            nodes: vec![root; segments + 1],
            directions: vec![root_frame.z; segments],
        };
        fibre.rebuild(0.0, &vec![NodeLoad::default(); segments + 1]);
        fibre
    }

    /// The tip [m].
    pub fn tip(&self) -> DVec3 {
        self.nodes[self.nodes.len() - 1]
    }

    /// The loads of all nodes in the present pose, eq. (13), tip to root. The root's net force is what holds
    /// it down.
    pub fn loads(&self, law: &DragLaw, velocity: &dyn Fn(usize, DVec3) -> DVec3) -> Vec<NodeLoad> {
        loads_of(&self.shape, &self.root_frame, &self.nodes, &self.directions, law, velocity)
    }

    /// One step of `dt` with time constant `tau` [s]: loads, then bends, in as many parts as the flow asks
    /// for. `velocity` [m/s] at a point.
    pub fn step(&mut self, law: &DragLaw, velocity: &dyn Fn(DVec3) -> DVec3, dt: f64, tau: f64) {
        let parts = (dt / tau / self.reach(law, velocity)).ceil().clamp(1.0, MOST_PARTS);
        for _ in 0..parts as usize {
            let gain = math::relaxation(dt / parts, tau).min(self.reach(law, velocity));
            let loads = self.loads(law, &|_, at| velocity(at));
            self.rebuild(gain, &loads);
        }
    }

    /// The share of its way that a step may go from the present pose, 2/(1 + Γ)², with Γ the greatest row sum
    /// of B_il = (1/(k_i L_i)) Σ_{j ≥ max(i,l)} |∇F(N_j)| |N_j − N_{l−1}|.
    fn reach(&self, law: &DragLaw, velocity: &dyn Fn(DVec3) -> DVec3) -> f64 {
        let (mut row, mut gamma) = (0.0, 0.0_f64);
        for i in (0..self.shape.segments()).rev() {
            let node = self.nodes[i + 1];
            let levers: f64 = self.nodes[..=i].iter().map(|below| node.distance(*below)).sum();
            let (drag, radius) = (self.shape.drag[i], self.shape.radii[i]);
            row += slope(&|at| law.force(drag, radius, velocity(at)), node) * levers;
            gamma = gamma.max(row / (self.shape.stiffness[i] * self.shape.lengths[i]));
        }
        2.0 / ((1.0 + gamma) * (1.0 + gamma))
    }

    /// Bends each joint toward its target and places the nodes, root to tip. Each segment keeps its length.
    pub fn rebuild(&mut self, gain: f64, loads: &[NodeLoad]) {
        let mut frame = self.root_frame;
        self.nodes[0] = self.root;
        for i in 0..self.shape.segments() {
            let rest = frame.bent(self.shape.rest[i]);
            let target = self.target(i, &rest, loads[i + 1].net);
            let bend = self.bends[i];
            self.bends[i] = bend + (target - bend) * lagging(gain, self.shape.lags[i]);
            frame = rest.bent(self.bends[i]);
            self.directions[i] = frame.z;
            self.nodes[i + 1] = self.nodes[i] + frame.z * self.shape.lengths[i];
        }
    }

    /// The bend at which the spring of joint i holds `force`: eq. (10) solved for the joint.
    fn target(&self, i: usize, rest: &Frame, force: DVec3) -> DVec2 {
        let local = rest.to_local(force) / (self.shape.stiffness[i] * self.shape.lengths[i]);
        let p = local.truncate().length();
        if p == 0.0 {
            return DVec2::ZERO;
        }
        local.truncate() * (math::atan2(equilibrium_tangent(p, local.z), 1.0) / p)
    }
}

/// Parts of a step at most.
const MOST_PARTS: f64 = 1000.0;

/// |∇F| at a point [N/m], by differences over a tenth of a millimetre: the root of the sum of all squares.
fn slope(force: &dyn Fn(DVec3) -> DVec3, at: DVec3) -> f64 {
    const E: f64 = 1e-4;
    let along = |axis: DVec3| (force(at + axis * E) - force(at - axis * E)).length_squared();
    (along(DVec3::X) + along(DVec3::Y) + along(DVec3::Z)).sqrt() / (2.0 * E)
}

/// [`Fibre::loads`] for a pose that is given by its nodes and directions. `velocity` gives the flow at node i
/// and its place [m/s].
pub fn loads_of(
    shape: &FibreShape,
    root_frame: &Frame,
    nodes: &[DVec3],
    directions: &[DVec3],
    law: &DragLaw,
    velocity: &dyn Fn(usize, DVec3) -> DVec3,
) -> Vec<NodeLoad> {
    let mut loads = vec![NodeLoad::default(); nodes.len()];
    // F_L(N_{i+1}) + F_M(N_i): both are zero at the tip.
    let mut handed = DVec3::ZERO;
    for i in (0..nodes.len()).rev() {
        let flow = if i == 0 {
            DVec3::ZERO
        } else {
            law.force(shape.drag[i - 1], shape.radii[i - 1], velocity(i, nodes[i]))
        };
        let net = flow + handed;
        loads[i] = NodeLoad { flow, net, moment: DVec3::ZERO };
        if i == 0 {
            break;
        }
        let d = directions[i - 1];
        let along = d * net.dot(d);
        let across = net - along;
        let length = shape.lengths[i - 1];
        loads[i].moment = d.cross(across) * length;
        let (below, below_length) =
            if i >= 2 { (directions[i - 2], shape.lengths[i - 2]) } else { (root_frame.z, length) };
        handed = along + transmitted(loads[i].moment, below, below_length);
    }
    loads
}

/// F_M(N_{i−1}), eq. (12): the moment as a force at the end of the segment below, which runs along `below`.
/// In a straight chain it points as F_T does.
fn transmitted(moment: DVec3, below: DVec3, below_length: f64) -> DVec3 {
    (-below).cross(moment).normalize_or_zero() * (moment.length() / below_length)
}

/// tan α of the joint that rests under a force, eq. (10): with F the force over k L, p its part across the
/// rest direction and q its part along it, F_T = p cos α − q sin α, so t √(1 + t²) + q t = p for t = tan α.
/// One root lies above zero: the left side is convex there, and greater than p at the bound where the
/// iteration begins.
pub fn equilibrium_tangent(p: f64, q: f64) -> f64 {
    let mut t = (-q).max(0.0) + p.sqrt().max(p);
    for _ in 0..64 {
        let s = (1.0 + t * t).sqrt();
        let next = t - (t * s + q * t - p) * s / (1.0 + 2.0 * t * t + q * s);
        if next >= t || next <= 0.0 {
            break;
        }
        t = next;
    }
    t
}

/// Directions of the segments between nodes.
pub fn directions_between(nodes: &[DVec3]) -> Vec<DVec3> {
    nodes.windows(2).map(|pair| (pair[1] - pair[0]).normalize_or_zero()).collect()
}

/// The bends of a pose that is given by its nodes: what turns each segment's rest direction to where it
/// points.
pub fn bends_of(shape: &FibreShape, root_frame: &Frame, directions: &[DVec3]) -> Vec<(Frame, DVec2)> {
    let mut frame = *root_frame;
    let mut bends = Vec::with_capacity(directions.len());
    for (rest, direction) in shape.rest.iter().zip(directions) {
        let at_rest = frame.bent(*rest);
        bends.push((at_rest, bend_to(at_rest.to_local(*direction))));
        frame = at_rest.turned_to(*direction);
    }
    bends
}
