//! Where the nodes of fish are, of bodies and points alike: for frames, lines and recordings.

use std::iter;

use glam::{DVec3, Vec3};
use reef_sdk::abi::{DebugLine, Joint};

use super::{Shoal, act::Pose};
use crate::frames::sections;

/// Channels and colours (sRGB 0xAABBGGRR) of springs, and of muscles at rest, short and long.
const SPRINGS: (u32, u32) = (0, 0xffb0_a890);
const MUSCLES: u32 = 1;
const SLACK: [u32; 3] = [0x50, 0x50, 0xd0];
const SHORT: [u32; 3] = [0x20, 0x20, 0xff];
/// A muscle that is this share shorter than at rest has all of its colour.
const SHORTEST: f32 = 0.2;

impl Shoal {
    /// Writes the nodes of a fish [m, relative to the returned origin, world]; `into` has room for them.
    pub fn nodes(&self, number: usize, into: &mut [[f32; 3]]) -> DVec3 {
        let size = self.one(number).size as f32;
        let origin = self.pose(number, into);
        into.iter_mut().for_each(|at| *at = at.map(|x| x * size));
        origin
    }

    /// As [`Shoal::nodes`], at the species' own size.
    fn pose(&self, number: usize, into: &mut [[f32; 3]]) -> DVec3 {
        let fish = self.one(number);
        let kind = &self.kinds[fish.kind as usize];
        let pool = &self.pools[fish.kind as usize];
        if let Some(body) = fish.body.number().filter(|_| fish.near) {
            for (into, at) in into.iter_mut().zip(pool.tank.positions(body)) {
                *into = *at;
            }
            return pool.tank.swimmers()[body].origin;
        }
        let offsets = pool.offsets(fish.body).iter().copied().chain(iter::repeat(Vec3::ZERO));
        let pose = Pose::of(fish, &kind.gait);
        for (node, (into, offset)) in into.iter_mut().zip(offsets).enumerate() {
            let at = pose.node(node) + pose.turned(offset) * pose.fade;
            *into = at.to_array();
        }
        fish.position
    }

    /// Writes the frames of a fish's segments, nose first, relative to the returned origin [m, world].
    /// `nodes` is room for its nodes: there they are at the species' own size afterwards.
    pub fn frames(&self, number: usize, nodes: &mut [[f32; 3]], into: &mut [Joint]) -> DVec3 {
        let fish = self.one(number);
        let kind = &self.kinds[fish.kind as usize];
        let origin = self.pose(number, nodes);
        sections(&kind.plan, nodes, fish.size as f32, into);
        origin
    }

    /// Springs of a fish as lines; muscles are the redder the shorter they are.
    pub fn lines(&self, number: usize, lines: &mut Vec<DebugLine>) {
        let fish = self.one(number);
        let body = self.kinds[fish.kind as usize].plan.body();
        let mut nodes = vec![[0.0; 3]; body.nodes().len()];
        let origin = self.nodes(number, &mut nodes);
        let at = |node: usize| Vec3::from(nodes[node]);
        for link in body.springs() {
            let [a, b] = link.ends;
            let delta = at(b) - at(a);
            let (channel, color) = if link.muscle.is_some() {
                let rest = (body.nodes()[b] - body.nodes()[a]).length() * fish.size;
                let short = ((1.0 - delta.length() / rest as f32) / SHORTEST).clamp(0.0, 1.0);
                (MUSCLES, mixed(short))
            } else {
                SPRINGS
            };
            lines.push(DebugLine {
                from: (origin + at(a).as_dvec3()).to_array(),
                delta: delta.to_array(),
                color,
                channel,
                ..DebugLine::default()
            });
        }
    }
}

/// A muscle's colour.
fn mixed(short: f32) -> u32 {
    let channel = |i: usize| {
        let (slack, short_color) = (SLACK[i] as f32, SHORT[i] as f32);
        (slack + (short_color - slack) * short) as u32
    };
    0xff00_0000 | (channel(0) << 16) | (channel(1) << 8) | channel(2)
}
