//! How far a level of detail strays from the finest one.

use glam::Vec3;

use super::Shape;

/// From a place to the nearest point of a triangle.
fn distance([a, b, c]: [Vec3; 3], p: Vec3) -> f32 {
    let segment = |a: Vec3, b: Vec3| {
        let t = ((p - a).dot(b - a) / (b - a).length_squared().max(1e-12)).clamp(0.0, 1.0);
        p.distance(a + (b - a) * t)
    };
    let edges = segment(a, b).min(segment(b, c)).min(segment(c, a));
    let normal = (b - a).cross(c - a).normalize_or_zero();
    let inside = [(a, b), (b, c), (c, a)].iter().all(|(a, b)| (*b - *a).cross(p - *a).dot(normal) >= 0.0);
    if inside { edges.min((p - a).dot(normal).abs()) } else { edges }
}

/// The triangles of a piece: limb, first index, end.
fn triangles(shape: &Shape, [_, begin, end]: [usize; 3]) -> Vec<[Vec3; 3]> {
    let place = |i: u32| Vec3::from(shape.vertices[i as usize].position);
    shape.indices[begin..end].chunks_exact(3).map(|t| [t[0], t[1], t[2]].map(place)).collect()
}

/// Samples of a triangle.
const SAMPLES: usize = 4;

/// Corners and middles.
fn samples(of: &[[Vec3; 3]]) -> impl Iterator<Item = Vec3> + '_ {
    of.iter().flat_map(|[a, b, c]| [*a, *b, *c, (*a + *b + *c) / 3.0])
}

/// What may be between the samples.
const SLACK: f32 = 1.05;

/// The greatest of `worst` and the distances from places on some triangles to the nearest of others. Both
/// are listed along the limb: the nearest is looked for from the same share of it on, and no longer than
/// until one is so near that the worst stays.
fn farthest_of(from: &[[Vec3; 3]], to: &[[Vec3; 3]], mut worst: f32) -> f32 {
    let ball = |[a, b, c]: &[Vec3; 3]| {
        let middle = (*a + *b + *c) / 3.0;
        (middle, middle.distance(*a).max(middle.distance(*b)).max(middle.distance(*c)))
    };
    let balls: Vec<(Vec3, f32)> = to.iter().map(ball).collect();
    for (number, p) in samples(from).enumerate() {
        let start = number / SAMPLES * to.len() / from.len();
        let mut best = f32::MAX;
        for at in (start..to.len()).chain((0..start).rev()) {
            let (middle, radius) = balls[at];
            // No point of a triangle is outside of its ball.
            if middle.distance_squared(p) < (best + radius) * (best + radius) {
                best = best.min(distance(to[at], p));
                if best <= worst {
                    break;
                }
            }
        }
        worst = worst.max(best);
    }
    worst
}

/// Farthest that a level is from the finest, and the finest from it [m]: limb by limb, and where a limb is
/// left out, from all that is there.
pub(crate) fn farthest(shape: &Shape, finest: &[[usize; 3]], own: &[[usize; 3]]) -> f64 {
    let all: Vec<[Vec3; 3]> = own.iter().flat_map(|piece| triangles(shape, *piece)).collect();
    let worst = finest.iter().zip(own).fold(0.0, |worst, (fine, coarse)| {
        let (fine, coarse) = (triangles(shape, *fine), triangles(shape, *coarse));
        let there = farthest_of(&fine, if coarse.is_empty() { &all } else { &coarse }, worst);
        if fine.is_empty() { there } else { farthest_of(&coarse, &fine, there) }
    });
    f64::from(worst * SLACK)
}
