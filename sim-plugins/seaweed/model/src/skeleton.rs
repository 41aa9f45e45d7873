//! What a plant is made of (§4.2): a tree of segments, each turned against its parent by two angles.
//!
//! Segment i begins h_i up its parent's Y axis. Its base is the parent's, turned by θ_i about the parent's Y
//! and then by φ_i about its own X. All numbers are those of a plant of size 1; individuals scale them (see
//! [`crate::bed`]).

mod detail;

use core::fmt;

use glam::{DQuat, DVec3};

pub(crate) use detail::STATIONS;

/// Most segments of one plant.
pub const MOST_SEGMENTS: usize = 4096;

/// A segment, before it is part of a [`Skeleton`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// The segment that it stands on, by its number; None: the ground.
    pub parent: Option<usize>,
    /// h: where on its parent's Y axis it begins [m].
    pub height: f64,
    /// L [m].
    pub length: f64,
    /// θ₀: equilibrium turn about the parent's Y [rad].
    pub theta: f64,
    /// φ₀: equilibrium turn about its own X [rad].
    pub phi: f64,
    /// k of the springs of both angles [N·m/rad].
    pub stiffness: f64,
    /// v: damping of both angles [N·m·s/rad].
    pub damping: f64,
    /// m: its own mass and that of the water which moves with it [kg].
    pub mass: f64,
    /// Water that the orbits push on: ρV and what moves along [kg].
    pub carried: f64,
    /// Drag of water that passes [N per m/s].
    pub drag: f64,
    /// Buoyancy less weight, upward [N]: of gas bladders and tissue.
    pub lift: f64,
    /// Its weight in air [N], which pulls down what comes out of the water.
    pub weight: f64,
    /// Of what touches the ground and rocks, at its end [m].
    pub radius: f64,
}

impl Default for Segment {
    /// A piece of a blade: ten in a row make one of a metre that sways well.
    fn default() -> Self {
        Self {
            parent: None,
            height: 0.0,
            length: 0.1,
            theta: 0.0,
            phi: 0.0,
            stiffness: 1.5,
            damping: 0.25,
            mass: 0.2,
            carried: 0.2,
            drag: 1.0,
            lift: 0.05,
            weight: 0.5,
            radius: 0.01,
        }
    }
}

/// What is wrong with a list of segments: which, what, and what is allowed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SkeletonError {
    /// The segment's number; None: the whole list.
    pub segment: Option<usize>,
    /// The key.
    pub key: &'static str,
    /// What is wrong with it, and what is allowed.
    pub problem: String,
}

impl fmt::Display for SkeletonError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.segment {
            Some(number) => write!(f, "segments[{number}].{}: {}", self.key, self.problem),
            None => write!(f, "{}: {}", self.key, self.problem),
        }
    }
}

impl std::error::Error for SkeletonError {}

/// A part of a plant as kernels take it. f32, parents before children.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Joint {
    /// Of the parent; [`GROUND`]: none.
    pub(crate) parent: u32,
    /// Levels of detail that compute it: 0 all, 1 near and middle, 2 near alone.
    pub(crate) tier: u8,
    /// What stands on it.
    pub(crate) above: Above,
    /// It is the next after its parent, and all that stands on that: a part of a chain.
    pub(crate) only: bool,
    pub(crate) height: f32,
    pub(crate) length: f32,
    pub(crate) stiffness: f32,
    pub(crate) damping: f32,
    pub(crate) mass: f32,
    pub(crate) carried: f32,
    pub(crate) drag: f32,
    pub(crate) lift: f32,
    pub(crate) weight: f32,
    pub(crate) radius: f32,
    /// How deep its end is in the ground at rest [m]: so much of it is no contact.
    pub(crate) buried: f32,
    /// Whose water it feels at the middle level, and far: the segment's own number, or that of one near by.
    pub(crate) middle: u32,
    pub(crate) far: u32,
    /// Not far away, by [`STATIONS`]: the waves at it are between those at these two, so far from the first
    /// to the second.
    pub(crate) stations: [[u32; 2]; STATIONS.len()],
    pub(crate) between: [f32; STATIONS.len()],
    /// Segments from the root to this one, itself included.
    pub(crate) depth: f32,
    /// Length of the way from the root to its end [m].
    pub(crate) span: f32,
}

/// What stands on a segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Above {
    /// Nothing.
    Nothing,
    /// The next segment alone.
    Next,
    /// Others.
    Branches,
}

/// Parent of the root segments.
pub(crate) const GROUND: u32 = u32::MAX;

/// Segments in an order in which parents come first.
#[derive(Clone, Debug, PartialEq)]
pub struct Skeleton {
    pub(crate) joints: Vec<Joint>,
    segments: Vec<Segment>,
    reach: f64,
    mass: f64,
    /// Level by level: segments that it computes, and for which it evaluates the water.
    computed: [usize; 3],
    evaluated: [usize; 3],
}

impl Skeleton {
    /// Checks segments, in any order, and sorts them so that parents come first; otherwise the order stays.
    ///
    /// # Errors
    /// The first segment with a parent that is not there or that stands on itself, with a length, mass or
    /// stiffness that is not above 0, with another number that is negative where it must not be or not
    /// finite; too many segments, or none.
    pub fn new(segments: &[Segment]) -> Result<Self, SkeletonError> {
        let whole = |problem: String| SkeletonError { segment: None, key: "segments", problem };
        if segments.is_empty() {
            return Err(whole("a skeleton needs at least one".into()));
        }
        if segments.len() > MOST_SEGMENTS {
            return Err(whole(format!("there are {}; at most {MOST_SEGMENTS} are allowed", segments.len())));
        }
        for (number, segment) in segments.iter().enumerate() {
            check(number, segment, segments.len())?;
        }
        let order = order(segments)?;
        let mut place = vec![0; segments.len()];
        for (at, number) in order.iter().enumerate() {
            place[*number] = at;
        }
        let sorted: Vec<Segment> = order
            .iter()
            .map(|number| {
                let segment = segments[*number];
                Segment { parent: segment.parent.map(|parent| place[parent]), ..segment }
            })
            .collect();
        Ok(Self::of_sorted(sorted))
    }

    fn of_sorted(segments: Vec<Segment>) -> Self {
        let (levels, ends) = (detail::levels(&segments), rest_ends(&segments));
        let mut joints: Vec<Joint> = Vec::with_capacity(segments.len());
        for ((segment, level), end) in segments.iter().zip(levels).zip(ends) {
            let below = segment.parent.map(|parent| joints[parent]);
            let begin = below.map_or(0.0, |below| below.span - below.length) + segment.height as f32;
            joints.push(Joint {
                parent: segment.parent.map_or(GROUND, |parent| parent as u32),
                tier: level.tier,
                above: Above::Nothing,
                only: false,
                height: segment.height as f32,
                length: segment.length as f32,
                stiffness: segment.stiffness as f32,
                damping: segment.damping as f32,
                mass: segment.mass as f32,
                carried: segment.carried as f32,
                drag: segment.drag as f32,
                lift: segment.lift as f32,
                weight: segment.weight as f32,
                radius: segment.radius as f32,
                buried: (segment.radius - end.y).max(0.0) as f32,
                middle: level.middle as u32,
                far: level.far as u32,
                stations: level.stations.map(|stations| stations.map(|station| station as u32)),
                between: level.between.map(|between| between as f32),
                depth: 1.0 + below.map_or(0.0, |below| below.depth),
                span: begin + segment.length as f32,
            });
            if let Some(parent) = segment.parent {
                let next = joints[parent].above == Above::Nothing && parent + 2 == joints.len();
                joints[parent].above = if next { Above::Next } else { Above::Branches };
            }
        }
        for number in 0..joints.len().saturating_sub(1) {
            joints[number + 1].only = joints[number].above == Above::Next;
        }
        let reach = joints.iter().map(|joint| f64::from(joint.span + joint.radius)).fold(0.0, f64::max);
        let mass = segments.iter().map(|segment| segment.mass).sum();
        let count = |of: &dyn Fn(u32, &Joint, u8) -> bool| {
            [0, 1, 2].map(|level| (0..).zip(&joints).filter(|(i, joint)| of(*i, joint, level)).count())
        };
        let computed = count(&|_, joint, level| joint.tier + level <= 2);
        let evaluated = count(&|number, joint, level| joint.feels(number, level));
        Self { joints, segments, reach, mass, computed, evaluated }
    }

    /// All segments, parents first.
    pub fn segments(&self) -> &[Segment] {
        &self.segments
    }

    /// Where the segments begin at rest, relative to a root that stands upright [m], and their bases.
    pub fn rest(&self) -> Vec<(DVec3, DQuat)> {
        rest_bases(&self.segments)
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.joints.len()
    }

    /// Never: a skeleton has at least one segment.
    pub fn is_empty(&self) -> bool {
        self.joints.is_empty()
    }

    /// No point of the plant comes farther from its root than this [m].
    pub fn reach(&self) -> f64 {
        self.reach
    }

    /// Mass of all segments with the water that moves with them [kg].
    pub fn mass(&self) -> f64 {
        self.mass
    }

    /// How many segments a level of detail (0 near, 1 middle, 2 far) computes.
    pub fn computed(&self, level: u8) -> usize {
        self.computed[usize::from(level.min(2))]
    }

    /// How many segments a level of detail evaluates the water for.
    pub fn evaluated(&self, level: u8) -> usize {
        self.evaluated[usize::from(level.min(2))]
    }
}

impl Joint {
    /// Whether the water is evaluated for this one, whose number is given, at a level of detail.
    #[inline(always)]
    pub(crate) fn feels(&self, number: u32, level: u8) -> bool {
        match level {
            0 => true,
            1 => self.middle == number,
            _ => self.far == number,
        }
    }
}

fn check(number: usize, segment: &Segment, count: usize) -> Result<(), SkeletonError> {
    let refuse = |key, problem: String| Err(SkeletonError { segment: Some(number), key, problem });
    if let Some(parent) = segment.parent.filter(|parent| *parent >= count) {
        return refuse("parent", format!("must be the number of a segment, below {count}, is {parent}"));
    }
    let positive =
        [("length", segment.length, 1e3), ("mass", segment.mass, 1e6), ("stiffness", segment.stiffness, 1e9)];
    for (key, value, most) in positive {
        if !(value > 1e-9 && value <= most) {
            return refuse(key, format!("must be above 1e-9 and at most {most}, is {value}"));
        }
    }
    let others = [
        ("height", segment.height, 1e3),
        ("damping", segment.damping, 1e9),
        ("carried", segment.carried, 1e6),
        ("drag", segment.drag, 1e6),
        ("weight", segment.weight, 1e6),
        ("radius", segment.radius, 1e2),
    ];
    for (key, value, most) in others {
        if !(0.0..=most).contains(&value) {
            return refuse(key, format!("must be from 0 to {most}, is {value}"));
        }
    }
    if segment.parent.is_none() && segment.height != 0.0 {
        return refuse("height", format!("must be 0 where there is no parent, is {}", segment.height));
    }
    for (key, value, most) in
        [("theta", segment.theta, 1e3), ("phi", segment.phi, 1e3), ("lift", segment.lift, 1e6)]
    {
        if value.is_nan() || value.abs() > most {
            return refuse(key, format!("must be from -{most} to {most}, is {value}"));
        }
    }
    Ok(())
}

/// Numbers of segments so that parents come first.
fn order(segments: &[Segment]) -> Result<Vec<usize>, SkeletonError> {
    let mut placed = vec![false; segments.len()];
    let mut order = Vec::with_capacity(segments.len());
    let mut way = Vec::new();
    for number in 0..segments.len() {
        let mut at = Some(number);
        while let Some(here) = at.filter(|here| !placed[*here]) {
            if way.len() > segments.len() {
                let problem = "stands on itself: following parents must lead to the ground".to_owned();
                return Err(SkeletonError { segment: Some(number), key: "parent", problem });
            }
            way.push(here);
            at = segments[here].parent;
        }
        while let Some(here) = way.pop() {
            placed[here] = true;
            order.push(here);
        }
    }
    Ok(order)
}

/// Where the segments end at rest, relative to a root that stands upright [m].
fn rest_ends(segments: &[Segment]) -> Vec<DVec3> {
    let up =
        |(segment, (origin, turn)): (&Segment, (DVec3, DQuat))| origin + turn * (segment.length * DVec3::Y);
    segments.iter().zip(rest_bases(segments)).map(up).collect()
}

/// Where the segments begin at rest, relative to a root that stands upright [m], and their bases. Parents
/// come first.
fn rest_bases(segments: &[Segment]) -> Vec<(DVec3, DQuat)> {
    let mut bases: Vec<(DVec3, DQuat)> = Vec::with_capacity(segments.len());
    for segment in segments {
        let (origin, turn) = segment.parent.map_or((DVec3::ZERO, DQuat::IDENTITY), |parent| bases[parent]);
        let origin = origin + turn * (segment.height * DVec3::Y);
        bases.push((
            origin,
            turn * DQuat::from_rotation_y(segment.theta) * DQuat::from_rotation_x(segment.phi),
        ));
    }
    bases
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(super) fn chain(count: usize) -> Vec<Segment> {
        (0..count)
            .map(|i| Segment {
                parent: i.checked_sub(1),
                height: if i == 0 { 0.0 } else { 0.1 },
                ..Segment::default()
            })
            .collect()
    }

    #[test]
    fn parents_come_first_whatever_the_order_was() {
        let mut segments = chain(4);
        segments.reverse();
        for segment in &mut segments {
            segment.parent = segment.parent.map(|parent| 3 - parent);
        }
        let skeleton = Skeleton::new(&segments).unwrap();
        assert_eq!(skeleton, Skeleton::new(&chain(4)).unwrap());
        assert!((skeleton.reach() - 0.41).abs() < 1e-6);
    }

    #[test]
    fn wrong_segments_are_refused_with_their_place() {
        let refusal = |change: fn(&mut Vec<Segment>)| {
            let mut segments = chain(3);
            change(&mut segments);
            Skeleton::new(&segments).unwrap_err().to_string()
        };
        assert_eq!(refusal(Vec::clear), "segments: a skeleton needs at least one");
        let text = refusal(|s| s.resize(10_000_000, Segment::default()));
        assert_eq!(text, "segments: there are 10000000; at most 4096 are allowed");
        let text = refusal(|s| s[0] = Segment { parent: Some(2), height: 0.1, ..s[0] });
        assert_eq!(text, "segments[0].parent: stands on itself: following parents must lead to the ground");
        let text = refusal(|s| s[1].parent = Some(3));
        assert_eq!(text, "segments[1].parent: must be the number of a segment, below 3, is 3");
        let text = refusal(|s| s[2].mass = -1.0);
        assert_eq!(text, "segments[2].mass: must be above 1e-9 and at most 1000000, is -1");
        let text = refusal(|s| s[2].stiffness = f64::NAN);
        assert!(text.starts_with("segments[2].stiffness: must be above"), "{text}");
        let text = refusal(|s| s[1].length = 0.0);
        assert!(text.starts_with("segments[1].length: must be above"), "{text}");
        let text = refusal(|s| s[0].height = 0.1);
        assert!(text.starts_with("segments[0].height: must be 0"), "{text}");
        let text = refusal(|s| s[0].lift = f64::INFINITY);
        assert!(text.starts_with("segments[0].lift: must be from"), "{text}");
    }
}
