//! Both sides of a bell in its slice: the chain, and the exumbrella along its normals by the thickness of
//! figure 3, sampled at the rings.

use glam::{DVec2, Vec2};
use reef_flow::Level;

use super::{form::Form, spline::Resample};

/// The profile of a bell in one slice, with the room to make it.
#[derive(Clone, Debug)]
pub(crate) struct Profile {
    /// Rings of the bell.
    rings: usize,
    /// Points of the chain from the apex to the margin.
    margin: usize,
    /// Thickness ϑ [m], and that of the margin as a share.
    thickness: f32,
    margin_thickness: f32,
    resample: Resample,
    /// x and y of the knots, and of the samples.
    knots: [Vec<f32>; 2],
    normals: Vec<Vec2>,
    samples: [Vec<f32>; 2],
}

impl Profile {
    /// For a chain of so many points.
    pub(crate) fn new(form: &Form, thickness: f64, points: usize) -> Self {
        let knots = 2 * points;
        // Right samples from the outer to the inner apex, then the left ones, then both apices.
        let way = points as f64;
        let right = (0..form.rings).map(|ring| way * form.place(ring));
        let left = (0..form.rings).map(|ring| knots as f64 - way * form.place(ring));
        let places: Vec<f64> = right.chain(left).chain([0.0, way]).collect();
        let resample = Resample::new(knots, &places);
        let room = vec![0.0; resample.samples()];
        Self {
            rings: form.rings,
            margin: points / 2,
            thickness: thickness as f32,
            margin_thickness: form.margin_thickness as f32,
            knots: [vec![0.0; knots], vec![0.0; knots]],
            normals: vec![Vec2::ZERO; points],
            samples: [room.clone(), room],
            resample,
        }
    }

    /// Thickness at a share of the way from the apex to the margin [m]: figure 3's profile, thickest at the
    /// apex.
    pub(crate) fn thickness_at(&self, share: f32) -> f32 {
        let margin = self.margin_thickness;
        self.thickness * (margin + (1.0 - margin) * (1.0 - share * share))
    }

    /// Takes the chain: both of its sides as a loop, and its samples; places relative to `origin`.
    pub(crate) fn take(&mut self, level: Level, chain: impl Iterator<Item = DVec2>, origin: DVec2) {
        let (margin, points) = (self.margin as isize, 2 * self.margin + 1);
        // The chain runs from the margin of negative x to that of positive x. On the loop the outer apex is
        // 0, the right side follows, the inner apex is `points`.
        let outer = |i: usize| (i as isize - margin).rem_euclid(2 * points as isize) as usize;
        let inner = |i: usize| (points as isize - (i as isize - margin)) as usize;
        let [x, y] = &mut self.knots;
        for (i, point) in chain.enumerate().take(points) {
            [x[inner(i)], y[inner(i)]] = (point - origin).as_vec2().to_array();
        }
        for i in 0..points {
            let at = |i: usize| Vec2::new(self.knots[0][inner(i)], self.knots[1][inner(i)]);
            let along = at((i + 1).min(points - 1)) - at(i.saturating_sub(1));
            let normal = along.perp().normalize_or(Vec2::Y);
            self.normals[i] = normal;
            let share = (i as isize - margin).unsigned_abs() as f32 / margin as f32;
            let outside = at(i) + normal * self.thickness_at(share);
            [self.knots[0][outer(i)], self.knots[1][outer(i)]] = outside.to_array();
        }
        reef_flow::dispatch!(level, simd => {
            for (knots, samples) in self.knots.iter().zip(&mut self.samples) {
                self.resample.apply(simd, knots, samples);
            }
        });
    }

    fn sample(&self, at: usize) -> Vec2 {
        Vec2::new(self.samples[0][at], self.samples[1][at])
    }

    /// The points of a ring's pair: on the side of positive x, and opposite.
    pub(crate) fn pair(&self, ring: usize) -> [Vec2; 2] {
        [self.sample(ring), self.sample(self.rings + ring)]
    }

    /// The outer and the inner apex.
    pub(crate) fn apices(&self) -> [Vec2; 2] {
        [self.sample(2 * self.rings), self.sample(2 * self.rings + 1)]
    }

    /// The chain's normal at a share of the way from the apex to the margin, on the side of positive x and
    /// opposite.
    pub(crate) fn outward(&self, share: f32) -> [Vec2; 2] {
        let place = share * self.margin as f32;
        let cell = (place as usize).min(self.margin - 1);
        let between = place - cell as f32;
        let (right, left) = (self.margin + cell, self.margin - cell);
        [
            self.normals[right].lerp(self.normals[right + 1], between),
            self.normals[left].lerp(self.normals[left - 1], between),
        ]
    }
}
