//! Where all joints are: what a renderer skins meshes with, and recordings trace.

use fearless_simd::{Simd, f32x8};
use glam::{DVec3, Quat, Vec3};
use reef_flow::{
    Level,
    math::sin_cos,
    simd::{mul_add, neg_mul_add, splat},
};
use reef_sdk::{Parts, Workers};

use super::{Bed, Kind, Pack};
use crate::{
    kernel::Row,
    lanes::{Lane, WIDTH, add_scaled, load, load3, store, store3},
    skeleton::{GROUND, Joint},
};

/// The base of a segment, relative to its plant's root.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct JointPose {
    /// Where the segment begins [m].
    pub position: [f32; 3],
    /// From the segment's own base to the world's: x, y, z, w.
    pub rotation: [f32; 4],
}

/// Turn (x, y, z, w) and origin of a segment.
pub(super) type Bases = ([Lane; 4], [Lane; 3]);

impl Bed {
    /// Where a plant's joints begin among those of [`Bed::write_poses`].
    pub fn first_joint(&self, plant: usize) -> Option<usize> {
        let [pack, lane] = *self.places.get(plant)?;
        let segments = self.kinds[self.packs.get(pack as usize)?.kind()].skeleton.len();
        Some(self.pose_bounds[pack as usize] + lane as usize * segments)
    }

    /// Where the joints of a plant are, root first.
    pub fn poses<'a>(&self, plant: usize, all: &'a [JointPose]) -> &'a [JointPose] {
        let Some(first) = self.first_joint(plant) else { return &[] };
        let count = self.kinds[self.plants[plant].kind].skeleton.len();
        all.get(first..first + count).unwrap_or(&[])
    }

    /// Writes where all joints are, plants one after the other (see [`Bed::first_joint`]): `out` has room for
    /// [`Bed::joint_count`].
    pub fn write_poses(&mut self, level: Level, workers: Workers<'_>, out: &mut [JointPose]) {
        fit(&mut self.bases, &self.kinds, workers.count());
        let Self { packs, rows, row_bounds, pose_bounds, kinds, bases, .. } = self;
        let (kinds, packs) = (&*kinds, packs.as_slice());
        let rows = rows.as_slice();
        let row_bounds = row_bounds.as_slice();
        workers.for_each_part_with(bases, Parts::new(out, pose_bounds), |bases, number, out| {
            let pack = &packs[number];
            let joints = &kinds[pack.kind()].skeleton.joints;
            let rows = &rows[row_bounds[number]..row_bounds[number + 1]];
            reef_flow::dispatch!(level, simd => frames(simd, joints, pack, rows, bases));
            for (lane, out) in (0..WIDTH).zip(out.chunks_mut(joints.len())) {
                for (pose, base) in out.iter_mut().zip(bases.iter()) {
                    *pose = one(base, lane);
                }
            }
        });
    }

    /// The nodes of a plant for recordings [m, world], from what [`Bed::write_poses`] wrote: the root's base,
    /// then each segment's end.
    pub fn nodes<'a>(&'a self, plant: usize, all: &'a [JointPose]) -> impl Iterator<Item = DVec3> + 'a {
        let (root, kind) = (self.plants[plant].root, &self.kinds[self.plants[plant].kind]);
        let size = self.plants[plant].size;
        let ends = self.poses(plant, all).iter().zip(kind.skeleton.segments()).map(move |(pose, segment)| {
            let up = Quat::from_array(pose.rotation) * Vec3::Y;
            root + Vec3::from(pose.position).as_dvec3() + up.as_dvec3() * (segment.length * size)
        });
        core::iter::once(root).chain(ends)
    }
}

/// Makes room for the longest plant, for each worker.
pub(super) fn fit(bases: &mut Vec<Vec<Bases>>, kinds: &[Kind], workers: usize) {
    let longest = kinds.iter().map(|kind| kind.skeleton.len()).max().unwrap_or(0);
    if bases.len() < workers {
        bases.resize_with(workers, Vec::new);
    }
    for bases in bases {
        bases.resize(longest, Bases::default());
    }
}

/// The bases of the first segments, as many as `joints` has, with their turns as quaternions.
#[inline(always)]
pub(super) fn frames<S: Simd>(simd: S, joints: &[Joint], pack: &Pack, rows: &[Row], bases: &mut [Bases]) {
    let ground = (pack.turn.each_ref().map(|lane| load(simd, lane)), [splat(simd, 0.0); 3]);
    let size = load(simd, &pack.stand.size);
    let (half, two) = (splat(simd, 0.5), splat(simd, 2.0));
    for (number, (joint, row)) in joints.iter().zip(rows).enumerate() {
        let (turn, origin) = if joint.parent == GROUND {
            ground
        } else {
            let (turn, origin) = &bases[joint.parent as usize];
            (turn.each_ref().map(|lane| load(simd, lane)), load3(simd, origin))
        };
        // Up what it stands on, by the turn's own Y.
        let [x, y, z, w] = turn;
        let up = [
            two * neg_mul_add(w, z, x * y),
            neg_mul_add(two, mul_add(x, x, z * z), splat(simd, 1.0)),
            two * mul_add(w, x, y * z),
        ];
        let origin = add_scaled(origin, up, size * splat(simd, joint.height));
        // By θ about Y, then by φ about its own X.
        let (sin_theta, cos_theta) = sin_cos(half * load(simd, &row.theta));
        let (sin_phi, cos_phi) = sin_cos(half * load(simd, &row.phi));
        let own = [cos_theta * sin_phi, sin_theta * cos_phi, -(sin_theta * sin_phi), cos_theta * cos_phi];
        let turn = after(simd, turn, own);
        let (turns, origins) = &mut bases[number];
        for (lane, value) in turns.iter_mut().zip(turn) {
            store(lane, value);
        }
        store3(origins, origin);
    }
}

/// The turn `b` and then `a`, as unit quaternions.
#[inline(always)]
fn after<S: Simd>(simd: S, a: [f32x8<S>; 4], b: [f32x8<S>; 4]) -> [f32x8<S>; 4] {
    let ([ax, ay, az, aw], [bx, by, bz, bw]) = (a, b);
    let turn = [
        neg_mul_add(az, by, mul_add(ay, bz, mul_add(ax, bw, aw * bx))),
        neg_mul_add(ax, bz, mul_add(az, bx, mul_add(ay, bw, aw * by))),
        neg_mul_add(ay, bx, mul_add(ax, by, mul_add(az, bw, aw * bz))),
        neg_mul_add(az, bz, neg_mul_add(ay, by, neg_mul_add(ax, bx, aw * bw))),
    ];
    // What rounding adds or takes is given back: one step of Newton's method toward a length of 1.
    let square = turn.into_iter().fold(splat(simd, 0.0), |sum, q| mul_add(q, q, sum));
    let unit = neg_mul_add(splat(simd, 0.5), square, splat(simd, 1.5));
    turn.map(|q| q * unit)
}

/// One plant's base.
pub(super) fn one((turn, origin): &Bases, lane: usize) -> JointPose {
    JointPose {
        position: origin.each_ref().map(|lanes| lanes.0[lane]),
        rotation: turn.each_ref().map(|lanes| lanes.0[lane]),
    }
}
