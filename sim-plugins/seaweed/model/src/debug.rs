//! Skeletons, and what plants do to the water, as lines.

use core::f64::consts::TAU;

use glam::DVec3;
use reef_flow::math::cos_sin_f64;
use reef_sdk::abi::{self, DebugLine, Flow};

use crate::bed::{Bed, JointPose};

/// Lines at most: more would hide everything.
const MOST_LINES: usize = 20_000;
/// Channels: segments, sources and shelters.
const SKELETON: u32 = 0;
const FLOWS: u32 = 1;
/// Colours of segments near, in the middle and far (sRGB 0xAABBGGRR): orange, green, blue.
const LEVELS: [u32; 3] = [0xff20_90f8, 0xff3c_c81e, 0xffc8_7832];
/// Of shelters and sources: yellow, crimson.
const SHELTER: u32 = 0xff12_d8f0;
const SOURCE: u32 = 0xff52_1ebe;
/// Lines of a ring.
const RING: usize = 32;

/// Which lines are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shown {
    /// Skeletons and flows.
    Both,
    /// Segments, in the colours of their levels of detail.
    Skeletons,
    /// What the plants emit.
    Flows,
}

/// What is shown of a bed whose joints are at `poses`.
pub(crate) fn lines(bed: &Bed, poses: &[JointPose], flows: &[Flow], shown: Shown) -> Vec<DebugLine> {
    let mut lines = Vec::new();
    if shown != Shown::Skeletons {
        for flow in flows {
            let shelter = flow.kind == abi::FLOW_SHELTER;
            ring(flow, if shelter { SHELTER } else { SOURCE }, &mut lines);
        }
    }
    if shown == Shown::Flows {
        return lines;
    }
    for plant in 0..bed.plants().len() {
        let kind = &bed.kinds()[bed.plants()[plant].kind];
        if lines.len() + kind.skeleton.len() > MOST_LINES {
            break;
        }
        let level = bed.detail(plant).map_or(0, |[level, _]| level.round() as usize);
        let root = bed.plants()[plant].root;
        let ends = bed.nodes(plant, poses).skip(1);
        for (pose, end) in bed.poses(plant, poses).iter().zip(ends) {
            let from = root + glam::Vec3::from(pose.position).as_dvec3();
            lines.push(line(from, end, LEVELS[level.min(2)], SKELETON));
        }
    }
    lines
}

fn line(from: DVec3, to: DVec3, color: u32, channel: u32) -> DebugLine {
    let delta = (to - from).as_vec3().to_array();
    DebugLine { from: from.to_array(), delta, color, channel, ..DebugLine::default() }
}

/// A level ring around what a flow reaches.
fn ring(flow: &Flow, color: u32, lines: &mut Vec<DebugLine>) {
    let center = DVec3::from(flow.position);
    let at = |i: usize| {
        let (cos, sin) = cos_sin_f64(TAU * i as f64 / RING as f64);
        center + DVec3::new(cos, 0.0, sin) * f64::from(flow.reach)
    };
    lines.extend((0..RING).map(|i| line(at(i), at(i + 1), color, FLOWS)));
}
