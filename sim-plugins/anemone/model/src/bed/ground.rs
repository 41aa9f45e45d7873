//! Plants on the sea bed and among rocks.

use glam::{DVec3, Vec3};
use reef_flow::Sphere;
use reef_sdk::{Heightfield, abi::Obstacle};

use super::{Batch, Standing};
use crate::{
    frame::Frame,
    wide::{Capsule, Plane},
};

/// How far a foot's root lies below the ground, in radii of its base: no gap shows under the flare.
pub(super) const BURIED: f64 = 0.08;
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

impl Batch {
    /// Once, when all plants stand: what everything in here is relative to, and what lies around.
    pub(super) fn settle(&mut self, plants: &[Standing], ground: Option<&Heightfield<'_>>) {
        let of = |fibre: usize| self.plants.get(fibre).and_then(|plant| plants.get(*plant as usize));
        let Some(first) = of(0) else { return };
        // The first plant's own origin: where there is but one plant, its offsets are exactly zero.
        self.anchor = first.origin;
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
        // The ground as one plane: right for one plant, and for plants that stand apart too coarse to be used.
        let one_plant = self.plants.iter().all(|plant| *plant == self.plants[0]);
        self.contacts.ground = ground.filter(|_| one_plant && first.grounded).map(|ground| {
            let (x, z) = (first.origin.x, first.origin.z);
            let normal = normal_of(ground, x, z);
            let bed = DVec3::new(x, f64::from(ground.height(x, z)), z) - self.anchor;
            Plane { normal: normal.as_vec3().to_array(), height: normal.dot(bed) as f32 }
        });
        let stands: Vec<Frame> =
            (0..self.plants.len()).map(|fibre| of(fibre).map_or(first.stand, |plant| plant.stand)).collect();
        self.chunk.carry_each(|fibre| (DVec3::ZERO, stands.get(fibre).copied().unwrap_or(first.stand)));
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
