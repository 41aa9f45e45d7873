//! What a fish keeps clear of that does not swim: the walls of its habitat, the sea bed, rocks, the surface.

use fearless_simd::{Simd, f32x8, prelude::*};
use glam::{DVec3, Vec3};
use reef_flow::simd::{clamp, splat};
use reef_sdk::{Heightfield, abi::Obstacle};

use crate::lanes::Vector;

/// How near to a wall a fish begins to turn, in its lengths, and at most as a share of the habitat.
const MARGIN: f32 = 3.0;
const MOST_MARGIN: f32 = 0.35;
/// How near to a wall the water carries it off, in its lengths, and at most as a share of the habitat.
const TOUCHING: f32 = 0.25;
const MOST_TOUCHING: f32 = 0.05;
/// How far ahead it looks for rocks and the bed, in its lengths.
const LOOK_AHEAD: f64 = 1.5;
/// How far it keeps from them, in its lengths.
const CLEAR: f64 = 1.5;
/// How strongly it turns at a wall.
const STRENGTH: f32 = 4.0;

/// The way off the walls of boxes, from 0 at the margin to [`STRENGTH`] at the wall, and on behind it; and
/// how strongly the water carries off it whoever is too heavy, or too frightened, to turn in time, 0..1.
/// `low`, `high`: corners as `at` [m]; the surface is a wall at `top` [m] for the middle of a fish.
#[inline(always)]
pub(super) fn boxed<S: Simd>(
    simd: S,
    at: Vector<S>,
    [low, high]: [Vector<S>; 2],
    top: f32x8<S>,
    length: f32x8<S>,
) -> [Vector<S>; 2] {
    let [mut urge, mut push] = [[splat(simd, 0.0); 3]; 2];
    for axis in 0..3 {
        let extent = high[axis] - low[axis];
        let one = splat(simd, 1.0);
        let per = |lengths: f32, share: f32| {
            let most = extent * splat(simd, share);
            one / (length * splat(simd, lengths)).min(most).max(splat(simd, 1e-6))
        };
        let high = if axis == 1 { high[1].min(top) } else { high[axis] };
        let (below, above) = (at[axis] - low[axis], high - at[axis]);
        let margin = per(MARGIN, MOST_MARGIN);
        urge[axis] = near(simd, one - below * margin) - near(simd, one - above * margin);
        let touching = per(TOUCHING, MOST_TOUCHING);
        let depth = |gap: f32x8<S>| clamp(one - gap * touching, splat(simd, 0.0), one);
        push[axis] = depth(below) - depth(above);
    }
    [urge, push]
}

#[inline(always)]
fn near<S: Simd>(simd: S, depth: f32x8<S>) -> f32x8<S> {
    let depth = clamp(depth, splat(simd, 0.0), splat(simd, 2.0));
    splat(simd, STRENGTH) * depth * depth
}

/// A fish, as the bed and rocks see it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Body {
    pub(super) at: DVec3,
    pub(super) course: Vec3,
    /// [m]
    pub(super) length: f64,
    pub(super) height: f64,
}

/// The way off something, and the way that the water in front of what a fish would touch carries it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Off {
    pub(super) urge: DVec3,
    pub(super) push: DVec3,
}

impl Body {
    fn ahead(&self) -> DVec3 {
        self.at + self.course.as_dvec3() * (LOOK_AHEAD * self.length)
    }

    /// How strongly what is so far off its skin pushes it away, 0..1.
    fn touched(&self, off: f64) -> f64 {
        (1.0 - off / (0.5 * self.height).max(1e-6)).clamp(0.0, 1.0)
    }

    /// Below this height over the highest of a bed it has to do with it [m].
    pub(super) fn over(&self) -> f64 {
        0.5 * self.height + (CLEAR + LOOK_AHEAD) * self.length
    }

    /// Keeps off the bed.
    pub(super) fn bed(&self, bed: &Heightfield<'_>, off: &mut Off) {
        let height = |at: DVec3| at.y - f64::from(bed.height(at.x, at.z));
        let (here, there) = (height(self.at), height(self.ahead()));
        off.urge.y += nearness(1.0 - here.min(there) / (0.5 * self.height + CLEAR * self.length));
        off.push.y += self.touched(here);
    }

    /// Keeps off a rock.
    pub(super) fn rock(&self, obstacle: &Obstacle, off: &mut Off) {
        let [here, there] = [self.at, self.ahead()].map(|at| gap(obstacle, at));
        for (away, distance) in [here, there] {
            off.urge += away * nearness(1.0 - distance / (CLEAR * self.length));
        }
        off.push += here.0 * self.touched(here.1);
    }
}

fn nearness(depth: f64) -> f64 {
    let depth = depth.clamp(0.0, 2.0);
    f64::from(STRENGTH) * depth * depth
}

/// The way off a capsule, unit, and how far its skin is [m].
fn gap(obstacle: &Obstacle, at: DVec3) -> (DVec3, f64) {
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
    gap(obstacle, at).1 < radius
}
