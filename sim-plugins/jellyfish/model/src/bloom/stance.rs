//! Where an animal is and how its slices lie: from their planes to the world.

use glam::{DVec2, DVec3, Vec3};

use super::{animal::Animal, section::Section};
use crate::surface::Frame;

impl Animal {
    /// From points of its own slice to the world [m]: into the plane that leans as the slice across does.
    pub(super) fn world(&self) -> impl Fn(DVec2) -> DVec3 + use<> {
        let (upright, middle) = (self.upright(), self.own.slice.place());
        let leans = self.cross.as_ref().map(|_| (upright(middle), self.frames()[0]));
        move |point| match leans {
            None => upright(point),
            Some((place, frame)) => place + frame.of((point - middle).as_vec2()).as_dvec3(),
        }
    }

    /// The same where that plane is upright.
    fn upright(&self) -> impl Fn(DVec2) -> DVec3 + use<> {
        let (base, first) = (self.base, self.own.first);
        let [x, y, z] = [self.frame.x, self.frame.y, self.frame.z].map(|axis| axis.as_dvec3());
        let aside = self.cross.as_ref().map(|cross| z * (cross.slice.place() - cross.first).x);
        move |point| {
            let way = point - first;
            let place = base + x * way.x + y * way.y;
            aside.map_or(place, |aside| place + aside)
        }
    }

    /// From points of the slice across to the world [m].
    pub(super) fn world_across(&self, cross: &Section) -> impl Fn(DVec2) -> DVec3 + use<> {
        let (middle, place) = (cross.slice.place(), self.place());
        let (z, forward) = (self.frame.z.as_dvec3(), self.forward());
        move |point| {
            let way = point - middle;
            place + z * way.x + forward * way.y
        }
    }

    /// Middle of the bell [m, world].
    pub(super) fn place(&self) -> DVec3 {
        self.upright()(self.own.slice.place())
    }

    /// Where the apex of its own slice points, in the world: y of the slice across. A unit vector.
    pub(super) fn forward(&self) -> DVec3 {
        let axis = self.own.slice.axis();
        self.frame.x.as_dvec3() * axis.x + self.frame.y.as_dvec3() * axis.y
    }

    /// Where the apex points, in the world: a unit vector.
    pub(super) fn axis(&self) -> Vec3 {
        let forward = self.frame.of(self.own.slice.axis().as_vec2());
        let axis = self.cross.as_ref().map_or(forward, |cross| {
            let lean = cross.slice.axis().as_vec2();
            forward * lean.y + self.frame.z * lean.x
        });
        axis.normalize_or(Vec3::Y)
    }

    /// How its slices lie in the sea, and thus its skin: that along the heading leans as the one across does.
    pub(super) fn frames(&self) -> [Frame; 2] {
        if self.cross.is_none() {
            return [self.frame; 2];
        }
        let Frame { x, y, z } = self.frame;
        let (forward, axis) = (self.forward().as_vec3(), self.axis());
        let own = self.own.slice.axis().as_vec2();
        // In its plane: across its axis, and along it.
        let aside = x * own.y - y * own.x;
        let [x, y] = [aside * own.y + axis * own.x, axis * own.y - aside * own.x];
        [Frame { x, y, z: x.cross(y) }, Frame { x: z, y: forward, z: z.cross(forward) }]
    }
}
