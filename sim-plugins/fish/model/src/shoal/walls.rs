//! What a fish keeps clear of that does not swim: the walls of its habitat, the sea bed, rocks, the surface.

use glam::{DVec3, Vec3};
use reef_sdk::{Heightfield, abi::Obstacle};

use super::Habitat;

/// How near to a wall a fish begins to turn, in its lengths, and at most as a share of the habitat.
const MARGIN: f64 = 3.0;
const MOST_MARGIN: f64 = 0.35;
/// How near to a wall the water carries it off, in its lengths, and at most as a share of the habitat.
const TOUCHING: f64 = 0.25;
const MOST_TOUCHING: f64 = 0.05;
/// How far ahead it looks for rocks and the bed, in its lengths.
const LOOK_AHEAD: f64 = 1.5;
/// How far it keeps from them, in its lengths.
const CLEAR: f64 = 1.5;

/// Everything that stands around.
#[derive(Clone, Copy, Debug)]
pub(super) struct Walls<'a> {
    pub(super) bed: Option<Heightfield<'a>>,
    pub(super) obstacles: &'a [Obstacle],
    /// y of still water [m].
    pub(super) surface: f64,
}

/// A fish, as walls see it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Body {
    pub(super) at: DVec3,
    pub(super) course: Vec3,
    /// [m]
    pub(super) length: f64,
    pub(super) height: f64,
}

/// The way off what is near, 1 and more where a fish has to turn at once; and the way that the water in front
/// of what it would touch carries it.
pub(super) fn avoid(walls: &Walls<'_>, obstacles: &[u32], habitat: &Habitat, fish: &Body) -> [Vec3; 2] {
    let mut urge = DVec3::ZERO;
    let mut push = DVec3::ZERO;
    let extent = habitat.high - habitat.low;
    let top = habitat.high.y.min(walls.surface - 0.5 * fish.height);
    for axis in 0..3 {
        let margin = (MARGIN * fish.length).min(MOST_MARGIN * extent[axis]).max(1e-6);
        let high = if axis == 1 { top } else { habitat.high[axis] };
        let low_side = 1.0 - (fish.at[axis] - habitat.low[axis]) / margin;
        let high_side = 1.0 - (high - fish.at[axis]) / margin;
        urge[axis] += nearness(low_side) - nearness(high_side);
        // Whoever is too heavy, or too frightened, to turn in time is carried off the wall.
        let touching = (TOUCHING * fish.length).min(MOST_TOUCHING * extent[axis]).max(1e-6);
        let depth = |gap: f64| (1.0 - gap / touching).clamp(0.0, 1.0);
        push[axis] += depth(fish.at[axis] - habitat.low[axis]) - depth(high - fish.at[axis]);
    }
    if let Some(bed) = &walls.bed {
        let ahead = fish.at + fish.course.as_dvec3() * (LOOK_AHEAD * fish.length);
        let height = |at: DVec3| at.y - f64::from(bed.height(at.x, at.z));
        let clear = 0.5 * fish.height + CLEAR * fish.length;
        let (here, there) = (height(fish.at), height(ahead));
        urge.y += nearness(1.0 - here.min(there) / clear);
        let touching = 0.5 * fish.height;
        push.y += (1.0 - here / touching.max(1e-6)).clamp(0.0, 1.0);
    }
    for number in obstacles {
        let obstacle = &walls.obstacles[*number as usize];
        let ahead = fish.at + fish.course.as_dvec3() * (LOOK_AHEAD * fish.length);
        let [here, there] = [fish.at, ahead].map(|at| off(obstacle, at));
        let clear = CLEAR * fish.length;
        for (away, distance) in [here, there] {
            urge += away * nearness(1.0 - distance / clear);
        }
        let touching = 0.5 * fish.height;
        push += here.0 * (1.0 - here.1 / touching.max(1e-6)).clamp(0.0, 1.0);
    }
    [urge.as_vec3(), push.as_vec3()]
}

/// From 0 at the margin to 4 at the wall, and on behind it.
fn nearness(depth: f64) -> f64 {
    let depth = depth.clamp(0.0, 2.0);
    4.0 * depth * depth
}

/// The way off a capsule, unit, and how far its skin is [m].
fn off(obstacle: &Obstacle, at: DVec3) -> (DVec3, f64) {
    let from = DVec3::from(obstacle.from);
    let delta = Vec3::from(obstacle.delta).as_dvec3();
    let along = (at - from).dot(delta) / delta.length_squared().max(f64::MIN_POSITIVE);
    let away = at - (from + delta * along.clamp(0.0, 1.0));
    let distance = away.length();
    (away.try_normalize().unwrap_or(DVec3::Y), distance - f64::from(obstacle.radius))
}

/// How far around a place an obstacle matters to a fish of this length [m].
pub(super) fn reach(length: f64) -> f64 {
    (LOOK_AHEAD + CLEAR) * length
}

/// Whether an obstacle comes within `radius` [m] of a place.
pub(super) fn touches(obstacle: &Obstacle, at: DVec3, radius: f64) -> bool {
    off(obstacle, at).1 < radius
}
