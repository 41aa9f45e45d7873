//! The least that a step of shoaling points costs: they are sorted, each takes note of its neighbours by
//! Reynolds' three rules, turns and moves; one kind in still water without walls, wishes and feelings. What a
//! shoal's step is measured against.

use fearless_simd::{Simd, f32x8, prelude::*};
use glam::Vec3;
use reef_flow::{Level, random::Random, simd::splat};
use reef_sdk::Workers;

use super::{
    Kind,
    decide::gathered,
    grid::{Grid, Seen},
    habits::Habits,
    perceive::{self, Lists, NOTED, Sight},
};
use crate::lanes::{Lane, add_scaled, scale, store3, sub, unit_or};

/// Points of one kind, of its own size, that stay where they are: each step is the same.
#[derive(Clone, Debug)]
pub struct Bare {
    habits: Habits,
    grid: Grid,
    lists: Lists,
    /// Where each is kept: at its number.
    kept: Vec<u32>,
    seen: Vec<Seen>,
    /// How far each takes note of others [m].
    reach: f32,
    /// Where they would be after a step [m].
    moved: Vec<[Lane; 3]>,
    noted: f64,
}

/// Share of where the others go and are that a point takes on in a step.
const SHARE: f32 = 0.1;
/// Side of the cells that was the fastest, over how far points look.
const CELL: f32 = 1.1;
/// How long a step is [s].
const DT: f32 = 1.0 / 60.0;
/// Share of the ball around a fish that it sees: all but for the 60 degrees behind it.
const BALL: f64 = 0.933;

impl Bare {
    /// So many points that have so many cubic lengths of water each, and see no farther than they have to, to
    /// take note of as many as fish of a shoal do.
    pub fn new(kind: &Kind, count: usize, water: f64) -> Self {
        let length = kind.length();
        let side = length * (water * count as f64).cbrt();
        let mut random = Random::new(1, 1);
        let mut three = |scale: f64| Vec3::from([(); 3].map(|()| (scale * random.signed()) as f32));
        let seen = (0..count).map(|_| Seen {
            at: three(0.5 * side),
            course: three(1.0).normalize_or(Vec3::X),
            length: length as f32,
            courts: false,
        });
        let ball = 4.0 / 3.0 * core::f64::consts::PI * BALL;
        let reach = (length * (f64::from(NOTED) * water / ball).cbrt()) as f32;
        Self {
            habits: Habits::of(core::slice::from_ref(kind)).remove(0),
            grid: Grid::new(count, CELL * reach),
            lists: Lists::default(),
            kept: (0..count as u32).collect(),
            seen: seen.collect(),
            reach,
            moved: vec![[Lane::default(); 3]; count.div_ceil(8)],
            noted: 0.0,
        }
    }

    /// How many points there are.
    pub fn count(&self) -> usize {
        self.seen.len()
    }

    /// Of how many others a point took note in the last step, on average.
    pub fn noted(&self) -> f64 {
        self.noted / self.seen.len() as f64
    }

    /// One step.
    pub fn step(&mut self, level: Level) {
        let Self { grid, kept, seen, .. } = self;
        grid.fill(Workers::inline(), (0, kept), |at| seen[at]);
        self.noted = 0.0;
        reef_flow::dispatch!(level, simd => self.all(simd));
    }

    #[inline(always)]
    fn all<S: Simd>(&mut self, simd: S) {
        let Self { habits, grid, lists, reach, moved, noted, .. } = self;
        let (one, share) = (splat(simd, 1.0), splat(simd, SHARE));
        for (eight, moved) in moved.iter_mut().enumerate() {
            let first = 8 * eight;
            let count = (grid.len() - first).min(8);
            let own = gathered(simd, grid, first, count);
            let mut sight = Sight::none(simd);
            perceive::own(simd, (grid, habits), &own, splat(simd, *reach), lists, &mut sight);
            let per = one / sight.count.max(one);
            let mut urge = add_scaled(own.course, sight.apart, splat(simd, habits.separation));
            urge = add_scaled(urge, sub(scale(sight.courses, per), own.course), share);
            urge = add_scaled(urge, sight.ways, per * share);
            let course = unit_or(simd, urge, own.course);
            let speed = own.length * splat(simd, habits.top * DT);
            store3(moved, add_scaled(own.at, course, speed));
            let counts: [f32; 8] = f32x8::into(sight.count);
            *noted += counts[..count].iter().map(|count| f64::from(*count)).sum::<f64>();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::species::Species;

    #[test]
    fn a_point_takes_note_of_as_many_as_a_fish_of_a_shoal_does() {
        let kind = Kind::new(&Species::default(), Vec::new()).expect("a kind");
        let mut bare = Bare::new(&kind, 20_000, 2.0);
        bare.step(Level::best());
        // Those at the edge see fewer.
        assert!((18.0..24.0).contains(&bare.noted()), "{}", bare.noted());
    }
}
