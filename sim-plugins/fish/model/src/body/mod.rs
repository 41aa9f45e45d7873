//! What a fish is made of (thesis, §5.3): segments put behind one another, each with its nodes, its own
//! springs and the rule by which it is tied to the one before.
//!
//! A segment type is one file that implements [`Segment`]. The body's axes: x forward, y up, z to its right.

pub mod fluke;
pub mod nose;
pub mod section;
pub mod tail;

use core::fmt;

use glam::DVec3;

use fluke::Fluke;
use nose::Nose;
use section::Section;
use tail::Tail;

/// Least and most sections of a body.
pub const SECTIONS: core::ops::RangeInclusive<usize> = 2..=64;

/// Which stiffness a spring has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Edges and diagonals of a section, and the fin's own spring.
    Cross,
    /// Diagonals along the body's sides.
    Side,
    /// Along the body.
    Long,
}

/// What makes a spring a muscle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Muscle {
    /// 1 on the left, −1 on the right.
    pub left: i8,
    /// 1 at the top, −1 at the bottom.
    pub top: i8,
    /// Which of the gaps with muscles, front to back, from 0.
    pub gap: u16,
}

/// A spring between two nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Link {
    /// The nodes.
    pub ends: [usize; 2],
    /// Its stiffness.
    pub role: Role,
    /// None: it does not contract.
    pub muscle: Option<Muscle>,
}

impl Link {
    fn new(a: usize, b: usize, role: Role) -> Self {
        Self { ends: [a, b], role, muscle: None }
    }
}

/// A piece of the skin that pushes water: three or four nodes, counter-clockwise seen from outside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Face {
    nodes: [usize; 4],
    count: usize,
}

impl Face {
    fn triangle(a: usize, b: usize, c: usize) -> Self {
        Self { nodes: [a, b, c, c], count: 3 }
    }

    fn quad(a: usize, b: usize, c: usize, d: usize) -> Self {
        Self { nodes: [a, b, c, d], count: 4 }
    }

    /// Its nodes.
    pub fn nodes(&self) -> &[usize] {
        &self.nodes[..self.count]
    }

    /// S n [m²]: its area along its outward normal, where its nodes are at `at`. Of four nodes half the
    /// product of the diagonals, so that left and right are mirrors.
    pub fn area(&self, at: &[DVec3]) -> DVec3 {
        let [a, b, c, d] = self.nodes.map(|node| at[node]);
        let [first, second] = if self.count == 3 { [b - a, c - a] } else { [c - a, d - b] };
        0.5 * first.cross(second)
    }
}

/// The segment in front of one that is tied to it.
#[derive(Clone, Copy, Debug)]
pub struct Before {
    /// How many nodes it has.
    pub count: usize,
}

/// What ties a segment to the one before. Nodes are numbered through: first those of the one before, then
/// the segment's own.
#[derive(Clone, Debug, Default)]
pub struct Joined {
    /// Springs between the two.
    pub springs: Vec<Link>,
    /// Skin between the two. Any two nodes of a face are joined by a spring.
    pub faces: Vec<Face>,
}

/// A kind of segment.
pub trait Segment {
    /// Its nodes at rest [m], relative to where it stands on the body's axis.
    fn nodes(&self) -> Vec<DVec3>;

    /// Springs among its own nodes, numbered from 0.
    fn springs(&self) -> Vec<Link>;

    /// 1 for each node that floats up, −1 for each that sinks; they sum to 0, and right the body.
    fn lift(&self) -> Vec<i8>;

    /// How it is tied to the one before. The first segment of a body is tied to nothing.
    fn connect(&self, _before: &Before) -> Joined {
        Joined::default()
    }
}

/// A wall between two edges, of the segment before and of this one: two diagonals and a face.
fn gap(joined: &mut Joined, [a, b]: [usize; 2], [a_own, b_own]: [usize; 2]) {
    joined.springs.push(Link::new(a, b_own, Role::Side));
    joined.springs.push(Link::new(b, a_own, Role::Side));
    joined.faces.push(Face::quad(a, b, b_own, a_own));
}

/// The rest shape of a fish with a nose, sections and a fin.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// From each section to what is before it [m]: the first one's to the nose.
    pub lengths: Vec<f64>,
    /// Half of each section's extent from left to right [m].
    pub half_widths: Vec<f64>,
    /// Half of each section's extent from top to bottom [m].
    pub half_heights: Vec<f64>,
    /// From the last section to the fin's edge [m].
    pub tail: f64,
    /// Half of the fin's extent [m].
    pub half_span: f64,
    /// The fin is level, as a whale's.
    pub level_fin: bool,
}

impl Default for Profile {
    /// A fish of 0.2 m with five sections.
    fn default() -> Self {
        Self {
            lengths: vec![0.028, 0.031, 0.031, 0.031, 0.031],
            half_widths: vec![0.010, 0.015, 0.0145, 0.0145, 0.010],
            half_heights: vec![0.011, 0.024, 0.024, 0.023, 0.0125],
            tail: 0.048,
            half_span: 0.036,
            level_fin: false,
        }
    }
}

/// What is wrong with a body: which key, and what is allowed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BodyError {
    /// The key.
    pub key: String,
    /// What is wrong, and what is allowed.
    pub problem: String,
}

impl fmt::Display for BodyError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.key, self.problem)
    }
}

impl core::error::Error for BodyError {}

fn refuse<T>(key: impl Into<String>, problem: impl Into<String>) -> Result<T, BodyError> {
    Err(BodyError { key: key.into(), problem: problem.into() })
}

/// Nodes, springs and skin of a fish at rest. Nodes in the thesis's order: nose; sections front to back, each
/// left-top, left-bottom, right-bottom, right-top; the fin.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    nodes: Vec<DVec3>,
    springs: Vec<Link>,
    faces: Vec<Face>,
    lift: Vec<i8>,
    /// Where each segment's nodes begin, and the end.
    bounds: Vec<usize>,
}

impl Body {
    /// A nose, sections and a fin by their profile. All gaps between sections have muscles but the first one;
    /// of two sections the only gap has them.
    ///
    /// # Errors
    /// The key that is wrong, and what is allowed.
    pub fn new(profile: &Profile) -> Result<Self, BodyError> {
        let count = profile.half_widths.len();
        if !SECTIONS.contains(&count) {
            let (least, most) = (SECTIONS.start(), SECTIONS.end());
            return refuse("half_widths", format!("has {count} sections; allowed: {least} to {most}"));
        }
        let lists = [
            ("lengths", &profile.lengths),
            ("half_widths", &profile.half_widths),
            ("half_heights", &profile.half_heights),
        ];
        for (key, list) in lists {
            if list.len() != count {
                return refuse(key, format!("has {} numbers; half_widths has {count}", list.len()));
            }
            if let Some((i, value)) = list.iter().enumerate().find(|(_, value)| !is_length(**value)) {
                return refuse(format!("{key}[{i}]"), format!("must be a length above 0, is {value}"));
            }
        }
        for (key, value) in [("tail", profile.tail), ("half_span", profile.half_span)] {
            if !is_length(value) {
                return refuse(key, format!("must be a length above 0, is {value}"));
            }
        }
        let mut body = Self {
            nodes: Vec::new(),
            springs: Vec::new(),
            faces: Vec::new(),
            lift: Vec::new(),
            bounds: vec![0],
        };
        let mut station = 0.0;
        body.add(&Nose, station);
        let first_gap = if count > 2 { 2 } else { 1 };
        for i in 0..count {
            station -= profile.lengths[i];
            let muscles = i.checked_sub(first_gap).map(|gap| gap as u16);
            let (half_width, half_height) = (profile.half_widths[i], profile.half_heights[i]);
            body.add(&Section { half_width, half_height, muscles }, station);
        }
        station -= profile.tail;
        if profile.level_fin {
            body.add(&Fluke { half_span: profile.half_span }, station);
        } else {
            body.add(&Tail { half_span: profile.half_span }, station);
        }
        body.center();
        Ok(body)
    }

    /// Puts a segment behind the others.
    fn add(&mut self, segment: &dyn Segment, station: f64) {
        let first = self.nodes.len();
        let before = self.bounds.len().checked_sub(2).map_or(first, |last| self.bounds[last]);
        let moved = |link: Link, by: usize| Link { ends: link.ends.map(|node| node + by), ..link };
        self.nodes.extend(segment.nodes().into_iter().map(|node| node + DVec3::X * station));
        self.lift.extend(segment.lift());
        self.springs.extend(segment.springs().into_iter().map(|link| moved(link, first)));
        if before < first {
            let joined = segment.connect(&Before { count: first - before });
            self.springs.extend(joined.springs.into_iter().map(|link| moved(link, before)));
            let moved_face = |face: Face| Face { nodes: face.nodes.map(|node| node + before), ..face };
            self.faces.extend(joined.faces.into_iter().map(moved_face));
        }
        self.bounds.push(self.nodes.len());
    }

    /// Takes the centre of all nodes to the origin.
    fn center(&mut self) {
        let center = self.nodes.iter().sum::<DVec3>() / self.nodes.len() as f64;
        self.nodes.iter_mut().for_each(|node| *node -= center);
    }

    /// Nodes at rest [m], around their centre.
    pub fn nodes(&self) -> &[DVec3] {
        &self.nodes
    }

    /// All springs.
    pub fn springs(&self) -> &[Link] {
        &self.springs
    }

    /// The skin.
    pub fn faces(&self) -> &[Face] {
        &self.faces
    }

    /// 1 for each node that floats up, −1 for each that sinks.
    pub fn lift(&self) -> &[i8] {
        &self.lift
    }

    /// How many springs contract.
    pub fn muscles(&self) -> usize {
        self.springs.iter().filter(|link| link.muscle.is_some()).count()
    }

    /// How many gaps have muscles.
    pub fn muscle_gaps(&self) -> usize {
        let gaps =
            self.springs.iter().filter_map(|link| link.muscle).map(|muscle| usize::from(muscle.gap) + 1);
        gaps.max().unwrap_or(0)
    }

    /// The nodes of each segment, front to back.
    pub fn segments(&self) -> impl ExactSizeIterator<Item = core::ops::Range<usize>> + '_ {
        self.bounds.windows(2).map(|pair| pair[0]..pair[1])
    }

    /// From the nose to the fin's edge [m].
    pub fn length(&self) -> f64 {
        let ends = [self.nodes.first(), self.nodes.last()];
        let [nose, tail] = ends.map(|node| node.map_or(0.0, |node| node.x));
        nose - tail
    }

    /// Its greatest extent across [m].
    pub fn width(&self) -> f64 {
        2.0 * self.nodes.iter().map(|node| node.z.abs()).fold(0.0, f64::max)
    }
}

fn is_length(value: f64) -> bool {
    value.is_finite() && value > 0.0
}
