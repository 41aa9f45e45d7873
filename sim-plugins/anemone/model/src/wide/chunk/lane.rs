//! One fibre of a chunk on its own: where it sits, and for plants in one chunk that feel different water.

use super::{Chunk, Group, Place, Pose, Sixteen, lanes};

impl Chunk {
    /// Where a fibre sits on what carries it.
    pub fn place(&self, fibre: usize) -> &Place {
        &self.places[fibre]
    }

    /// Takes over what another chunk of the same fibres is about to step with: poses, and what parameters
    /// have changed. Allocates nothing.
    pub fn become_like(&mut self, other: &Self) {
        self.constants.clone_from(&other.constants);
        self.poses.clone_from(&other.poses);
        self.roots.clone_from(&other.roots);
        self.gained = other.gained;
    }

    /// Takes over one fibre as another chunk of the same fibres has it.
    pub fn take_fibre(&mut self, fibre: usize, other: &Self) {
        for (group, at, _) in lanes(self.count).filter(|(.., own)| *own == fibre) {
            for segment in 0..self.segments {
                let pose = self.pose_of(segment, group);
                self.poses[pose].take_lane(at, &other.poses[pose]);
            }
            self.roots[group].take_lane(at, &other.roots[group]);
        }
    }
}

/// Takes over one lane of several numbers.
fn take<const N: usize>(at: usize, into: [&mut Sixteen; N], from: [&Sixteen; N]) {
    for (into, from) in into.into_iter().zip(from) {
        into[at] = from[at];
    }
}

// Both name each field, so that one that is added cannot be forgotten here.
impl Pose {
    fn take_lane(&mut self, at: usize, other: &Self) {
        let Self { bend, direction } = self;
        take(at, bend.each_mut(), other.bend.each_ref());
        take(at, direction.each_mut(), other.direction.each_ref());
    }
}

impl Group {
    fn take_lane(&mut self, at: usize, other: &Self) {
        let Self {
            root,
            root_radius,
            tip,
            frame: [x, y, z],
            offset,
            middle,
            half_length,
            thickest,
            lever,
            gain,
            break2,
            broken,
            normal,
        } = self;
        let [other_x, other_y, other_z] = &other.frame;
        take(at, [root_radius, gain, lever], [&other.root_radius, &other.gain, &other.lever]);
        take(at, [half_length, thickest], [&other.half_length, &other.thickest]);
        take(at, [break2, broken], [&other.break2, &other.broken]);
        for (into, from) in [
            (root, &other.root),
            (tip, &other.tip),
            (x, other_x),
            (y, other_y),
            (z, other_z),
            (offset, &other.offset),
            (middle, &other.middle),
            (normal, &other.normal),
        ] {
            take(at, into.each_mut(), from.each_ref());
        }
    }
}
