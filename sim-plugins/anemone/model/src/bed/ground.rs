//! Plants on the sea bed and among rocks.

use glam::{DVec3, Vec3};
use reef_flow::Sphere;
use reef_sdk::{Heightfield, abi::Obstacle};

use super::{Base, Batch, Standing};
use crate::{
    frame::Frame,
    sow::Seedling,
    wide::{Capsule, Contacts, Ground, LANES, lanes},
};

/// How far a foot's root lies below the ground, in radii of its base: no gap shows under the flare.
pub(super) const BURIED: f64 = 0.08;
/// What is so near to the ground at rest [m] counts as standing in it: more than rounding moves a node.
const SLACK: f64 = 1e-6;
/// How much of the ground's slope a plant's stand leans with.
const SLOPE_SHARE: f64 = 0.6;

impl Standing {
    pub(super) fn stand_on(&mut self, ground: Option<&Heightfield<'_>>, rocks: &[Obstacle], buried: f64) {
        self.origin = self.position;
        self.stand = Frame::upright(self.yaw);
        if let (true, Some(ground)) = (self.grounded, ground) {
            let [x, z] = [self.position.x, self.position.z];
            let bed = f64::from(ground.height(x, z));
            let (height, normal) = match on_rock(rocks, x, z, bed) {
                Some(found) => found,
                None => (bed, normal_of(ground, x, z)),
            };
            self.origin.y = height + self.position.y - buried;
            let up = DVec3::Y.lerp(normal, SLOPE_SHARE).normalize_or(DVec3::Y);
            self.stand = Frame::along(up, self.stand.x);
        }
        self.top = (DVec3::ZERO, self.stand);
    }
}

/// Unit normal of the bed.
fn normal_of(ground: &Heightfield<'_>, x: f64, z: f64) -> DVec3 {
    let e = f64::from(ground.cell);
    let slope = |dx: f64, dz: f64| {
        f64::from(ground.height(x + dx, z + dz) - ground.height(x - dx, z - dz)) / (2.0 * e)
    };
    DVec3::new(-slope(e, 0.0), 1.0, -slope(0.0, e)).normalize_or(DVec3::Y)
}

/// Height and normal of the highest rock over (x, z), where one rises over the bed.
fn on_rock(rocks: &[Obstacle], x: f64, z: f64, bed: f64) -> Option<(f64, DVec3)> {
    let mut best: Option<(f64, DVec3)> = None;
    for rock in rocks {
        let (from, delta) = (DVec3::from(rock.from), Vec3::from(rock.delta).as_dvec3());
        let radius = f64::from(rock.radius);
        // The highest point of the capsule over (x, z), found along its axis by sections.
        let flat2 = delta.x * delta.x + delta.z * delta.z;
        let near = ((x - from.x) * delta.x + (z - from.z) * delta.z) / flat2.max(1e-12);
        for t in [0.0, near.clamp(0.0, 1.0), 1.0] {
            let center = from + delta * t;
            let off2 = (x - center.x) * (x - center.x) + (z - center.z) * (z - center.z);
            let rise2 = radius * radius - off2;
            if rise2 > 0.0 {
                let top = center.y + rise2.sqrt();
                if top > bed && best.is_none_or(|(highest, _)| top > highest) {
                    best = Some((top, (DVec3::new(x, top, z) - center) / radius));
                }
            }
        }
    }
    best
}

/// One cell of a lattice over the world: who stands in the same one is evaluated relative to the same point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Cell {
    at: [i64; 3],
    grounded: bool,
}

impl Cell {
    /// [m]: in f32, what lies so near is placed to a quarter of a micrometre.
    const SIZE: f64 = 4.0;

    pub(super) fn of(seedling: &Seedling) -> Self {
        let at = seedling.position.to_array().map(|x| (x / Self::SIZE).round() as i64);
        Self { at, grounded: seedling.grounded }
    }

    /// What its fibres are relative to [m, world].
    fn anchor(self, ground: Option<&Heightfield<'_>>) -> DVec3 {
        let mut anchor = DVec3::from(self.at.map(|x| x as f64 * Self::SIZE));
        if let (true, Some(ground)) = (self.grounded, ground) {
            anchor.y += f64::from(ground.height(anchor.x, anchor.z));
        }
        anchor
    }
}

impl Batch {
    /// Once, when all plants stand: what everything in here is relative to, and what lies around.
    pub(super) fn settle(&mut self, plants: &[Standing], ground: Option<&Heightfield<'_>>) {
        let of = |fibre: usize| self.plants.get(fibre).and_then(|plant| plants.get(*plant as usize));
        let Some(first) = of(0) else { return };
        self.anchor = match self.base {
            Base::Foot(_) => first.origin,
            Base::Cell(cell) => cell.anchor(ground),
        };
        let mut center = DVec3::ZERO;
        for fibre in 0..self.plants.len() {
            center += of(fibre).map_or(DVec3::ZERO, |plant| plant.origin - self.anchor);
        }
        center = self.anchor + center / self.plants.len() as f64;
        let mut radius: f64 = 0.0;
        for fibre in 0..self.plants.len() {
            if let Some(plant) = of(fibre) {
                radius = radius.max(plant.origin.distance(center) + plant.reach);
            }
        }
        self.bounds = Sphere { center: center.to_array(), radius };
        let offsets: Vec<Vec3> = (0..self.plants.len())
            .map(|fibre| of(fibre).map_or(Vec3::ZERO, |plant| (plant.origin - self.anchor).as_vec3()))
            .collect();
        for (fibre, offset) in offsets.iter().enumerate() {
            self.chunk.set_offset(fibre, *offset);
        }
        let stands: Vec<Frame> =
            (0..self.plants.len()).map(|fibre| of(fibre).map_or(first.stand, |plant| plant.stand)).collect();
        self.chunk.carry_each(|fibre| (DVec3::ZERO, stands.get(fibre).copied().unwrap_or(first.stand)));
        if let Some(ground) = ground.filter(|_| first.grounded) {
            self.lay_ground(plants, ground);
        }
    }

    /// The ground as one plane for each plant, and what of each stands in it at rest.
    fn lay_ground(&mut self, plants: &[Standing], ground: &Heightfield<'_>) {
        let groups = self.plants.len().div_ceil(LANES);
        let segments = if self.is_riding() { 0 } else { self.chunk.segments() };
        self.contacts.ground = vec![Ground::default(); groups];
        self.contacts.rooted = vec![[0.0; LANES]; segments * groups];
        for (group, at, fibre) in lanes(self.plants.len()) {
            let Some(plant) = plants.get(self.plants[fibre] as usize) else { continue };
            let (x, z) = (plant.origin.x, plant.origin.z);
            let normal = normal_of(ground, x, z);
            let bed = DVec3::new(x, f64::from(ground.height(x, z)), z);
            let into = &mut self.contacts.ground[group];
            for (axis, value) in into.normal.iter_mut().zip(normal.to_array()) {
                axis[at] = value as f32;
            }
            into.height[at] = normal.dot(bed - self.anchor) as f32;
            if self.is_riding() {
                continue;
            }
            let root = plant.origin + self.chunk.node(fibre, 0).as_dvec3();
            let rest = self.chunk.shape(fibre).rest_nodes(root, &self.chunk.root_frame(fibre));
            for (s, node) in rest.iter().skip(1).enumerate() {
                if normal.dot(*node - bed) < f64::from(self.chunk.radius(fibre, s + 1)) + SLACK {
                    self.contacts.rooted[s * groups + group][at] = Contacts::ROOTED;
                }
            }
        }
    }

    /// Collects the rocks near by.
    pub(super) fn touch(&mut self, rocks: &[Obstacle], contact: f32) {
        self.contacts.capsules.clear();
        if contact <= 0.0 {
            return;
        }
        let center = DVec3::from(self.bounds.center);
        for rock in rocks {
            let from = DVec3::from(rock.from);
            let delta = Vec3::from(rock.delta).as_dvec3();
            let t = ((center - from).dot(delta) / delta.length_squared().max(1e-12)).clamp(0.0, 1.0);
            let near = from + delta * t;
            if near.distance(center) < self.bounds.radius + f64::from(rock.radius) {
                self.contacts.capsules.push(Capsule {
                    from: (from - self.anchor).as_vec3().to_array(),
                    delta: rock.delta,
                    radius: rock.radius,
                });
            }
        }
    }
}
