//! Which faces of the rocks the sun reaches: worked out once, when a scene begins, for every vertex. Light
//! that the waves focus lies nowhere else.

use std::f32::consts::{PI, TAU};

use glam::{DVec3, Vec3};
use reef_streams::environment::Rock;

use super::boulder::Shape;

/// Directions in which a rock's radius is known: rings from pole to pole, and places around each.
const RINGS: usize = 32;
const AROUND: usize = 64;
/// Share of a rock's radius from one look at a ray to the next.
const STEP: f32 = 0.06;
/// A ray that goes this deep through a rock, as a share of its radius, has lost all light; it keeps all above
/// [`FREE`].
const LOST: f32 = 0.08;
/// See [`LOST`]: as much as the radii that are known stray from the rock's surface.
const FREE: f32 = 0.025;
/// Cosine between a face and the sun's direction from which on it gets all light: below, the bumps of its
/// texture show.
const FACING: f32 = 0.3;

/// A scene's rocks as they stand in each other's light.
pub struct Sunlight {
    sun: Vec3,
    bodies: Vec<Body>,
}

struct Body {
    origin: DVec3,
    half_axes: Vec3,
    yaw: f32,
    /// As a share of the half axes, ring by ring.
    radii: Vec<f32>,
}

impl Sunlight {
    /// Takes the rocks' shapes. `sun`: unit vector toward it.
    pub fn new(rocks: &[Rock], sun: Vec3) -> Self {
        Self { sun, bodies: rocks.iter().map(Body::new).collect() }
    }

    /// What stands between rock `index` and the sun.
    pub fn on(&self, index: usize) -> Shade<'_> {
        let own = &self.bodies[index];
        let reach = |body: &Body| body.half_axes.max_element();
        let near = |body: &&Body| {
            let to = (body.origin - own.origin).as_vec3();
            let (along, both) = (to.dot(self.sun), reach(own) + reach(body));
            along > -both && to.length_squared() - along * along < both * both
        };
        Shade { sun: self.sun, origin: own.origin, bodies: self.bodies.iter().filter(near).collect() }
    }
}

/// One rock in the light of the sun.
pub struct Shade<'a> {
    sun: Vec3,
    origin: DVec3,
    /// Itself and those that may shade it.
    bodies: Vec<&'a Body>,
}

impl Shade<'_> {
    /// Share of the sun's light at a place on the rock, relative to its origin [m], with the unit normal
    /// `normal`.
    pub fn at(&self, place: Vec3, normal: Vec3) -> f32 {
        let facing = (normal.dot(self.sun) / FACING).clamp(0.0, 1.0);
        if facing == 0.0 {
            return 0.0;
        }
        let from = self.origin + place.as_dvec3();
        let deepest = self.bodies.iter().map(|body| body.depth((from - body.origin).as_vec3(), self.sun));
        let deepest = deepest.fold(0.0, f32::max);
        facing * facing * (3.0 - 2.0 * facing) * (1.0 - ((deepest - FREE) / (LOST - FREE)).clamp(0.0, 1.0))
    }
}

impl Body {
    fn new(rock: &Rock) -> Self {
        let shape = Shape::new(rock);
        let radii = (0..RINGS * AROUND).map(|n| {
            let (sin, cos) = (PI * ((n / AROUND) as f32 + 0.5) / RINGS as f32).sin_cos();
            let (z, x) = (TAU * ((n % AROUND) as f32 + 0.5) / AROUND as f32 - PI).sin_cos();
            shape.radius(Vec3::new(sin * x, cos, sin * z))
        });
        Self {
            origin: DVec3::from(rock.position),
            half_axes: Vec3::from(rock.half_axes),
            yaw: rock.yaw,
            radii: radii.collect(),
        }
    }

    /// A vector in the rock's own axes, in which its half axes are 1 long.
    fn own(&self, v: Vec3) -> Vec3 {
        let (sin, cos) = self.yaw.sin_cos();
        Vec3::new(v.x * cos - v.z * sin, v.y, v.x * sin + v.z * cos) / self.half_axes
    }

    /// How deep below the surface a ray comes at most, as a share of the radius; 0: it stays outside.
    fn depth(&self, from: Vec3, way: Vec3) -> f32 {
        let (from, way) = (self.own(from), self.own(way).normalize_or_zero());
        // Within the ball that holds the rock.
        let middle = -from.dot(way);
        let square = 1.0 - from.length_squared() + middle * middle;
        if square <= 0.0 || middle + square.sqrt() <= 0.0 {
            return 0.0;
        }
        let (start, end) = ((middle - square.sqrt()).max(0.0), middle + square.sqrt());
        let looks = ((end - start) / STEP).ceil();
        (1..=looks as usize)
            .map(|n| from + way * (start + (end - start) * n as f32 / looks))
            .map(|p| self.radius(p) - p.length())
            .fold(0.0, f32::max)
    }

    fn radius(&self, p: Vec3) -> f32 {
        let ring = (p.y / p.length().max(1e-6)).clamp(-1.0, 1.0).acos() / PI * RINGS as f32;
        let around = (p.z.atan2(p.x) + PI) / TAU * AROUND as f32;
        self.radii[(ring as usize).min(RINGS - 1) * AROUND + around as usize % AROUND]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rock(x: f64, height: f32) -> Rock {
        Rock { position: [x, 0.0, 0.0], half_axes: [0.5, height, 0.5], yaw: 0.7, seed: 3 }
    }

    #[test]
    fn faces_away_from_the_sun_and_behind_another_rock_get_no_light() {
        let sun = Vec3::new(0.8, 0.6, 0.0);
        let shape = |rock: &Rock, to: Vec3| {
            let place = Shape::new(rock).at(to.normalize());
            (place, place.normalize())
        };
        let low = rock(0.0, 0.4);
        let alone = Sunlight::new(&[low], sun);
        // The shape turns with the rock: of all directions some face the sun, and none behind it is lit.
        let mut lit = 0;
        for n in 0..400 {
            let y = 1.0 - (n as f32 + 0.5) / 200.0;
            let turn = n as f32 * 2.4;
            let side = (1.0 - y * y).sqrt();
            let (place, normal) = shape(&low, Vec3::new(side * turn.cos(), y, side * turn.sin()));
            let light = alone.on(0).at(place, normal);
            assert!(normal.dot(sun) > 0.0 || light == 0.0, "{light} at {place}");
            lit += u32::from(light > 0.9);
        }
        assert!((60..200).contains(&lit), "{lit} of 400 places are lit");
        // A wall between the sun and it.
        let behind = Sunlight::new(&[low, rock(1.1, 3.0)], sun);
        let (place, normal) = shape(&low, Vec3::Y);
        assert!(alone.on(0).at(place, normal) > 0.9 && behind.on(0).at(place, normal) < 0.05);
        // One far away on the other side is not even looked at.
        let before = Sunlight::new(&[low, rock(-8.0, 3.0)], sun);
        assert_eq!(before.on(0).at(place, normal), alone.on(0).at(place, normal));
        assert_eq!([&alone, &behind, &before].map(|light| light.on(0).bodies.len()), [1, 2, 1]);
    }
}
