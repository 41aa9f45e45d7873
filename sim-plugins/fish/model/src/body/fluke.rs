//! The fluke: a level fin of two nodes, left and right, that whales beat up and down.

use glam::DVec3;

use super::{Before, Face, Joined, Link, Role, Segment, section};

/// A fin that beats up and down.
#[derive(Clone, Copy, Debug)]
pub struct Fluke {
    /// Half of its extent from left to right [m].
    pub half_span: f64,
}

const LEFT: usize = section::NODES;
const RIGHT: usize = section::NODES + 1;

impl Segment for Fluke {
    fn nodes(&self) -> Vec<DVec3> {
        vec![DVec3::NEG_Z * self.half_span, DVec3::Z * self.half_span]
    }

    fn springs(&self) -> Vec<Link> {
        vec![Link::new(0, 1, Role::Cross)]
    }

    fn lift(&self) -> Vec<i8> {
        vec![0, 0]
    }

    fn connect(&self, _: &Before) -> Joined {
        let [left_top, left_bottom, right_bottom, right_top] = [0, 1, 2, 3];
        let mut joined = Joined::default();
        for i in 0..section::NODES {
            joined.springs.push(Link::new(i, LEFT, Role::Long));
            joined.springs.push(Link::new(i, RIGHT, Role::Long));
        }
        joined.faces = vec![
            Face::triangle(left_top, left_bottom, LEFT),
            Face::quad(left_bottom, right_bottom, RIGHT, LEFT),
            Face::triangle(right_bottom, right_top, RIGHT),
            Face::quad(right_top, left_top, LEFT, RIGHT),
        ];
        joined
    }
}
