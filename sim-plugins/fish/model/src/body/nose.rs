//! The nose: one node, to which the first section is tied.

use glam::DVec3;

use super::{Link, Segment};

/// The tip of the head.
#[derive(Clone, Copy, Debug)]
pub struct Nose;

impl Segment for Nose {
    fn nodes(&self) -> Vec<DVec3> {
        vec![DVec3::ZERO]
    }

    fn springs(&self) -> Vec<Link> {
        Vec::new()
    }

    fn lift(&self) -> Vec<i8> {
        vec![0]
    }
}
