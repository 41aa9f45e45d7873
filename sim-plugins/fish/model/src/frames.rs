//! Frames of a fish and of its segments: what it looks like is skinned by these.

use glam::{Mat3, Quat, Vec3};
use reef_sdk::abi::Joint;

use crate::Plan;

/// Forward, up and right of a fish by its nodes, orthonormal.
pub fn axes(plan: &Plan, positions: &[[f32; 3]]) -> [Vec3; 3] {
    let at = |node: usize| Vec3::from(positions[node]);
    let (first, last) = (0, plan.body().segments().len() - 1);
    let middle = |segment: usize| {
        let nodes = plan.body().segments().nth(segment).unwrap_or(0..1);
        nodes.clone().map(at).sum::<Vec3>() / nodes.len() as f32
    };
    let forward = middle(first) + middle(first + 1) - middle(last) - middle(last - 1);
    let lifted = plan.body().lift().iter().enumerate().map(|(node, lift)| at(node) * f32::from(*lift));
    base(forward, lifted.sum())
}

/// An orthonormal base: forward, up as near as can be to `up`, and right.
pub fn base(forward: Vec3, up: Vec3) -> [Vec3; 3] {
    let forward = forward.normalize_or(Vec3::X);
    let right = forward.cross(up).try_normalize().unwrap_or_else(|| forward.any_orthonormal_vector());
    [forward, right.cross(forward), right]
}

/// How far a fin's frame is scaled down at least.
const LEAST: f32 = 0.5;

/// The frames of all segments, nose first, relative to the fish's origin [m], x forward, y up, z right: into
/// as many as a body has segments, at `size` times the species'. A fin's corners are its nodes: its frame is
/// scaled with it, and askew to the body's way where it is.
pub fn sections(plan: &Plan, positions: &[[f32; 3]], size: f32, into: &mut [Joint]) {
    let at = |node: usize| Vec3::from(positions[node]);
    let middle =
        |nodes: core::ops::Range<usize>| nodes.clone().map(at).sum::<Vec3>() / nodes.len().max(1) as f32;
    let [whole_forward, whole_up, whole_right] = axes(plan, positions);
    let count = plan.body().segments().len();
    for (i, (into, nodes)) in into.iter_mut().zip(plan.body().segments()).enumerate() {
        let ahead = plan.body().segments().nth(i.saturating_sub(1)).unwrap_or(0..1);
        let behind = plan.body().segments().nth((i + 1).min(count - 1)).unwrap_or(0..1);
        let forward = middle(ahead) - middle(behind);
        let (forward, up, stretch) = match nodes.len() {
            // Left-top, left-bottom, right-bottom, right-top.
            4 => {
                let signed =
                    [1.0, -1.0, -1.0, 1.0].iter().zip(nodes.clone()).map(|(sign, node)| at(node) * *sign);
                (forward, signed.sum::<Vec3>() * 0.5, 1.0)
            }
            2 => {
                let across = at(nodes.start) - at(nodes.start + 1);
                let rest = Vec3::from(plan.rest[nodes.start]) - Vec3::from(plan.rest[nodes.start + 1]);
                let over = across.length() / rest.length().max(f32::MIN_POSITIVE);
                let forward = forward.reject_from(across.try_normalize().unwrap_or(Vec3::Y));
                // A level fin spans from left to right.
                let level = rest.z.abs() > rest.y.abs();
                let up = if level { (-across).cross(forward) } else { across };
                (forward, up, over.clamp(LEAST, 1.0 / LEAST))
            }
            _ => (forward, whole_up, 1.0),
        };
        let [x, y, z] = if forward.length_squared() > 0.0 {
            base(forward, up)
        } else {
            [whole_forward, whole_up, whole_right]
        };
        *into = Joint {
            rotation: Quat::from_mat3(&Mat3::from_cols(x, y, z)).normalize().to_array(),
            translation: (middle(nodes.clone()) * size).to_array(),
            scale: size * stretch,
        };
    }
}
