//! How far a level of detail strays from the finest one.

use glam::Vec3;

use super::Shape;

/// The square of the distance from a place to the nearest point of a triangle [m²].
fn distance_squared([a, b, c]: [Vec3; 3], p: Vec3) -> f32 {
    let segment = |a: Vec3, b: Vec3| {
        let t = ((p - a).dot(b - a) / (b - a).length_squared().max(1e-12)).clamp(0.0, 1.0);
        p.distance_squared(a + (b - a) * t)
    };
    let edges = segment(a, b).min(segment(b, c)).min(segment(c, a));
    let normal = (b - a).cross(c - a);
    let inside = [(a, b), (b, c), (c, a)].iter().all(|(a, b)| (*b - *a).cross(p - *a).dot(normal) >= 0.0);
    let off = (p - a).dot(normal);
    if inside { edges.min(off * off / normal.length_squared().max(1e-30)) } else { edges }
}

/// The triangles of a piece: limb, first index, end.
fn triangles(shape: &Shape, [_, begin, end]: [usize; 3]) -> Vec<[Vec3; 3]> {
    let place = |i: u32| Vec3::from(shape.vertices[i as usize].position);
    shape.indices[begin..end].chunks_exact(3).map(|t| [t[0], t[1], t[2]].map(place)).collect()
}

/// Corners and middles.
fn samples(of: &[[Vec3; 3]]) -> impl Iterator<Item = Vec3> + '_ {
    of.iter().flat_map(|[a, b, c]| [*a, *b, *c, (*a + *b + *c) / 3.0])
}

/// What may be between the samples.
const SLACK: f64 = 1.05;
/// Triangles of a leaf.
const FEW: usize = 4;

/// A box around triangles.
#[derive(Clone, Copy, Debug)]
struct Bounds {
    low: Vec3,
    high: Vec3,
}

impl Bounds {
    fn of(triangles: &[[Vec3; 3]]) -> Self {
        let nothing = Self { low: Vec3::MAX, high: Vec3::MIN };
        triangles
            .iter()
            .flatten()
            .fold(nothing, |around, p| Self { low: around.low.min(*p), high: around.high.max(*p) })
    }

    fn distance_squared(&self, p: Vec3) -> f32 {
        p.clamp(self.low, self.high).distance_squared(p)
    }
}

/// Triangles in a tree of boxes, each of which is halved across its longest side.
struct Tree {
    triangles: Vec<[Vec3; 3]>,
    /// The boxes, each before those in it: the box, its first triangle, its end, and the number of the box
    /// after all that are in it.
    nodes: Vec<(Bounds, [usize; 2], usize)>,
}

impl Tree {
    fn of(triangles: Vec<[Vec3; 3]>) -> Self {
        let mut tree = Self { nodes: Vec::with_capacity(triangles.len()), triangles };
        let end = tree.triangles.len();
        if end > 0 {
            tree.add([0, end]);
        }
        tree
    }

    fn add(&mut self, [begin, end]: [usize; 2]) {
        let own = &mut self.triangles[begin..end];
        let bounds = Bounds::of(own);
        let number = self.nodes.len();
        self.nodes.push((bounds, [begin, end], 0));
        if own.len() > FEW {
            let axis = (bounds.high - bounds.low).max_position();
            let middle = own.len() / 2;
            let at = |[a, b, c]: &[Vec3; 3]| (*a + *b + *c)[axis];
            own.select_nth_unstable_by(middle, |a, b| at(a).total_cmp(&at(b)));
            self.add([begin, begin + middle]);
            self.add([begin + middle, end]);
        }
        self.nodes[number].2 = self.nodes.len();
    }

    /// Square of the distance from a place to the nearest triangle; or, where that is no more than `enough`,
    /// to one that is so near [m²].
    fn nearest(&self, p: Vec3, enough: f32) -> f32 {
        let (mut best, mut at) = (f32::MAX, 0);
        while let Some((bounds, [begin, end], after)) = self.nodes.get(at) {
            if bounds.distance_squared(p) >= best {
                at = *after;
                continue;
            }
            at += 1;
            if end - begin <= FEW {
                best = self.triangles[*begin..*end]
                    .iter()
                    .fold(best, |best, t| best.min(distance_squared(*t, p)));
                if best <= enough {
                    break;
                }
            }
        }
        best
    }
}

/// The greatest of `worst` and the squared distances from places on some triangles to the nearest of others:
/// those are looked at no longer than until one is so near that the worst stays.
fn farthest_of(from: &[[Vec3; 3]], to: &Tree, worst: f32) -> f32 {
    samples(from).fold(worst, |worst, p| worst.max(to.nearest(p, worst)))
}

/// Farthest that a level is from the finest, and the finest from it [m]: limb by limb, and where a limb is
/// left out, from all that is there.
pub(crate) fn farthest(shape: &Shape, finest: &[[usize; 3]], own: &[[usize; 3]]) -> f64 {
    let all = Tree::of(own.iter().flat_map(|piece| triangles(shape, *piece)).collect());
    let worst = finest.iter().zip(own).fold(0.0, |worst, (fine, coarse)| {
        let [fine, coarse] = [fine, coarse].map(|piece| Tree::of(triangles(shape, *piece)));
        let there = if coarse.triangles.is_empty() { &all } else { &coarse };
        let worst = farthest_of(&fine.triangles, there, worst);
        if fine.triangles.is_empty() { worst } else { farthest_of(&coarse.triangles, &fine, worst) }
    });
    f64::from(worst).sqrt() * SLACK
}

#[cfg(test)]
mod tests {
    use reef_flow::random::Random;

    use super::*;

    #[test]
    fn a_tree_finds_the_distance_that_a_look_at_all_triangles_finds() {
        let mut random = Random::new(7, 0x7ee);
        let mut place = |spread: f64| Vec3::from([(); 3].map(|()| (spread * random.signed()) as f32));
        // Small ones all over, and a few that reach across them.
        let triangles: Vec<[Vec3; 3]> = (0..700)
            .map(|i| {
                let (middle, size) = (place(1.0), if i % 50 == 0 { 1.0 } else { 0.05 });
                [(); 3].map(|()| middle + place(size))
            })
            .collect();
        let tree = Tree::of(triangles.clone());
        for _ in 0..300 {
            let p = place(1.5);
            let all = triangles.iter().map(|t| distance_squared(*t, p)).fold(f32::MAX, f32::min);
            assert!((tree.nearest(p, 0.0) - all).abs() < 1e-6);
            let enough = tree.nearest(p, 2.0 * all);
            assert!((all..=2.0 * all + 1e-6).contains(&enough) && tree.nearest(p, f32::MAX) >= all);
        }
        assert_eq!(Tree::of(Vec::new()).nearest(Vec3::ZERO, 0.0), f32::MAX);
    }
}
