//! A section of the body: four nodes (left-top, left-bottom, right-bottom, right-top), its edges and its
//! diagonals.

use glam::DVec3;

use super::{Before, Face, Joined, Link, Muscle, Role, Segment, gap};

/// A rectangle across the body.
#[derive(Clone, Copy, Debug)]
pub struct Section {
    /// Half of its extent from left to right [m].
    pub half_width: f64,
    /// Half of its extent from top to bottom [m].
    pub half_height: f64,
    /// Which of the gaps that have muscles lies before it, from 0; None: that gap has none.
    pub muscles: Option<u16>,
}

/// Nodes of a section.
pub const NODES: usize = 4;

/// Which side a node is on: 1 left, −1 right; and 1 top, −1 bottom.
const SIDES: [[i8; 2]; NODES] = [[1, 1], [1, -1], [-1, -1], [-1, 1]];

impl Segment for Section {
    fn nodes(&self) -> Vec<DVec3> {
        // The fish's left is −z.
        let at = |[left, top]: [i8; 2]| {
            DVec3::new(0.0, f64::from(top) * self.half_height, -f64::from(left) * self.half_width)
        };
        SIDES.map(at).to_vec()
    }

    fn springs(&self) -> Vec<Link> {
        let edges = (0..NODES).map(|i| Link::new(i, (i + 1) % NODES, Role::Cross));
        edges.chain([Link::new(0, 2, Role::Cross), Link::new(1, 3, Role::Cross)]).collect()
    }

    fn lift(&self) -> Vec<i8> {
        SIDES.map(|[_, top]| top).to_vec()
    }

    fn connect(&self, before: &Before) -> Joined {
        let own = before.count;
        let mut joined = Joined::default();
        if before.count == 1 {
            for i in 0..NODES {
                joined.springs.push(Link::new(0, own + i, Role::Long));
                joined.faces.push(Face::triangle(0, own + (i + 1) % NODES, own + i));
            }
            return joined;
        }
        for (i, [left, top]) in SIDES.into_iter().enumerate() {
            let muscle = self.muscles.map(|gap| Muscle { left, top, gap });
            joined.springs.push(Link { muscle, ..Link::new(i, own + i, Role::Long) });
        }
        for i in 0..NODES {
            let next = (i + 1) % NODES;
            gap(&mut joined, [i, next], [own + i, own + next]);
        }
        joined
    }
}
