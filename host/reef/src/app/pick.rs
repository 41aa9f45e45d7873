//! What lies under the cursor: the sea's things as spheres, the ground as a height field. Shows and pokes,
//! never feeds the simulation by itself.

use glam::DVec3;
use reef_streams::{
    environment::Terrain,
    frame::{Frame, bounding_sphere},
};

/// Reach of a pick [m]: nothing can be made out farther away.
const REACH: f64 = 60.0;

/// A ray from the eye.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Start [m].
    pub origin: DVec3,
    /// Unit vector.
    pub direction: DVec3,
}

/// What a ray met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Id of the thing; 0: the ground.
    pub object: u64,
    /// Where [m].
    pub point: DVec3,
    /// From the eye [m].
    pub distance: f64,
    /// Middle of the thing [m].
    pub centre: DVec3,
    /// Radius of its bounding sphere [m].
    pub radius: f64,
}

/// A thing's bounding sphere: id (as other modules know it), centre [m], radius [m].
pub fn spheres(frame: &Frame) -> impl Iterator<Item = (u64, DVec3, f64)> + '_ {
    frame.outputs.iter().zip(&*frame.tags).flat_map(|(outputs, tag)| {
        outputs.objects.iter().map(move |object| {
            let (centre, radius) = bounding_sphere(object);
            (tag.foreign(object.id), centre, radius)
        })
    })
}

/// The nearest thing that the ray enters. A thing whose bounds hold the eye is looked past.
pub fn nearest_thing(ray: &Ray, things: impl Iterator<Item = (u64, DVec3, f64)>) -> Option<Hit> {
    let mut best: Option<Hit> = None;
    for (object, centre, radius) in things {
        let Some(distance) = enter_sphere(ray, centre, radius) else { continue };
        if distance <= REACH && best.is_none_or(|b| distance < b.distance) {
            let point = ray.origin + ray.direction * distance;
            best = Some(Hit { object, point, distance, centre, radius });
        }
    }
    best
}

/// The thing that a person means when nothing lies exactly under the cursor: the smallest angle beside the
/// ray, weighed with distance, among those in front.
pub fn meant_thing(ray: &Ray, things: impl Iterator<Item = (u64, DVec3, f64)>) -> Option<Hit> {
    let mut best: Option<(f64, Hit)> = None;
    for (object, centre, radius) in things {
        let to = centre - ray.origin;
        let along = to.dot(ray.direction);
        if along <= 0.0 || along > REACH {
            continue;
        }
        let beside = (to - ray.direction * along).length();
        let miss = (beside - radius).max(0.0) / along;
        let score = miss * 4.0 + along / REACH;
        if best.is_none_or(|(s, _)| score < s) {
            let distance = (to.length() - radius).max(0.0);
            best = Some((score, Hit { object, point: centre, distance, centre, radius }));
        }
    }
    best.map(|(_, hit)| hit)
}

/// Distance along the ray at which it enters the sphere; none from inside.
fn enter_sphere(ray: &Ray, centre: DVec3, radius: f64) -> Option<f64> {
    let to = centre - ray.origin;
    let along = to.dot(ray.direction);
    let beside2 = to.length_squared() - along * along;
    let half2 = radius * radius - beside2;
    if half2 < 0.0 {
        return None;
    }
    let half = half2.sqrt();
    (along - half >= 0.0).then_some(along - half)
}

/// Height of the ground [m] at x, z: bilinear, its edge continued outward.
pub fn ground(terrain: &Terrain, x: f64, z: f64) -> f64 {
    let (columns, rows) = (terrain.columns as usize, terrain.rows as usize);
    let sound = terrain.cell.is_finite() && terrain.cell > 0.0;
    if columns == 0 || rows == 0 || terrain.heights.len() < columns * rows || !sound {
        return f64::NEG_INFINITY;
    }
    let along = |value: f64, origin: f64, count: usize| {
        let at = ((value - origin) / f64::from(terrain.cell)).clamp(0.0, (count - 1) as f64);
        let low = (at.floor() as usize).min(count.saturating_sub(2));
        (low, (low + 1).min(count - 1), at - low as f64)
    };
    let (x0, x1, u) = along(x, terrain.origin[0], columns);
    let (z0, z1, v) = along(z, terrain.origin[1], rows);
    let height = |column: usize, row: usize| f64::from(terrain.heights[row * columns + column]);
    let near = height(x0, z0) * (1.0 - u) + height(x1, z0) * u;
    let far = height(x0, z1) * (1.0 - u) + height(x1, z1) * u;
    near * (1.0 - v) + far * v
}

/// Where the ray meets the ground: marched by the height above it, then halved.
pub fn meet_ground(ray: &Ray, terrain: &Terrain) -> Option<Hit> {
    let above = |t: f64| {
        let p = ray.origin + ray.direction * t;
        p.y - ground(terrain, p.x, p.z)
    };
    let (mut low, mut t) = (0.0, 0.0);
    while t < REACH {
        let height = above(t);
        if height <= 0.0 {
            let mut high = t;
            for _ in 0..32 {
                let middle = 0.5 * (low + high);
                if above(middle) > 0.0 { low = middle } else { high = middle }
            }
            let point = ray.origin + ray.direction * high;
            return Some(Hit { object: 0, point, distance: high, centre: point, radius: 0.3 });
        }
        low = t;
        t += (height * 0.5).clamp(0.02, 1.0);
    }
    None
}

/// The nearest of things and ground.
pub fn nearest(ray: &Ray, frame: &Frame, terrain: Option<&Terrain>) -> Option<Hit> {
    let thing = nearest_thing(ray, spheres(frame));
    let ground = terrain.and_then(|terrain| meet_ground(ray, terrain));
    match (thing, ground) {
        (Some(a), Some(b)) => Some(if a.distance <= b.distance { a } else { b }),
        (a, b) => a.or(b),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ray(origin: [f64; 3], direction: [f64; 3]) -> Ray {
        Ray { origin: origin.into(), direction: DVec3::from_array(direction).normalize() }
    }

    fn slope() -> Terrain {
        // y = -5 + x / 2 on an 8 m square.
        let heights = (0..9).flat_map(|_| (0..9).map(|column| -5.0 + column as f32 * 0.5)).collect();
        Terrain {
            origin: [0.0, 0.0],
            cell: 1.0,
            columns: 9,
            rows: 9,
            heights,
            rocks: Vec::new(),
            ripples: Default::default(),
        }
    }

    #[test]
    fn the_nearer_of_two_things_in_line_is_hit() {
        let things = [(7, DVec3::new(0.0, 0.0, -5.0), 1.0), (8, DVec3::new(0.1, 0.0, -9.0), 1.0)];
        let hit = nearest_thing(&ray([0.0; 3], [0.0, 0.0, -1.0]), things.into_iter()).unwrap();
        assert_eq!((hit.object, hit.distance), (7, 4.0));
        let hit = nearest_thing(&ray([0.0; 3], [0.0, 0.0, -1.0]), things.into_iter().rev()).unwrap();
        assert_eq!(hit.object, 7);
    }

    #[test]
    fn what_is_behind_or_beside_is_not_hit() {
        let things = [(7, DVec3::new(0.0, 0.0, 5.0), 1.0), (8, DVec3::new(3.0, 0.0, -5.0), 1.0)];
        assert!(nearest_thing(&ray([0.0; 3], [0.0, 0.0, -1.0]), things.into_iter()).is_none());
        let meant = meant_thing(&ray([0.0; 3], [0.0, 0.0, -1.0]), things.into_iter()).unwrap();
        assert_eq!(meant.object, 8);
    }

    #[test]
    fn a_thing_that_holds_the_eye_is_looked_past() {
        let things = [(7, DVec3::new(0.0, 0.0, -0.5), 1.0), (8, DVec3::new(0.0, 0.0, -5.0), 1.0)];
        let hit = nearest_thing(&ray([0.0; 3], [0.0, 0.0, -1.0]), things.into_iter()).unwrap();
        assert_eq!(hit.object, 8);
    }

    #[test]
    fn heights_are_bilinear_and_end_at_the_edge() {
        let terrain = slope();
        assert_eq!(ground(&terrain, 2.5, 3.3), -3.75);
        assert_eq!(ground(&terrain, -10.0, 3.0), -5.0);
        assert_eq!(ground(&terrain, 100.0, 100.0), -1.0);
    }

    #[test]
    fn a_ray_meets_the_slope_where_it_should() {
        let hit = meet_ground(&ray([2.0, 0.0, 4.0], [0.0, -1.0, 0.0]), &slope()).unwrap();
        assert!((hit.point.y + 4.0).abs() < 1e-6);
        // y = -1 at height -1 of a level ray: x = 8.
        let hit = meet_ground(&ray([0.0, -3.0, 4.0], [1.0, 0.0, 0.0]), &slope()).unwrap();
        assert!((hit.point.x - 4.0).abs() < 1e-6, "{:?}", hit.point);
        assert!(meet_ground(&ray([0.0, 0.0, 4.0], [0.0, 1.0, 0.0]), &slope()).is_none());
    }
}
