//! One step of eight plants of one species, lanes over the plants: the poses ([`pose`]), what acts on them
//! ([`loads`]), how fast the joints turn by the physical method ([`solve`]) or the procedural one
//! ([`lagged`]), and the new angles ([`advance`]).
//!
//! A lane's result depends on its own plant alone, bit for bit: what its level of detail leaves out is masked
//! where a neighbour's needs it.

mod advance;
pub mod bare;
mod lagged;
mod loads;
mod pose;
mod solve;

use fearless_simd::Simd;
use reef_flow::Level;

use crate::{
    lanes::{Lane, WIDTH},
    skeleton::Joint,
    water::Water,
};

pub(crate) use loads::{Capsule, SKIN};

/// What moves of a segment, eight plants side by side: 40 bytes a joint and plant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Row {
    /// θ and φ [rad].
    pub(crate) theta: Lane,
    pub(crate) phi: Lane,
    /// θ₀ and φ₀ [rad].
    pub(crate) theta_rest: Lane,
    pub(crate) phi_rest: Lane,
    /// Angular velocity, and velocity of its centre, in the last step [rad/s, m/s].
    pub(crate) omega: [Lane; 3],
    pub(crate) speed: [Lane; 3],
}

/// What eight plants are, and where.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Stand {
    /// Root, relative to the anchor [m].
    pub(crate) origin: [Lane; 3],
    /// The base that the roots turn against.
    pub(crate) x: [Lane; 3],
    pub(crate) y: [Lane; 3],
    /// Size over that of the species.
    pub(crate) size: Lane,
    /// Stiffness and damping over those of the species at this size.
    pub(crate) stiff: Lane,
    /// The ground under the plant: normal · p = height, relative to the anchor.
    pub(crate) normal: [Lane; 3],
    pub(crate) ground: Lane,
    /// Level of detail: 0 near, 1 middle, 2 far, and on the way from one to another.
    pub(crate) detail: Lane,
    /// Share of the procedural method.
    pub(crate) lagged: Lane,
    /// Centre of gravity relative to the anchor [m], its velocity [m/s] and its acceleration [m/s²] in the
    /// last step.
    pub(crate) gravity: [Lane; 3],
    pub(crate) drift: [Lane; 3],
    pub(crate) push: [Lane; 3],
    /// The box around all joints, relative to the anchor [m].
    pub(crate) low: [Lane; 3],
    pub(crate) high: [Lane; 3],
}

/// One step of a pack.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pass<'a> {
    pub(crate) joints: &'a [Joint],
    pub(crate) water: Water<'a>,
    /// World height of the anchor [m].
    pub(crate) level: f32,
    pub(crate) capsules: &'a [Capsule],
    /// Length of each plant's step [s]; 0: it is not stepped.
    pub(crate) dt: Lane,
    /// τ: lag of the procedural method [s].
    pub(crate) lag: f32,
    /// Stiffness of contacts [N/m]; 0: nothing touches.
    pub(crate) contact: f32,
    /// No part of any of them can come near the surface.
    pub(crate) deep: bool,
    /// By which of [`crate::skeleton::STATIONS`] plants that are not far take the waves; None: each segment
    /// takes its own.
    pub(crate) stations: Option<usize>,
}

/// Room for the work on one pack. What is in it from others changes nothing.
#[derive(Clone, Debug, Default)]
pub(crate) struct Room {
    nodes: Vec<Node>,
    /// What stands on a segment, where that is more than the next one (see [`solve`]).
    arts: Vec<solve::Art>,
    /// Torques of sub-branches (see [`lagged`]).
    lags: Vec<lagged::Torque>,
}

impl Room {
    /// Makes room for so many segments.
    pub(crate) fn fit(&mut self, segments: usize) {
        if self.nodes.len() < segments {
            self.nodes.resize(segments, Node::default());
            self.arts.resize(segments, solve::Art::default());
            self.lags.resize(segments, lagged::Torque::default());
        }
    }
}

/// What a step finds out of a segment.
#[derive(Clone, Copy, Debug, Default)]
struct Node {
    /// X and Y of its base, and where it begins, relative to the anchor [m].
    x: [Lane; 3],
    y: [Lane; 3],
    origin: [Lane; 3],
    /// Currents at its centre, where they are evaluated; on the way out: angular velocity and that of its
    /// origin.
    velocity: [Lane; 3],
    /// What the waves do there, where they are evaluated: velocity, acceleration, rise.
    orbit: [Lane; 3],
    acceleration: [Lane; 3],
    rise: Lane,
    /// Force at its centre in still water, without that of its own motion [N]; the drag it meets [N·s/m].
    force: [Lane; 3],
    drag: Lane,
    /// Force of what it touches, at its end [N]; 1 where it does.
    touch: [Lane; 3],
    touching: Lane,
    /// How much the surface holds it against being lifted [N/m].
    surface: Lane,
    /// How its two axes answer (see [`solve`]).
    answers: [solve::Answer; 2],
    /// By how much the procedural method turns it [rad].
    turn: [Lane; 2],
}

/// What a pack's lanes need.
#[derive(Clone, Copy, Debug)]
struct Needs {
    /// The finest level among them.
    level: u8,
    /// Whether one is on the way from one level to another, or coarser than the finest.
    mixed: bool,
    /// Whether all eight are stepped.
    full: bool,
    physical: bool,
    lagged: bool,
}

impl Needs {
    fn of(stand: &Stand, dt: &Lane) -> Option<Self> {
        let mut needs: Option<Self> = None;
        for i in (0..WIDTH).filter(|i| dt.0[*i] > 0.0) {
            let (detail, lagged) = (stand.detail.0[i], stand.lagged.0[i]);
            let level = if detail < 1.0 { 0 } else { u8::from(detail >= 2.0) + 1 };
            let known =
                needs.get_or_insert(Self { level, mixed: false, full: true, physical: false, lagged: false });
            known.mixed |= detail != f32::from(level) || known.level != level;
            known.level = known.level.min(level);
            known.physical |= lagged < 1.0;
            known.lagged |= lagged > 0.0;
        }
        if let Some(needs) = &mut needs {
            needs.full = dt.0.iter().all(|dt| *dt > 0.0);
        }
        needs
    }
}

/// What a step of a pack took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Joints whose angles were computed.
    pub joints: u64,
    /// Segments for which the water was evaluated.
    pub evaluations: u64,
    /// Plants that were stepped.
    pub plants: u64,
}

/// Steps the plants whose dt is above 0; the others stay as they are.
pub(crate) fn step(level: Level, pass: &Pass<'_>, stand: &mut Stand, rows: &mut [Row], room: &mut Room) {
    let Some(needs) = Needs::of(stand, &pass.dt) else { return };
    room.fit(rows.len());
    reef_flow::dispatch!(level, simd => wide(simd, pass, needs, stand, rows, room));
}

#[inline(always)]
fn wide<S: Simd>(
    simd: S,
    pass: &Pass<'_>,
    needs: Needs,
    stand: &mut Stand,
    rows: &mut [Row],
    room: &mut Room,
) {
    let nodes = &mut room.nodes[..rows.len()];
    if needs.level == 0 && !needs.mixed && pass.stations.is_none() {
        pose::with_loads(simd, pass, stand, rows, nodes);
    } else {
        pose::pose(simd, pass, stand, rows, nodes);
        loads::shared(simd, pass, needs, stand, nodes);
    }
    if needs.physical {
        solve::gather(simd, pass, needs, stand, rows, (nodes, &mut room.arts));
    }
    if needs.lagged {
        lagged::gather(simd, pass, needs, stand, rows, (nodes, &mut room.lags));
    }
    advance::advance(simd, pass, needs, stand, rows, nodes);
}
