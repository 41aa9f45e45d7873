//! Up to 64 fibres, side by side in memory: what one job of a step works on.

mod lane;

use std::sync::Arc;

use glam::{DVec2, DVec3, Vec3};
use reef_flow::simd::Ahead;

use super::{LANES, Sixteen};
use crate::{
    frame::{Frame, bend_direction},
    shape::FibreShape,
};

/// Groups of sixteen in a chunk at most: enough independent chains to fill a processor's pipelines.
pub(crate) const GROUPS: usize = 4;
/// Fibres in a chunk at most.
pub const MOST_FIBRES: usize = GROUPS * LANES;

/// The fibre in a lane of a chunk of `count`: lanes without one repeat the first, so that they stay finite.
fn fibre_in(count: usize, group: usize, at: usize) -> usize {
    let slot = group * LANES + at;
    if slot < count { slot } else { 0 }
}

/// All lanes of a chunk of `count` fibres: group, place in it, and the fibre there.
pub(crate) fn lanes(count: usize) -> impl Iterator<Item = (usize, usize, usize)> {
    (0..count.next_multiple_of(LANES)).map(move |slot| {
        let (group, at) = (slot / LANES, slot % LANES);
        (group, at, fibre_in(count, group, at))
    })
}

/// One segment of sixteen fibres: what never changes in a step. Like the others below, each vector a line of
/// the cache.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(align(64))]
pub(crate) struct Segment {
    /// L_i [m].
    pub(crate) length: Sixteen,
    /// L_i / L_{i−1}; 1 for the first.
    pub(crate) ratio: Sixteen,
    /// k_i L_i [N].
    pub(crate) spring: Sixteen,
    /// See [`Drag`].
    pub(crate) drag: Sixteen,
    /// r_i [m].
    pub(crate) radius: Sixteen,
}

/// One segment of sixteen fibres: its pose.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
pub(crate) struct Pose {
    /// Bend away from the rest direction [rad]: the state.
    pub(crate) bend: [Sixteen; 2],
    /// d_i. Within a step, from when the loads no longer need it until the bends have made it anew: F(N_i)
    /// [N].
    pub(crate) direction: [Sixteen; 3],
}

/// Sixteen fibres' roots and what belongs to a whole fibre.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct Group {
    /// N_0 [m], relative to the plant's origin.
    pub(crate) root: [Sixteen; 3],
    pub(crate) root_radius: Sixteen,
    /// N_top [m], relative to the plant's origin. The nodes between are not kept: from here they follow down
    /// along the directions, from the root up.
    pub(crate) tip: [Sixteen; 3],
    /// The frame that carries the first rest direction: x, y, z.
    pub(crate) frame: [[Sixteen; 3]; 3],
    /// From the plant's origin to the chunk's anchor [m]: added where the flow is evaluated.
    pub(crate) offset: [Sixteen; 3],
    /// The ball that holds a fibre: the middle between root and tip [m], relative to the plant's origin, half
    /// the fibre's length, and its greatest radius.
    pub(crate) middle: [Sixteen; 3],
    pub(crate) half_length: Sixteen,
    pub(crate) thickest: Sixteen,
    /// Γ over A |∇V| where that is the same everywhere (`pace.rs`): the greatest Σ_{j ≥ i} a_j D_j / (k_i
    /// L_i), with a the drag numbers.
    pub(crate) lever: Sixteen,
    /// 1 − exp(−dt/τ) of the step under way.
    pub(crate) gain: Sixteen,
    /// Square of the force [N²] at the root that breaks the fibre off.
    pub(crate) break2: Sixteen,
    /// 1: broken off.
    pub(crate) broken: Sixteen,
    /// Unit vector across the first segment, of the pose that was emitted last.
    pub(crate) normal: [Sixteen; 3],
}

/// Sixteen fibres' roots and their frames in the carrier's axes.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Seat {
    pub(crate) root: [Sixteen; 3],
    pub(crate) frame: [[Sixteen; 3]; 3],
}

/// What a fibre's drag numbers mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Drag {
    /// L_i · r_i [m²]; eq. (9) uses this drag coefficient, eq. (7) its own.
    Area {
        /// C_D of the linear law.
        coefficient: f32,
    },
    /// A_i itself [kg/s], as the figures' scenes give it. Always linear.
    Given,
}

/// Where one fibre's root sits on what carries it.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// In the carrying frame's axes [m].
    pub offset: DVec3,
    /// In the carrying frame's axes.
    pub frame: Frame,
}

/// A fibre on its way into a chunk.
#[derive(Clone, Debug)]
pub struct Lane {
    /// At rest.
    pub shape: FibreShape,
    /// On its plant.
    pub place: Place,
    /// From the chunk's anchor to the plant's origin [m].
    pub offset: Vec3,
    /// τ [s] ≥ 0.
    pub relaxation: f64,
    /// Force at the root that breaks it off [N]; infinite: never.
    pub break_force: f64,
}

/// The guides of an interpolated fibre: where they are and how much each counts. The weights sum to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Blend {
    /// Chunk (in the plant's list of simulated chunks) and fibre in it.
    pub guides: [(u32, u32); 3],
    /// Weights.
    pub weights: [f32; 3],
}

/// Fibres that are stepped together: all of one number of segments, all in one piece of flow.
#[derive(Clone, Debug)]
pub struct Chunk {
    pub(crate) count: usize,
    pub(crate) groups: usize,
    pub(crate) segments: usize,
    pub(crate) drag: Drag,
    /// Some segment's rest direction leaves the line of the segment below.
    pub(crate) curved: bool,
    /// Some fibre can break off.
    pub(crate) breakable: bool,
    /// A force on every node that is always there [N]: weight.
    pub(crate) load: [f32; 3],
    /// 1 where all groups are alike and share one group's constants, else the number of groups.
    pub(crate) kinds: usize,
    /// Segment by segment, `kinds` groups each; see [`Self::constants_of`] and [`Self::share_constants`].
    pub(crate) constants: Arc<Vec<Segment>>,
    /// Where the rest pose turns the segment below to, in that segment's frame, as `constants`; empty unless
    /// `curved`.
    pub(crate) rests: Vec<[Sixteen; 3]>,
    /// [`FibreShape::lags`], as `constants`; empty where each joint's is 1.
    pub(crate) lags: Vec<Sixteen>,
    /// Segment by segment, all groups of a segment side by side, the tip's first: the loads, which fetch all
    /// of this from far away, then go through memory forward, as processors expect. See [`Self::pose_of`].
    pub(crate) poses: Vec<Pose>,
    pub(crate) roots: Vec<Group>,
    pub(crate) seats: Vec<Seat>,
    places: Vec<Place>,
    relaxations: Vec<f64>,
    stiffness: Vec<(f64, f64)>,
    gained: (f64, f64),
}

impl Chunk {
    /// Packs fibres of one number of segments; [`MOST_FIBRES`] at most, at least one. None otherwise.
    /// `stiffness`: K and n of eq. (11) of each, kept for [`Self::set_stiffness`].
    pub fn new(lanes: &[Lane], drag: Drag, stiffness: &[(f64, f64)]) -> Option<Self> {
        let first = lanes.first()?;
        let segments = first.shape.segments();
        let equal = lanes.iter().all(|lane| lane.shape.segments() == segments);
        if lanes.len() > MOST_FIBRES || segments == 0 || !equal || stiffness.len() != lanes.len() {
            return None;
        }
        let groups = lanes.len().div_ceil(LANES);
        let mut chunk = Self {
            count: lanes.len(),
            groups,
            segments,
            drag,
            curved: lanes.iter().any(|lane| lane.shape.is_curved()),
            load: [0.0; 3],
            breakable: lanes.iter().any(|lane| lane.break_force.is_finite()),
            kinds: groups,
            constants: Arc::new(vec![Segment::default(); groups * segments]),
            rests: vec![Default::default(); groups * segments],
            lags: vec![[1.0; LANES]; groups * segments],
            poses: vec![Pose::default(); groups * segments],
            roots: vec![Group::idle(); groups],
            seats: vec![Seat::default(); groups],
            places: lanes.iter().map(|lane| lane.place).collect(),
            relaxations: lanes.iter().map(|lane| lane.relaxation).collect(),
            stiffness: stiffness.to_vec(),
            gained: (f64::NAN, f64::NAN),
        };
        for (group, at, fibre) in self::lanes(lanes.len()) {
            chunk.put(group, at, &lanes[fibre]);
        }
        let alike = |lane: &Lane| lane.shape == first.shape;
        if lanes.iter().all(alike) && stiffness.iter().all(|own| *own == stiffness[0]) {
            chunk.share();
        }
        if !chunk.curved {
            chunk.rests = Vec::new();
        }
        if !lanes.iter().any(|lane| lane.shape.lags()) {
            chunk.lags = Vec::new();
        }
        chunk.set_stiffness(1.0, 0.0);
        Some(chunk)
    }

    /// All fibres are alike: one group's constants are everyone's, and stay in the nearest cache.
    fn share(&mut self) {
        self.constants = Arc::new(self.constants.iter().step_by(self.groups).copied().collect());
        self.rests = self.rests.iter().step_by(self.groups).copied().collect();
        self.lags = self.lags.iter().step_by(self.groups).copied().collect();
        self.kinds = 1;
    }

    /// Takes another chunk's constants where they are the same: what many chunks share stays near.
    pub fn share_constants(&mut self, other: &Self) {
        if self.constants == other.constants {
            self.constants = other.constants.clone();
        }
    }

    /// Where a group's pose at a segment is.
    #[inline(always)]
    pub(crate) fn pose_of(&self, segment: usize, group: usize) -> usize {
        (self.segments - 1 - segment) * self.groups + group
    }

    /// Where a group finds what never changes at a segment.
    #[inline(always)]
    pub(crate) fn constants_of(&self, segment: usize, group: usize) -> usize {
        segment * self.kinds + group.min(self.kinds - 1)
    }

    fn put(&mut self, group: usize, at: usize, lane: &Lane) {
        let shape = &lane.shape;
        let all = Arc::make_mut(&mut self.constants);
        for s in 0..self.segments {
            let constants = &mut all[s * self.groups + group];
            constants.length[at] = shape.lengths[s] as f32;
            let below = if s == 0 { shape.lengths[0] } else { shape.lengths[s - 1] };
            constants.ratio[at] = (shape.lengths[s] / below) as f32;
            constants.drag[at] = shape.drag[s] as f32;
            constants.radius[at] = shape.radii[s] as f32;
            let rest = bend_direction(shape.rest[s]);
            for (axis, value) in self.rests[s * self.groups + group].iter_mut().zip(rest.to_array()) {
                axis[at] = value as f32;
            }
            self.lags[s * self.groups + group][at] = shape.lags[s] as f32;
        }
        let (root, seat) = (&mut self.roots[group], &mut self.seats[group]);
        let frame = &lane.place.frame;
        for axis in 0..3 {
            seat.root[axis][at] = lane.place.offset[axis] as f32;
            seat.frame[0][axis][at] = frame.x[axis] as f32;
            seat.frame[1][axis][at] = frame.y[axis] as f32;
            seat.frame[2][axis][at] = frame.z[axis] as f32;
        }
        root.root_radius[at] = shape.root_radius as f32;
        for (axis, value) in root.offset.iter_mut().zip(lane.offset.to_array()) {
            axis[at] = value;
        }
        root.half_length[at] = (0.5 * shape.length()) as f32;
        root.thickest[at] = shape.radii.iter().copied().fold(shape.root_radius, f64::max) as f32;
        root.break2[at] = (lane.break_force * lane.break_force).min(f64::from(f32::MAX)) as f32;
    }

    /// Adds what a step of this chunk needs, after one of `other`.
    pub(crate) fn needs(&self, other: &Self, ahead: &mut Ahead) {
        ahead.add(&self.seats);
        ahead.add(&self.roots);
        ahead.add(&self.poses);
        if !Arc::ptr_eq(&self.constants, &other.constants) {
            ahead.add(&self.constants);
        }
        ahead.add(&self.rests);
        ahead.add(&self.lags);
    }

    /// Fibres in it.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Segments of each.
    pub fn segments(&self) -> usize {
        self.segments
    }

    /// Nodes of all its fibres, roots included.
    pub fn nodes(&self) -> usize {
        self.count * (self.segments + 1)
    }

    /// k_i = `factor` · K (r_i / r_tip)^(n + `exponent`), eq. (11), with each fibre's own K and n.
    pub fn set_stiffness(&mut self, factor: f64, exponent: f64) {
        let all = Arc::make_mut(&mut self.constants);
        for (group, at, fibre) in lanes(self.count).take(self.kinds * LANES) {
            let (k, n) = self.stiffness[fibre];
            let tip = f64::from(all[(self.segments - 1) * self.kinds + group].radius[at]);
            for s in 0..self.segments {
                let constants = &mut all[s * self.kinds + group];
                let ratio = f64::from(constants.radius[at]) / tip;
                let stiffness = factor * k * crate::math::pow(ratio, n + exponent);
                let spring = stiffness * f64::from(constants.length[at]);
                constants.spring[at] = spring.clamp(1e-30, 1e30) as f32;
            }
        }
        for (group, at, _) in lanes(self.count) {
            self.roots[group].lever[at] = self.lever(group, at);
        }
    }

    /// See [`Group::lever`].
    fn lever(&self, group: usize, at: usize) -> f32 {
        let row = |s: usize| &self.constants[self.constants_of(s, group)];
        let length = |s: usize| f64::from(row(s).length[at]);
        let mut levers: f64 = (0..self.segments).map(|s| (s + 1) as f64 * length(s)).sum();
        let (mut sum, mut most) = (0.0, 0.0_f64);
        for s in (0..self.segments).rev() {
            sum += f64::from(row(s).drag[at]) * levers;
            most = most.max(sum / f64::from(row(s).spring[at]));
            levers -= (s + 1) as f64 * length(s);
        }
        most.min(1e15) as f32
    }

    /// Works out how far each fibre goes toward its target in a step of `dt` [s]; `damping` multiplies every
    /// τ.
    pub fn set_gain(&mut self, dt: f64, damping: f64) {
        if self.gained == (dt, damping) {
            return;
        }
        self.gained = (dt, damping);
        for (group, at, fibre) in lanes(self.count) {
            let tau = self.relaxations[fibre];
            self.roots[group].gain[at] = crate::math::relaxation(dt, tau * damping) as f32;
        }
    }

    /// dt/τ of a fibre in the step under way.
    pub(crate) fn rate(&self, group: usize, at: usize) -> f64 {
        let (dt, damping) = self.gained;
        dt / (self.relaxations[fibre_in(self.count, group, at)] * damping)
    }

    /// Gives every node a force that is always there [N]: weight.
    pub fn set_load(&mut self, load: Vec3) {
        self.load = load.to_array();
    }

    /// As [`super::carry`], with a carrier for each fibre.
    pub fn carry_each(&mut self, carrier: impl Fn(usize) -> (DVec3, Frame)) {
        for (group, at, fibre) in lanes(self.count) {
            let place = &self.places[fibre];
            let (origin, carrier) = carrier(fibre);
            let root = origin + carrier.to_world(place.offset);
            let frame = carrier.compose(&place.frame);
            let into = &mut self.roots[group];
            for axis in 0..3 {
                into.root[axis][at] = root[axis] as f32;
                into.frame[0][axis][at] = frame.x[axis] as f32;
                into.frame[1][axis][at] = frame.y[axis] as f32;
                into.frame[2][axis][at] = frame.z[axis] as f32;
            }
        }
    }

    /// Moves a fibre's anchor: from the chunk's anchor to its plant's origin [m].
    pub fn set_offset(&mut self, fibre: usize, offset: Vec3) {
        for (group, at, _) in lanes(self.count).filter(|(.., own)| *own == fibre) {
            for (axis, value) in self.roots[group].offset.iter_mut().zip(offset.to_array()) {
                axis[at] = value;
            }
        }
    }

    fn vector(from: &[Sixteen; 3], at: usize) -> Vec3 {
        Vec3::new(from[0][at], from[1][at], from[2][at])
    }

    /// Node `node` of a fibre, 0 the root [m, relative to the plant's origin].
    pub fn node(&self, fibre: usize, node: usize) -> Vec3 {
        let (group, at) = (fibre / LANES, fibre % LANES);
        (0..node).fold(Self::vector(&self.roots[group].root, at), |from, segment| {
            let length = self.constants[self.constants_of(segment, group)].length[at];
            let [x, y, z] = self.direction(fibre, segment).to_array();
            // Rounded once, as everywhere.
            Vec3::new(x.mul_add(length, from.x), y.mul_add(length, from.y), z.mul_add(length, from.z))
        })
    }

    /// Radius there [m].
    pub fn radius(&self, fibre: usize, node: usize) -> f32 {
        let (group, at) = (fibre / LANES, fibre % LANES);
        match node {
            0 => self.roots[group].root_radius[at],
            _ => self.constants[self.constants_of(node - 1, group)].radius[at],
        }
    }

    /// Direction of segment `segment`, 0 the lowest.
    pub fn direction(&self, fibre: usize, segment: usize) -> Vec3 {
        Self::vector(&self.poses[self.pose_of(segment, fibre / LANES)].direction, fibre % LANES)
    }

    /// The frame that carries a fibre's first segment.
    pub fn root_frame(&self, fibre: usize) -> Frame {
        let (group, at) = (fibre / LANES, fibre % LANES);
        let [x, y, z] = self.roots[group].frame.map(|axis| Self::vector(&axis, at).as_dvec3());
        Frame { x, y, z }
    }

    /// A unit vector across a fibre's first segment, carried from its root without twist; of the pose that
    /// was emitted last.
    pub fn normal(&self, fibre: usize) -> Vec3 {
        Self::vector(&self.roots[fibre / LANES].normal, fibre % LANES)
    }

    /// A fibre's shape, as the kernel has it.
    pub fn shape(&self, fibre: usize) -> FibreShape {
        let (group, at) = (fibre / LANES, fibre % LANES);
        let rows = || (0..self.segments).map(|s| &self.constants[self.constants_of(s, group)]);
        let lengths: Vec<f64> = rows().map(|row| f64::from(row.length[at])).collect();
        FibreShape {
            root_radius: f64::from(self.roots[group].root_radius[at]),
            radii: rows().map(|row| f64::from(row.radius[at])).collect(),
            stiffness: rows().zip(&lengths).map(|(row, length)| f64::from(row.spring[at]) / length).collect(),
            drag: rows().map(|row| f64::from(row.drag[at])).collect(),
            rest: (0..self.segments)
                .map(|s| match self.rests.get(self.constants_of(s, group)) {
                    Some(rest) => crate::frame::bend_to(Self::vector(rest, at).as_dvec3()),
                    None => DVec2::ZERO,
                })
                .collect(),
            lags: (0..self.segments)
                .map(|s| self.lags.get(self.constants_of(s, group)).map_or(1.0, |lag| f64::from(lag[at])))
                .collect(),
            lengths,
        }
    }

    /// What the drag numbers of [`Self::shape`] mean.
    pub fn drag(&self) -> Drag {
        self.drag
    }

    /// The frame at the tip: carried along the chain without twist from the root.
    pub fn tip_frame(&self, fibre: usize) -> Frame {
        let root = self.root_frame(fibre);
        let mut frame = Frame { z: root.z.normalize_or(DVec3::Y), ..root };
        for segment in 0..self.segments {
            let direction = self.direction(fibre, segment).as_dvec3().normalize_or(frame.z);
            frame = frame.turned_to(direction);
        }
        frame
    }

    /// Whether some fibre can break off.
    pub fn is_breakable(&self) -> bool {
        self.breakable
    }

    /// Whether a fibre is broken off.
    pub fn is_broken(&self, fibre: usize) -> bool {
        self.breakable && self.roots[fibre / LANES].broken[fibre % LANES] != 0.0
    }

    /// Whether any fibre is broken off.
    pub fn has_broken(&self) -> bool {
        self.breakable && (0..self.count).any(|fibre| self.is_broken(fibre))
    }

    /// Numbers of state a chunk has: see [`Self::save`].
    pub fn state_len(&self) -> usize {
        (self.segments * 2 + 1) * self.count.next_multiple_of(SAVED)
    }

    /// Writes every number that a later step depends on; `into` has room for just these.
    pub fn save(&self, into: &mut [f32]) {
        let parts = self.count.div_ceil(SAVED);
        let mut into = into.chunks_exact_mut(SAVED);
        let mut put = |from: &[f32]| {
            if let Some(into) = into.next() {
                into.copy_from_slice(from);
            }
        };
        for row in self.poses.chunks_exact(self.groups).rev() {
            for part in 0..parts {
                let (group, lanes) = saved_part(part);
                row[group].bend.iter().for_each(|axis| put(&axis[lanes.clone()]));
            }
        }
        for part in 0..parts {
            let (group, lanes) = saved_part(part);
            put(&self.roots[group].broken[lanes]);
        }
    }

    /// Takes back what [`Self::save`] wrote; the poses follow with the next [`super::rebuild`]. False, and
    /// nothing happens, for numbers that no step leaves behind.
    pub fn load(&mut self, from: &[f32]) -> bool {
        if from.len() != self.state_len() {
            return false;
        }
        let (bends, breaks) = from.split_at(from.len() - self.count.next_multiple_of(SAVED));
        let is_bend = |(x, y): (&f32, &f32)| x * x + y * y <= MOST_BEND2;
        let mut axes = bends.chunks_exact(2 * SAVED).map(|pair| pair.split_at(SAVED));
        if !axes.all(|(x, y)| x.iter().zip(y).all(is_bend)) || !breaks.iter().all(|b| [0.0, 1.0].contains(b))
        {
            return false;
        }
        let mut parts = from.chunks_exact(SAVED);
        let mut take = |into: &mut [f32]| {
            if let Some(part) = parts.next() {
                into.copy_from_slice(part);
            }
        };
        let count = self.count.div_ceil(SAVED);
        for row in self.poses.chunks_exact_mut(self.groups).rev() {
            for part in 0..count {
                let (group, lanes) = saved_part(part);
                row[group].bend.iter_mut().for_each(|axis| take(&mut axis[lanes.clone()]));
            }
        }
        for part in 0..count {
            let (group, lanes) = saved_part(part);
            take(&mut self.roots[group].broken[lanes]);
        }
        true
    }
}

/// A joint turns to any direction by half a turn at most, and by what rounding adds to its square.
const MOST_BEND2: f32 = 1.000_01 * core::f32::consts::PI * core::f32::consts::PI;

/// A state is written by eights of fibres, whatever the width of a vector: it does not change with the
/// kernel.
const SAVED: usize = 8;

/// Group and lanes of one of a state's eights.
fn saved_part(part: usize) -> (usize, core::ops::Range<usize>) {
    let first = part * SAVED % LANES;
    (part * SAVED / LANES, first..first + SAVED)
}

impl Group {
    /// Before any fibre is in it.
    fn idle() -> Self {
        Self {
            root: [[0.0; LANES]; 3],
            root_radius: [0.0; LANES],
            tip: [[0.0; LANES]; 3],
            frame: [[[0.0; LANES]; 3]; 3],
            offset: [[0.0; LANES]; 3],
            gain: [0.0; LANES],
            middle: [[0.0; LANES]; 3],
            half_length: [0.0; LANES],
            thickest: [0.0; LANES],
            lever: [0.0; LANES],
            break2: [f32::MAX; LANES],
            broken: [0.0; LANES],
            normal: [[1.0; LANES], [0.0; LANES], [0.0; LANES]],
        }
    }
}
