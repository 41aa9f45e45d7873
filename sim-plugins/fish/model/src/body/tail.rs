//! The tail: an upright fin of two nodes, top and bottom.

use glam::DVec3;

use super::{Before, Face, Joined, Link, Role, Segment, section};

/// A fin that beats from side to side.
#[derive(Clone, Copy, Debug)]
pub struct Tail {
    /// Half of its extent from top to bottom [m].
    pub half_span: f64,
}

const TOP: usize = section::NODES;
const BOTTOM: usize = section::NODES + 1;

impl Segment for Tail {
    fn nodes(&self) -> Vec<DVec3> {
        vec![DVec3::Y * self.half_span, DVec3::NEG_Y * self.half_span]
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
            joined.springs.push(Link::new(i, TOP, Role::Long));
            joined.springs.push(Link::new(i, BOTTOM, Role::Long));
        }
        joined.faces = vec![
            Face::quad(left_top, left_bottom, BOTTOM, TOP),
            Face::triangle(left_bottom, right_bottom, BOTTOM),
            Face::quad(right_bottom, right_top, TOP, BOTTOM),
            Face::triangle(right_top, left_top, TOP),
        ];
        joined
    }
}
