//! Who of other modules is in the sea. Fish keep off them as off rocks, and flee from those that are large
//! and fast, or that their species fears.

use core::cmp::Ordering;

use glam::{DVec3, Vec3};
use reef_sdk::abi::{Actor, Obstacle};

use super::{Surroundings, habits::Habits, walls};

/// What frightens a fish is wider than so many of its lengths, and faster than this share of its top speed.
const LARGE: f32 = 1.0;
const FAST: f32 = 0.8;

/// Somebody of another module.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stranger {
    /// [m, world]
    pub position: DVec3,
    /// [m/s]
    pub velocity: Vec3,
    /// [m]
    pub radius: f32,
    /// Of its species' name.
    pub species: u32,
}

impl From<&Actor> for Stranger {
    fn from(actor: &Actor) -> Self {
        Self {
            position: actor.position.into(),
            velocity: actor.velocity.into(),
            radius: actor.radius,
            species: actor.species,
        }
    }
}

impl Stranger {
    /// Whether fish of a kind that are so long [m] flee from it.
    fn frightens(&self, habits: &Habits, length: f32) -> bool {
        let fast = FAST * habits.top * length;
        let haunts = 2.0 * self.radius > LARGE * length && self.velocity.length_squared() > fast * fast;
        haunts || habits.fears.contains(&self.species)
    }

    /// The way to it, and the square of that to its skin [m²], for a fish that sees so far [m]: None beyond.
    fn seen(&self, at: DVec3, range: f32) -> Option<(Vec3, f32)> {
        let way = (self.position - at).as_vec3();
        let gap = (way.length() - self.radius).max(0.0);
        (gap < range).then_some((way, gap * gap))
    }
}

/// What stands or goes about in the sea in one step, and who of that may frighten somebody.
#[derive(Clone, Debug, Default)]
pub(super) struct Standing {
    /// In the order of their x.
    strangers: Vec<Stranger>,
    /// Rocks; then the strangers as if they stood where they are.
    pub(super) obstacles: Vec<Obstacle>,
    rocks: usize,
    /// Radius of the widest stranger [m].
    widest: f64,
    /// Strangers that frighten fish of some kind.
    pub(super) frightening: Vec<Stranger>,
}

impl Standing {
    /// Takes them up. `shortest`: length of the shortest fish of each kind [m].
    pub(super) fn fill(
        &mut self,
        around: &Surroundings<'_>,
        habits: &[Habits],
        shortest: impl Iterator<Item = f32> + Clone,
    ) {
        let Self { strangers, obstacles, rocks, widest, frightening } = self;
        strangers.clear();
        strangers.extend_from_slice(around.strangers);
        // In one order, in whichever they came.
        strangers.sort_unstable_by(|a, b| {
            let key = |of: &Stranger| [of.position.x, of.position.y, of.position.z, of.radius.into()];
            let order = key(a).into_iter().zip(key(b)).map(|(a, b)| a.total_cmp(&b));
            order.fold(Ordering::Equal, Ordering::then)
        });
        obstacles.clear();
        obstacles.extend_from_slice(around.obstacles);
        *rocks = obstacles.len();
        obstacles.extend(strangers.iter().map(|stranger| Obstacle {
            from: stranger.position.to_array(),
            radius: stranger.radius,
            ..Obstacle::default()
        }));
        *widest = strangers.iter().map(|one| f64::from(one.radius)).fold(0.0, f64::max);
        frightening.clear();
        let frightens = |stranger: &&Stranger| {
            habits.iter().zip(shortest.clone()).any(|(habits, length)| stranger.frightens(habits, length))
        };
        frightening.extend(strangers.iter().filter(frightens));
    }
}

/// What is near a cell of the water, by numbers.
#[derive(Clone, Debug, Default)]
pub(super) struct Near {
    pub(super) obstacles: Vec<u32>,
    pub(super) frightening: Vec<u32>,
}

impl Near {
    /// Makes room for all of them.
    pub(super) fn reserve(&mut self, standing: &Standing) {
        // Room for all of them, not for as many more as are in the lists.
        self.obstacles.clear();
        self.obstacles.reserve(standing.obstacles.len());
        self.frightening.clear();
        self.frightening.reserve(standing.frightening.len());
    }

    /// Takes up what matters to fish within `radius` [m] of a place; the longest of them is so long, and the
    /// one that sees farthest sees so far [m].
    pub(super) fn fill(
        &mut self,
        standing: &Standing,
        at: DVec3,
        radius: f64,
        [longest, farthest]: [f64; 2],
    ) {
        self.obstacles.clear();
        let reach = radius + walls::reach(longest);
        let (rocks, strangers) = standing.obstacles.split_at(standing.rocks);
        let side = reach + standing.widest;
        let first = strangers.partition_point(|one| one.from[0] < at.x - side);
        let count = strangers[first..].partition_point(|one| one.from[0] <= at.x + side);
        let strangers = (standing.rocks + first..).zip(&strangers[first..first + count]);
        let near = rocks.iter().enumerate().chain(strangers);
        let near = near.filter(|(_, obstacle)| walls::touches(obstacle, at, reach));
        self.obstacles.extend(near.map(|(number, _)| number as u32));
        self.frightening.clear();
        let range = (radius + farthest) as f32;
        let near = (0..).zip(&standing.frightening).filter(|(_, one)| one.seen(at, range).is_some());
        self.frightening.extend(near.map(|(number, _)| number));
    }

    /// Who of those that a fish is frightened by is nearest: the way there, and the square of that to its
    /// skin [m²]. What is behind it, it does not see: `sees` says so of a way.
    pub(super) fn threat(
        &self,
        standing: &Standing,
        habits: &Habits,
        (at, length): (DVec3, f32),
        sees: impl Fn(Vec3) -> bool,
    ) -> Option<(Vec3, f32)> {
        let all = self.frightening.iter().map(|number| &standing.frightening[*number as usize]);
        let feared = all.filter(|one| one.frightens(habits, length));
        let seen = feared.filter_map(|one| one.seen(at, habits.range * length));
        seen.filter(|(way, _)| sees(*way)).min_by(|a, b| a.1.total_cmp(&b.1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_asks_for_room_once_in_however_many_steps() {
        let standing = Standing { obstacles: vec![Obstacle::default(); 50], ..Standing::default() };
        let mut near = Near::default();
        near.reserve(&standing);
        let room = near.obstacles.capacity();
        assert!(room >= 50);
        (0..room as u32).for_each(|number| near.obstacles.push(number));
        near.reserve(&standing);
        assert_eq!(near.obstacles.capacity(), room);
    }
}
