//! A slice of an animal with what hangs from it. Most animals have one; with two at right angles, the axis of
//! symmetry is no longer assumed (the paper's future work, §5).

use glam::{DVec2, Vec2};
use reef_flow::Level;

use crate::{slice::Slice, species::Species, trail::Trail, water::Grid};

/// Links of a trail.
pub(super) const LINKS: usize = 16;
/// How fast trails sink, in lengths of their own a second.
const SINK: f64 = 0.3;
/// Where arms stand around the mouth, and how far apart their tips drift, in widths of the bell.
const MOUTH: f64 = 0.04;
const ARM_SPREAD: f64 = 0.12;

/// A slice, and the trails of the tentacles on both of its sides and of the arms.
#[derive(Clone, Debug)]
pub(super) struct Section {
    pub(super) slice: Slice<f32>,
    /// Where its middle was first [m].
    pub(super) first: DVec2,
    pub(super) trails: [Trail; 3],
}

impl Section {
    /// At rest.
    ///
    /// # Errors
    /// As [`Slice::new`].
    pub(super) fn new(species: &Species, grid: Grid) -> Result<Self, String> {
        let slice = Slice::<f32>::new(species.build(), grid)?;
        let diameter = species.bell.diameter;
        let hanging = (species.tentacles.length - species.bell.strand).max(0.01 * diameter);
        let lengths = [hanging, hanging, species.arms.length.max(0.01 * diameter)];
        let leaders = leaders(&slice);
        let trails = core::array::from_fn(|k| Trail::new(leaders[k], LINKS, lengths[k], SINK * lengths[k]));
        Ok(Self { first: slice.place(), slice, trails })
    }

    /// Points of a tentacle, and of an arm.
    pub(super) fn points(&self) -> [usize; 2] {
        [self.slice.strand(0).len() + LINKS, LINKS + 1]
    }

    /// One step of the slice and of its trails of `dt` [s].
    pub(super) fn step(&mut self, level: Level, dt: f64) {
        self.slice.step(level, dt);
        let (leaders, corner) = (leaders(&self.slice), self.slice.corner());
        for (trail, leader) in self.trails.iter_mut().zip(leaders) {
            trail.step(self.slice.water(), corner, leader, dt);
        }
    }

    /// The pairs of the bell's points, from the apex to the margin, from the bell's middle [m].
    pub(super) fn bell(&self) -> impl Iterator<Item = [Vec2; 2]> + '_ {
        let origin = self.slice.place();
        let near = move |point: DVec2| (point - origin).as_vec2();
        let (right, left) = (self.slice.chain().rev(), self.slice.chain());
        let count = left.len().div_ceil(2);
        right.zip(left).take(count).map(move |(right, left)| [near(right), near(left)])
    }

    /// The points of the tentacles on the side of positive x and opposite, from root to tip, from the bell's
    /// middle [m].
    pub(super) fn tentacles(&self) -> impl Iterator<Item = [Vec2; 2]> + Clone + '_ {
        let origin = self.slice.place();
        let near = move |point: DVec2| (point - origin).as_vec2();
        let [left, right] =
            [0, 1].map(|side| self.slice.strand(side).chain(self.trails[side].points().iter().copied()));
        right.zip(left).map(move |(right, left)| [near(right), near(left)])
    }

    /// The same of the arms, which hang from the mouth and drift apart toward their tips.
    pub(super) fn arms(&self) -> impl Iterator<Item = [Vec2; 2]> + Clone + '_ {
        let (origin, diameter) = (self.slice.place(), self.slice.build().diameter);
        let hanging = core::iter::once(mouth(&self.slice)).chain(self.trails[2].points().iter().copied());
        hanging.enumerate().map(move |(k, point)| {
            let spread = MOUTH + ARM_SPREAD * k as f64 / LINKS as f64;
            let aside = Vec2::new((spread * diameter) as f32, 0.0);
            let point = (point - origin).as_vec2();
            [point + aside, point - aside]
        })
    }
}

/// What the trails follow.
fn leaders(slice: &Slice<f32>) -> [DVec2; 3] {
    let mouth = mouth(slice);
    let tip = |side: usize| slice.strand(side).last().unwrap_or(mouth);
    [tip(0), tip(1), mouth]
}

/// Where the arms hang: the inner apex.
fn mouth(slice: &Slice<f32>) -> DVec2 {
    let chain = slice.chain();
    let middle = chain.len() / 2;
    slice.chain().nth(middle).unwrap_or_default()
}

/// Points, and a point between each two neighbours: that of the cubic through four of them.
pub(super) fn rounded(pairs: impl Iterator<Item = [Vec2; 2]> + Clone) -> impl Iterator<Item = [Vec2; 2]> {
    let before = pairs.clone().take(1).chain(pairs.clone());
    let after = pairs.clone().skip(1);
    let last = pairs.clone().last();
    let beyond = pairs.clone().skip(2).chain(last).chain(last);
    let between = after.zip(before).zip(beyond).map(Some).chain([None]);
    pairs.zip(between).flat_map(|(own, between)| {
        let middle = between.map(|((after, before), beyond)| {
            core::array::from_fn(|i| (9.0 * (own[i] + after[i]) - (before[i] + beyond[i])) / 16.0)
        });
        [Some(own), middle].into_iter().flatten()
    })
}
