//! Cells of a lattice over the world: what stands in one feels the same currents and trains, relative to the
//! same anchor.

use glam::{DVec3, Vec3};
use reef_flow::{Field, Packed, Sphere, view::View, waves::Trains};
use reef_sdk::abi::Obstacle;

use super::{Capsule, Kind, Plant, Surroundings};
use crate::levels::Levels;

/// [m]: in f32, what lies so near is placed to a micrometre.
pub(super) const SIZE: f64 = 16.0;

/// The cell of a root.
pub(super) fn key(root: DVec3) -> [i64; 3] {
    // A cast saturates: what is nowhere is in one cell, too.
    root.to_array().map(|x| (x / SIZE).round() as i64)
}

/// Where in a cell, by strips to and fro: neighbours in a pack have the same level of detail more often.
pub(super) fn strip(root: DVec3) -> (i64, i64) {
    let [x, z] = [root.x, root.z].map(|x| (x / STRIP).floor() as i64);
    (z, if z % 2 == 0 { x } else { -x })
}

/// [m]
const STRIP: f64 = 2.0;

/// One of them.
#[derive(Clone, Debug)]
pub(super) struct Cell {
    anchor: DVec3,
    /// Around all plants, whatever they do.
    bounds: Sphere,
    pub(super) currents: Packed,
    pub(super) trains: Trains,
    pub(super) capsules: Vec<Capsule>,
    /// Whether something in here may be in view.
    pub(super) visible: bool,
}

impl Cell {
    pub(super) fn new(key: [i64; 3]) -> Self {
        let anchor = DVec3::from(key.map(|x| x as f64 * SIZE));
        Self {
            anchor,
            bounds: Sphere { center: anchor.to_array(), radius: 0.0 },
            currents: Packed::new(),
            trains: Trains::new(),
            capsules: Vec::new(),
            visible: true,
        }
    }

    /// [m, world]
    pub(super) fn anchor(&self) -> DVec3 {
        self.anchor
    }

    pub(super) fn add(&mut self, plant: &Plant, kind: &Kind) {
        let reach = kind.skeleton.reach() * plant.size;
        self.bounds.radius = self.bounds.radius.max(plant.root.distance(self.anchor) + reach);
    }

    /// Nearest that anything in this cell's column comes to an eye, aside [m]: the same whatever stands here.
    pub(super) fn distance(&self, eye: DVec3) -> f64 {
        let off = (eye - self.anchor).abs() - DVec3::splat(0.5 * SIZE);
        (off.x.max(0.0).powi(2) + off.z.max(0.0).powi(2)).sqrt()
    }

    /// The water of one step, and what is in the way.
    pub(super) fn fill(&mut self, field: &Field, around: &Surroundings<'_>, levels: &Levels, view: &View) {
        let middle = DVec3::from(self.bounds.center);
        self.visible = !levels.visible || view.sees_ball(middle, self.bounds.radius);
        // What is not in view yet must not need memory when it is.
        self.currents.make_room(field);
        self.capsules.reserve(around.obstacles.len().saturating_sub(self.capsules.len()));
        self.trains.make_room(around.waves.len());
        if !self.visible {
            return;
        }
        let anchor = self.anchor.to_array();
        self.currents.fill_near(field, self.bounds, anchor, 0);
        let waves = if levels.waves > 0.0 { around.waves } else { &[] };
        self.trains.fill(waves, around.depth, anchor);
        self.touch(around.obstacles, levels.contact);
    }

    fn touch(&mut self, obstacles: &[Obstacle], contact: f64) {
        self.capsules.clear();
        if contact <= 0.0 {
            return;
        }
        let center = DVec3::from(self.bounds.center);
        for obstacle in obstacles {
            let from = DVec3::from(obstacle.from);
            let delta = Vec3::from(obstacle.delta).as_dvec3();
            let t = ((center - from).dot(delta) / delta.length_squared().max(1e-12)).clamp(0.0, 1.0);
            let near = (from + delta * t).distance(center);
            if near < self.bounds.radius + f64::from(obstacle.radius) {
                self.capsules.push(Capsule {
                    from: (from - self.anchor).as_vec3().to_array(),
                    delta: obstacle.delta,
                    radius: obstacle.radius,
                });
            }
        }
    }
}
