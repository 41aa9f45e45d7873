//! Who is near whom: fish sorted by the cells of a lattice, in an order that depends on where they are alone.

use glam::Vec3;

/// What others see of a fish, relative to the shoal's anchor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Seen {
    /// Its cell.
    pub(super) key: u64,
    /// Number of the fish.
    pub(super) number: u32,
    pub(super) kind: u32,
    /// Centre [m].
    pub(super) at: Vec3,
    /// The way that it looks, unit.
    pub(super) course: Vec3,
    /// Its length and its width [m].
    pub(super) length: f32,
    pub(super) width: f32,
    /// How far it takes note of its own kind, in lengths.
    pub(super) reach: f32,
    /// It hunts others.
    pub(super) hunts: bool,
    /// It looks for a mate.
    pub(super) courts: bool,
}

/// All fish by cells.
#[derive(Clone, Debug, Default)]
pub(super) struct Grid {
    cell: f32,
    sorted: Vec<Seen>,
    hunters: Vec<Seen>,
}

/// Bits of a cell's number along an axis, and what is added to make it positive.
const BITS: u32 = 21;
const MIDDLE: i64 = 1 << (BITS - 1);
/// How many cells to each side of its own a fish looks through at most.
const MOST_CELLS: f32 = 4.0;
/// Cells to each side that the nearest-sighted looks through: smaller ones hold fewer that are out of range.
const LEAST_CELLS: f32 = 2.5;

impl Grid {
    /// A grid for fish that see so far [m].
    pub(super) fn new(ranges: impl Iterator<Item = f32> + Clone) -> Self {
        let farthest = ranges.clone().fold(0.0, f32::max);
        let nearest = ranges.fold(f32::INFINITY, f32::min);
        Self {
            cell: (nearest.min(farthest) / LEAST_CELLS).max(farthest / MOST_CELLS).max(1e-3),
            sorted: Vec::new(),
            hunters: Vec::new(),
        }
    }

    fn along(&self, x: f32) -> u64 {
        // A cast saturates, and takes what is no number to 0.
        ((x / self.cell).floor() as i64).saturating_add(MIDDLE).clamp(0, 2 * MIDDLE - 1) as u64
    }

    fn key(x: u64, y: u64, z: u64) -> u64 {
        (z << (2 * BITS)) | (y << BITS) | x
    }

    /// Sorts all fish anew.
    pub(super) fn fill(&mut self, fish: impl Iterator<Item = Seen>) {
        self.sorted.clear();
        for seen in fish {
            let [x, y, z] = [self.along(seen.at.x), self.along(seen.at.y), self.along(seen.at.z)];
            self.sorted.push(Seen { key: Self::key(x, y, z), ..seen });
        }
        self.sorted.sort_unstable_by_key(|seen| (seen.key, seen.number));
        self.hunters.clear();
        self.hunters.extend(self.sorted.iter().filter(|seen| seen.hunts));
    }

    /// Those that hunt, in the same order.
    pub(super) fn hunters(&self) -> &[Seen] {
        &self.hunters
    }

    /// All fish, in their order.
    pub(super) fn sorted(&self) -> &[Seen] {
        &self.sorted
    }

    /// Calls `look` with each fish that may be within `range` [m] of `at`, in their order.
    pub(super) fn near(&self, at: Vec3, range: f32, mut look: impl FnMut(&Seen)) {
        let low = (at - range).to_array().map(|x| self.along(x));
        let high = (at + range).to_array().map(|x| self.along(x));
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                let (first, last) = (Self::key(low[0], y, z), Self::key(high[0], y, z));
                let begin = self.sorted.partition_point(|seen| seen.key < first);
                self.sorted[begin..].iter().take_while(|seen| seen.key <= last).for_each(&mut look);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use reef_flow::random::Random;

    use super::*;

    #[test]
    fn what_is_beyond_the_lattice_is_in_its_outermost_cells() {
        let mut grid = Grid::new([1.0].into_iter());
        let places = [f32::MAX, f32::NEG_INFINITY, 0.0];
        let seen = |(number, x): (u32, f32)| Seen { number, at: Vec3::X * x, ..Seen::default() };
        grid.fill((0..).zip(places).map(seen));
        assert_eq!(grid.sorted().iter().map(|seen| seen.number).collect::<Vec<_>>(), [1, 2, 0]);
    }

    #[test]
    fn all_in_range_are_found_in_an_order_of_their_places_alone() {
        let mut random = Random::new(3, 1);
        let mut place = || Vec3::from([(); 3].map(|()| random.between(-4.0, 4.0) as f32));
        let fish: Vec<Seen> =
            (0..500).map(|number| Seen { number, at: place(), ..Seen::default() }).collect();
        let (mut grid, mut other) = (Grid::new([0.7, 1.3].into_iter()), Grid::new([0.7, 1.3].into_iter()));
        grid.fill(fish.iter().copied());
        other.fill(fish.iter().rev().copied());
        assert_eq!(grid.sorted(), other.sorted());
        for range in [0.7, 1.3, 2.5] {
            let mut found = Vec::new();
            grid.near(fish[7].at, range, |seen| {
                if seen.at.distance(fish[7].at) <= range {
                    found.push(seen.number);
                }
            });
            found.sort_unstable();
            let all = fish.iter().filter(|seen| seen.at.distance(fish[7].at) <= range);
            assert!(found.len() > 1);
            assert_eq!(found, all.map(|seen| seen.number).collect::<Vec<_>>());
        }
    }
}
