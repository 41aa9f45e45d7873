//! Where all joints are: what a renderer skins meshes with, and recordings trace.

use fearless_simd::Simd;
use glam::{DVec3, Mat3, Quat, Vec3};
use reef_flow::{Level, simd::splat};
use reef_sdk::{Parts, Workers};

use super::{Bed, Kind, Pack};
use crate::{
    kernel::{Frame, Row, base, frame_of},
    lanes::{Lane, WIDTH, load, load3, store3},
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

/// X, Y and origin of a segment.
pub(super) type Bases = [[Lane; 3]; 3];

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

/// The bases of the first segments, as many as `joints` has.
#[inline(always)]
pub(super) fn frames<S: Simd>(simd: S, joints: &[Joint], pack: &Pack, rows: &[Row], bases: &mut [Bases]) {
    let ground = base(simd, &pack.stand);
    let ground = Frame { origin: [splat(simd, 0.0); 3], ..ground };
    let size = load(simd, &pack.stand.size);
    for (number, (joint, row)) in joints.iter().zip(rows).enumerate() {
        let below = if joint.parent == GROUND {
            ground
        } else {
            let [x, y, origin] = &bases[joint.parent as usize];
            Frame { x: load3(simd, x), y: load3(simd, y), origin: load3(simd, origin) }
        };
        let frame = frame_of(simd, below, joint, row, size);
        let [x, y, origin] = &mut bases[number];
        store3(x, frame.x);
        store3(y, frame.y);
        store3(origin, frame.origin);
    }
}

/// One plant's base.
pub(super) fn one([x, y, origin]: &Bases, lane: usize) -> JointPose {
    let of = |lanes: &[Lane; 3]| Vec3::new(lanes[0].0[lane], lanes[1].0[lane], lanes[2].0[lane]);
    let (x, y) = (of(x), of(y));
    let turn = Quat::from_mat3(&Mat3::from_cols(x, y, x.cross(y))).normalize();
    JointPose { position: of(origin).to_array(), rotation: turn.to_array() }
}
