//! The middle line of a limb at rest, and which joints move what is on it.

use core::ops::Range;

use glam::{DQuat, DVec3};

use crate::{grow::Limb, skeleton::Skeleton};

/// Joints that move a vertex.
pub(crate) const BONES: usize = 4;

/// One segment at rest.
#[derive(Clone, Copy, Debug)]
struct Piece {
    joint: u32,
    /// Where it begins [m], and how far up the limb that is [m].
    origin: DVec3,
    along: f64,
    /// Unit.
    up: DVec3,
}

/// The middle line of a limb.
#[derive(Clone, Debug)]
pub(super) struct Spine {
    pieces: Vec<Piece>,
    /// Number of the piece of the limb's first segment: 1 where the limb goes on from another.
    first: usize,
    /// Length of a segment, and of all [m].
    step: f64,
    pub(super) length: f64,
    /// Across, unit: out of the plane that the limb leans in, and in it.
    pub(super) across: DVec3,
    pub(super) inside: DVec3,
}

/// A place on a middle line.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spot {
    pub(super) place: DVec3,
    /// Unit.
    pub(super) up: DVec3,
    pub(super) joints: [u32; BONES],
    /// Summing to 1.
    pub(super) weights: [f64; BONES],
}

impl Spine {
    /// Of a limb of a skeleton whose segments stand so at rest.
    pub(super) fn new(skeleton: &Skeleton, rest: &[(DVec3, DQuat)], limb: &Limb, goes_on: bool) -> Self {
        let step = limb.length / limb.segments.len() as f64;
        let piece = |joint: usize, along: f64| {
            let (origin, turn) = rest[joint];
            Piece { joint: joint as u32, origin, along, up: turn * DVec3::Y }
        };
        let Range { start, end } = limb.segments.clone();
        let mut pieces = Vec::new();
        if let Some(below) = limb.on.filter(|_| goes_on) {
            pieces.push(piece(below, -skeleton.segments()[below].length));
        }
        let first = pieces.len();
        pieces.extend((start..end).map(|joint| piece(joint, (joint - start) as f64 * step)));
        let turn = rest[start].1;
        let (across, inside) = (turn * DVec3::X, turn * DVec3::Z);
        Self { pieces, first, step, length: limb.length, across, inside }
    }

    /// The place a length [m] up the limb. Joints are blended by cubic B-splines over the middles of the
    /// segments: what is on the line bends smoothly where they turn.
    pub(super) fn at(&self, along: f64) -> Spot {
        let u = along / self.step - 0.5;
        let below = u.floor();
        let f = u - below;
        let cubic = |x: f64| x * x * x / 6.0;
        let middle = |x: f64| 2.0 / 3.0 - x * x * (1.0 - 0.5 * x);
        let shares = [cubic(1.0 - f), middle(f), middle(1.0 - f), cubic(f)];
        let mut spot =
            Spot { place: DVec3::ZERO, up: DVec3::ZERO, joints: [0; BONES], weights: [0.0; BONES] };
        let last = self.pieces.len() as i64 - 1;
        let mut used: usize = 0;
        for (k, share) in (-1..).zip(shares) {
            let number = (below as i64 + k + self.first as i64).clamp(0, last) as usize;
            let piece = &self.pieces[number];
            spot.place += share * (piece.origin + piece.up * (along - piece.along));
            spot.up += share * piece.up;
            // What is beyond the ends is moved by the last one there, once.
            if used > 0 && spot.joints[used - 1] == piece.joint {
                spot.weights[used - 1] += share;
            } else {
                (spot.joints[used], spot.weights[used]) = (piece.joint, share);
                used += 1;
            }
        }
        spot.joints.iter_mut().skip(used).for_each(|joint| *joint = self.pieces[0].joint);
        spot.up = spot.up.normalize_or(DVec3::Y);
        spot
    }
}
